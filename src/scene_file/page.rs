//! Manual pages of plugins, as text.

use super::{DefaultValue, Param, ParamKind, Plugin, Range};

/// The width of a page in characters.
const WIDTH: usize = 80;

impl Plugin {
    /// The manual page: what the plugin is, its formula and source, its parameters, an example, and its evidence.
    #[must_use]
    pub fn page(&self) -> String {
        let mut page = format!("{} {}\n\n", self.category, self.name);
        for paragraph in self.manual.paragraphs() {
            page += &format!("{}\n\n", filled(&paragraph, ""));
        }
        page += "Parameters\n";
        let (effective, ignored): (Vec<&Param>, Vec<&Param>) = self.all_params().partition(|param| param.has_effect);
        if effective.is_empty() {
            page += "  none\n";
        }
        for param in effective {
            page += &format!("  {} ({})\n{}\n", param.name, param.terms(), filled(&param.meaning(), "      "));
        }
        if !ignored.is_empty() {
            page += "\nParameters of Mitsuba without effect\n";
        }
        for param in ignored {
            page += &format!("  {} ({})\n{}\n", param.name, param.kind.name(), filled(param.description, "      "));
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
    /// The type, range and default of the parameter.
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

    /// The meaning of the parameter, with its allowed words.
    #[must_use]
    pub fn meaning(&self) -> String {
        match self.kind {
            ParamKind::Choice(words) => format!("{}: {}", self.description, words.join(", ")),
            _ => self.description.into(),
        }
    }
}

impl ParamKind {
    /// The tag of this category in a scene file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Float => "float",
            Self::Integer => "integer",
            Self::Boolean => "boolean",
            Self::String | Self::File | Self::Choice(_) => "string",
            Self::Rgb | Self::Index => "rgb",
            Self::Texture => "texture",
            Self::Point => "point",
            Self::Mesh => "mesh",
            Self::Transform => "transform",
            Self::Object(category) => category.tag(),
        }
    }
}

/// A paragraph in lines of at most [`WIDTH`] characters; longer words are not broken. A table is not changed.
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

    #[test]
    fn paragraphs_fill_their_lines() {
        let text = "é ".repeat(100);
        let lines: Vec<_> = filled(&text, "  ").lines().map(|line| line.chars().count()).collect();
        assert_eq!(lines, [79, 79, 45]);
    }
}
