/// The text of a plugin's manual page, which is the doc comment of its type. So the command line and the library's
/// documentation have the same text.
#[derive(Clone, Copy, Debug)]
pub struct Manual {
    /// The source file.
    pub source: &'static str,
    /// The types in this file whose doc comments form the text.
    pub types: &'static [&'static str],
}

/// The [`Manual`] of a plugin, from a source file in the same folder and the types in it.
macro_rules! manual {
    ($file:literal: $($name:literal),+) => {
        $crate::scene_file::Manual { source: include_str!($file), types: &[$($name),+] }
    };
}

pub(crate) use manual;

impl Manual {
    /// The manual of a plugin without text.
    pub const NONE: Self = Self { source: "", types: &[] };

    /// The paragraphs of the text, in Markdown; a table is one paragraph.
    #[must_use]
    pub fn paragraphs(&self) -> Vec<String> {
        self.types.iter().flat_map(|name| paragraphs(&doc_comment(self.source, name))).collect()
    }
}

/// The lines of the doc comment of a type.
fn doc_comment<'s>(source: &'s str, name: &str) -> Vec<&'s str> {
    let lines: Vec<_> = source.lines().collect();
    let is_definition = |line: &&str| {
        let rest = line.strip_prefix("pub struct ").and_then(|rest| rest.strip_prefix(name));
        rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
    };
    let end = lines.iter().position(is_definition).unwrap_or(0);
    let is_before = |line: &&&str| line.starts_with("///") || line.starts_with("#[");
    let mut comment: Vec<_> = lines[..end].iter().rev().take_while(is_before).collect();
    comment.reverse();
    let text = |line: &&'s str| line.strip_prefix("///").map(|text| text.strip_prefix(' ').unwrap_or(text));
    comment.into_iter().filter_map(text).collect()
}

fn paragraphs(lines: &[&str]) -> Vec<String> {
    let blocks = lines.split(|line| line.trim().is_empty()).filter(|block| !block.is_empty());
    let joined = |block: &[&str]| block.join(if block[0].starts_with('|') { "\n" } else { " " });
    blocks.map(|block| without_links(&joined(block))).collect()
}

/// The text with rustdoc links replaced by plain words.
fn without_links(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("[`") {
        let Some((word, after)) = after.split_once("`]") else { break };
        plain += &format!("{before}`{word}`");
        let target = after.strip_prefix('(').and_then(|target| target.split_once(')'));
        rest = target.map_or(after, |(_, after)| after);
    }
    plain + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "/// Of another.\npub struct Balls;\n\n/// A [`Ball`] of\n/// [`mass`](crate::Mass) one.\n///\n/// | a | b |\n/// |---|---|\n#[derive(Debug)]\npub struct Ball {\n";

    #[test]
    fn a_page_is_the_doc_comment_of_its_type() {
        let manual = Manual { source: SOURCE, types: &["Ball"] };
        assert_eq!(manual.paragraphs(), ["A `Ball` of `mass` one.", "| a | b |\n|---|---|"]);
        assert_eq!(Manual { source: SOURCE, types: &["Balls", "Ball"] }.paragraphs()[0], "Of another.");
        assert!(Manual { source: SOURCE, types: &["Bal"] }.paragraphs().is_empty());
    }
}
