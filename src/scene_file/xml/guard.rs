use super::limit;
use crate::scene_file::fault::ParseFault;

/// The numbers of elements and levels that a text may still have.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) elements: usize,
    pub(super) nesting: usize,
}

/// Scans a text before the XML parser builds a tree from it, and counts its elements.
///
/// It rejects text that would take much memory or stack, and features that scene files do not use (document types,
/// namespaces). At the first syntax error it stops without a fault: the parser will stop there too, and has the better
/// message.
pub(super) fn check(text: &str, room: Limits) -> Result<usize, (usize, ParseFault)> {
    let mut guard = Guard { text, at: 0, room, elements: 0, pieces: 0, open: Vec::new() };
    while guard.markup()?.is_some() {}
    match guard.open.last() {
        Some(&(offset, tag)) if guard.at == text.len() => {
            Err((offset, ParseFault::new(format!("<{tag}> is never closed")).hint(format!("close it with </{tag}>"))))
        }
        _ => Ok(guard.elements),
    }
}

struct Guard<'t> {
    text: &'t str,
    at: usize,
    room: Limits,
    elements: usize,
    pieces: usize,
    open: Vec<(usize, &'t str)>,
}

/// None stops the scan.
type Step = Result<Option<()>, (usize, ParseFault)>;

impl<'t> Guard<'t> {
    /// Skips text up to the next markup, and the markup.
    fn markup(&mut self) -> Step {
        let Some(skipped) = self.rest().find('<') else {
            self.at = self.text.len();
            return Ok(None);
        };
        self.at += skipped;
        let start = self.at;
        let rest = self.rest();
        if rest.starts_with("<!--") {
            self.piece(start)?;
            self.skip(start, "<!--", "-->", "a comment")
        } else if rest.starts_with("<![CDATA[") {
            self.piece(start)?;
            self.skip(start, "<![CDATA[", "]]>", "a CDATA section")
        } else if rest.starts_with("<?") {
            self.piece(start)?;
            self.skip(start, "<?", "?>", "a processing instruction")
        } else if rest.starts_with("<!") {
            Err((start, ParseFault::new("a document type declaration is not read").hint("remove it; scenes need none")))
        } else if rest.starts_with("</") {
            self.at = start + 2;
            let tag = self.word();
            let closes = self.open.pop().is_some_and(|(_, open)| open == tag);
            Ok(closes.then_some(()))
        } else {
            self.tag(start)
        }
    }

    /// Skips markup that ends with a fixed text.
    fn skip(&mut self, start: usize, opening: &str, closing: &str, what: &str) -> Step {
        let inside = start + opening.len();
        match self.text[inside..].find(closing) {
            Some(length) => {
                self.at = inside + length + closing.len();
                Ok(Some(()))
            }
            None => Err((
                start,
                ParseFault::new(format!("{what} is never closed")).hint(format!("close it with {closing}")),
            )),
        }
    }

    /// Skips an opening tag.
    fn tag(&mut self, start: usize) -> Step {
        self.at = start + 1;
        let tag = self.word();
        self.name(start, tag, "element")?;
        self.elements += 1;
        if self.elements > self.room.elements {
            let fault = ParseFault::new("too many elements");
            return Err((start, fault.hint(format!("a scene may have {}", limit::ELEMENTS))));
        }
        if self.open.len() >= self.room.nesting {
            let fault = ParseFault::new(format!("elements are nested more than {} deep", limit::NESTING));
            return Err((start, fault.hint("put an inner object outside and refer to it by <ref>")));
        }
        for count in 0.. {
            self.blanks();
            let here = self.at;
            if self.eat('>') {
                self.open.push((start, tag));
                return Ok(Some(()));
            }
            if self.eat('/') {
                return Ok(self.eat('>').then_some(()));
            }
            if self.rest().is_empty() {
                return Err((start, ParseFault::new(format!("<{tag} is never ended")).hint("end it with > or />")));
            }
            if count == limit::ATTRIBUTES {
                return Err((here, ParseFault::new(format!("<{tag}> has more than {count} attributes"))));
            }
            let name = self.word();
            if !self.quoted() {
                return Ok(None);
            }
            self.piece(here)?;
            if name == "xmlns" {
                return Err((here, ParseFault::new(format!("unexpected attribute \"xmlns\" in <{tag}>"))));
            }
            self.name(here, name, "attribute")?;
        }
        Ok(None)
    }

    /// Skips `= "..."`.
    fn quoted(&mut self) -> bool {
        self.blanks();
        if !self.eat('=') {
            return false;
        }
        self.blanks();
        let Some(quote) = self.rest().chars().next().filter(|c| matches!(c, '"' | '\'')) else { return false };
        self.at += 1;
        let Some(length) = self.rest().find(quote) else { return false };
        self.at += length + 1;
        true
    }

    fn name(&self, place: usize, name: &str, what: &str) -> Result<(), (usize, ParseFault)> {
        if name.contains(':') {
            let fault = ParseFault::new(format!("the {what} \"{name}\" has a namespace"));
            return Err((place, fault.hint("scene files have none")));
        }
        Ok(())
    }

    fn piece(&mut self, place: usize) -> Result<(), (usize, ParseFault)> {
        self.pieces += 1;
        if self.pieces > limit::PIECES {
            return Err((place, ParseFault::new("too many attributes and comments")));
        }
        Ok(())
    }

    fn rest(&self) -> &'t str {
        &self.text[self.at..]
    }

    fn eat(&mut self, c: char) -> bool {
        let found = self.rest().starts_with(c);
        self.at += usize::from(found);
        found
    }

    fn blanks(&mut self) {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start_matches([' ', '\t', '\r', '\n']).len();
    }

    /// The text up to the next blank or markup character.
    fn word(&mut self) -> &'t str {
        let rest = self.rest();
        let length = rest.find([' ', '\t', '\r', '\n', '/', '>', '=', '"', '\'', '<']).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }
}
