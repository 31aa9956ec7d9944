//! Text in drawings: escaping, width and line breaks.

/// The font size, in units of the drawing.
pub(super) const SIZE: f64 = 13.0;
/// The distance between the baselines of two lines.
pub(super) const LINE: f64 = 18.0;
/// The width of bold letters relative to regular ones.
pub(super) const BOLD: f64 = 1.15;

/// The estimated width of a text.
pub(super) fn width(text: &str) -> f64 {
    text.chars().map(letter).sum()
}

/// The width of a letter in DejaVu Sans, whose letters are wider than in most common fonts.
fn letter(c: char) -> f64 {
    let ems = match c {
        ' ' | '.' | ',' | ':' | ';' | '!' | '|' | '\'' | 'i' | 'j' | 'l' | 'I' => 0.33,
        'f' | 't' | 'r' | 's' | '(' | ')' | '[' | ']' | '-' | '/' | '⁰'..='⁹' | '⁻' | '²' | '³' | '¹' => 0.45,
        'a'..='z' if !matches!(c, 'm' | 'w') => 0.62,
        '0'..='9' => 0.64,
        'm' | 'w' | 'M' | 'W' | '%' | '@' => 1.0,
        // East Asian letters fill a square.
        '\u{2e80}'.. => 1.0,
        _ => 0.8,
    };
    SIZE * ems
}

/// Escapes the characters that XML reserves. Forbidden characters are replaced by U+FFFD.
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

/// Wraps a text to a width: between words, and within a word that is wider than a line.
pub(super) fn wrapped(text: &str, widest: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(line) + width(" ") + width(word) <= widest => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.extend(pieces(word, widest)),
        }
    }
    lines
}

/// Splits a word into pieces within a width, of at least one letter each.
fn pieces(word: &str, widest: f64) -> Vec<String> {
    let mut pieces = vec![String::new()];
    let mut taken = 0.0;
    for c in word.chars() {
        taken += letter(c);
        match pieces.last_mut() {
            Some(piece) if taken <= widest || piece.is_empty() => piece.push(c),
            _ => {
                pieces.push(c.to_string());
                taken = letter(c);
            }
        }
    }
    pieces
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
        assert_eq!(wrapped("one two  three", width("one two") + 0.1), ["one two", "three"]);
        assert_eq!(wrapped("abcdeabcd ab c", width("abc") + 0.1), ["abc", "dea", "bcd", "ab", "c"]);
        assert_eq!(wrapped("äö", 0.0), ["ä", "ö"]);
        assert!(wrapped(" ", 100.0).is_empty());
    }
}
