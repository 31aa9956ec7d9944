use super::{DefaultValue, Param, ParamKind, Plugin, Range};

/// The text of a plugin's manual page. It is the doc comment of its type, so that the page of the command line and that of
/// the library's documentation are one text.
#[derive(Clone, Copy, Debug)]
pub struct Manual {
    /// The source file.
    pub source: &'static str,
    /// The types in it whose doc comments make the text.
    pub types: &'static [&'static str],
}

/// The [`Manual`] of a plugin, from its source file, beside the one where this stands, and its types.
macro_rules! manual {
    ($file:literal: $($name:literal),+) => {
        $crate::scene_file::Manual { source: include_str!($file), types: &[$($name),+] }
    };
}

pub(crate) use manual;

/// The width of a page in characters.
const WIDTH: usize = 80;

impl Manual {
    /// Of a plugin that has none.
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

/// The text with links of the documentation as plain words.
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

impl Plugin {
    /// The manual page: what the plugin is, its formula and source, its parameters, an example, and its evidence.
    #[must_use]
    pub fn page(&self) -> String {
        let mut page = format!("{} {}\n\n", self.category, self.name);
        for paragraph in self.manual.paragraphs() {
            page += &format!("{}\n\n", filled(&paragraph, ""));
        }
        page += "Parameters\n";
        for param in self.params {
            page += &format!("  {} ({})\n{}\n", param.name, param.terms(), filled(&param.meaning(), "      "));
        }
        if self.params.is_empty() {
            page += "  none\n";
        }
        if let Some(example) = self.examples.first() {
            page += "\nExample\n";
            for line in example.lines() {
                page += &format!("  {}\n", line.strip_prefix("            ").unwrap_or(line));
            }
        }
        if !self.evidence.is_empty() {
            page += &format!("\nEvidence\n{}\n", filled(&self.evidence.join(", "), "  "));
        }
        page
    }
}

impl Param {
    /// Its type, its range and its default.
    fn terms(&self) -> String {
        let mut terms = vec![self.kind.name().to_owned()];
        if self.range != Range::FINITE {
            terms.push(self.range.describe());
        }
        terms.push(match self.default {
            DefaultValue::Required => "required".into(),
            DefaultValue::Absent(without) => format!("default: {without}"),
            DefaultValue::Value(value) => format!("default {value}"),
        });
        terms.join(", ")
    }

    /// What it means, with the words that it may be.
    #[must_use]
    pub fn meaning(&self) -> String {
        match self.kind {
            ParamKind::Choice(words) => format!("{}: {}", self.description, words.join(", ")),
            _ => self.description.into(),
        }
    }
}

impl ParamKind {
    /// The tag with which it stands in a scene file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Float => "float",
            Self::Integer => "integer",
            Self::Boolean => "boolean",
            Self::String | Self::File | Self::Choice(_) => "string",
            Self::Rgb => "rgb",
            Self::Texture => "texture",
            Self::Point => "point",
            Self::Mesh => "mesh",
            Self::Transform => "transform",
            Self::Object(category) => category.tag(),
        }
    }
}

/// A paragraph in lines of at most [`WIDTH`] characters, as far as its words allow; a table stays as it is.
fn filled(text: &str, indent: &str) -> String {
    if text.starts_with('|') {
        return text.to_owned();
    }
    let (mut lines, mut line) = (Vec::new(), String::from(indent));
    for word in text.split_whitespace() {
        let is_first = line.len() == indent.len();
        if !is_first && line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(std::mem::replace(&mut line, format!("{indent}{word}")));
            continue;
        }
        line += if is_first { "" } else { " " };
        line += word;
    }
    lines.push(line);
    lines.join("\n")
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

    #[test]
    fn paragraphs_fill_their_lines() {
        let text = "é ".repeat(100);
        let lines: Vec<_> = filled(&text, "  ").lines().map(|line| line.chars().count()).collect();
        assert_eq!(lines, [79, 79, 45]);
    }
}
