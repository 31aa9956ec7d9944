//! Text in drawings: its escapes, its width, and where its lines break.

/// The size of letters, in units of the drawing.
pub(super) const SIZE: f64 = 13.0;
/// From one line to the next.
pub(super) const LINE: f64 = 18.0;
/// The mean width of a letter. It is a wide one, since the font is the reader's.
const LETTER: f64 = 7.4;

/// The width of a text, estimated.
pub(super) fn width(text: &str) -> f64 {
    LETTER * text.chars().count() as f64
}

/// A text with the characters replaced that XML reserves. Those that XML forbids become a replacement character.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            // XML 1.0, section 2.2, excludes these even as references.
            '\u{0}'..='\u{8}' | '\u{b}' | '\u{c}' | '\u{e}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => {
                escaped.push('\u{fffd}')
            }
            c => escaped.push(c),
        }
    }
    escaped
}

/// The lines of a text within a width: broken between words, and within a word that is wider than a line.
pub(super) fn wrapped(text: &str, widest: f64) -> Vec<String> {
    let most = ((widest / LETTER) as usize).max(1);
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let letters: Vec<char> = word.chars().collect();
        for (part, letters) in letters.chunks(most).enumerate() {
            let piece: String = letters.iter().collect();
            match lines.last_mut() {
                Some(line) if part == 0 && line.chars().count() + 1 + letters.len() <= most => {
                    line.push(' ');
                    line.push_str(&piece);
                }
                _ => lines.push(piece),
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reserved_and_forbidden_characters_are_replaced() {
        assert_eq!(escaped("a < \"b\" & c > d\t\u{1}"), "a &lt; &quot;b&quot; &amp; c &gt; d\t\u{fffd}");
    }

    #[test]
    fn lines_break_between_words_and_within_long_ones() {
        let most = |letters: usize| LETTER * letters as f64 + 0.01;
        assert_eq!(wrapped("one two  three", most(7)), ["one two", "three"]);
        assert_eq!(wrapped("abcdefgh ij", most(3)), ["abc", "def", "gh", "ij"]);
        assert_eq!(wrapped("ä", most(0)), ["ä"]);
        assert!(wrapped(" ", most(5)).is_empty());
    }
}
