use std::{cell::Cell, fs, io::Read, path::Path, sync::Arc};

use crate::scene_file::{Diagnostic, SourceLocation};

use super::limit;
use crate::scene_file::fault::ParseFault;

/// Reads a file of at most `limit` bytes; messages call it `name`.
pub(super) fn load(path: &Path, name: &str, limit: usize) -> Result<String, Diagnostic> {
    let unreadable = |error: &dyn std::fmt::Display| ParseFault::new(format!("{name}: cannot read: {error}")).at(None);
    let metadata = fs::metadata(path).map_err(|error| unreadable(&error))?;
    if !metadata.is_file() {
        return Err(unreadable(&"it is not a file"));
    }
    // The length is checked before reading, and the reading is bounded in case the file grows.
    let mut bytes = Vec::new();
    if metadata.len() <= limit as u64 {
        let file = fs::File::open(path).map_err(|error| unreadable(&error))?;
        file.take(limit as u64 + 1).read_to_end(&mut bytes).map_err(|error| unreadable(&error))?;
    }
    if metadata.len() > limit as u64 || bytes.len() > limit {
        return Err(too_large(name));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let text = std::str::from_utf8(&error.as_bytes()[..valid]).unwrap_or_default();
        ParseFault::new("this is not UTF-8")
            .hint("save the file as UTF-8")
            .at(Some(SourceText::new(name, text).place(valid)))
    })
}

/// The fault of a file that would exceed the limit on bytes.
pub(super) fn too_large(name: &str) -> Diagnostic {
    ParseFault::new(format!("{name}: too large"))
        .hint(format!("a scene may take {} MiB of XML, included files among them", limit::BYTES >> 20))
        .at(None)
}

/// The text of a file, and places in it.
pub(super) struct SourceText<'t> {
    pub(super) text: &'t str,
    pub(super) name: Arc<str>,
    /// The place returned last: offset, line, column. Places are mostly requested in document order. Continuing from
    /// the last one makes all requests together linear in the length of the text, even with long lines.
    last: Cell<(usize, u32, u32)>,
}

impl<'t> SourceText<'t> {
    pub(super) fn new(name: &str, text: &'t str) -> Self {
        // Editors do not count a byte order mark as a column.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self { text, name: name.into(), last: Cell::new((0, 1, 1)) }
    }

    /// The place of a byte offset.
    pub(super) fn place(&self, offset: usize) -> SourceLocation {
        let offset = offset.min(self.text.len());
        let (mut from, mut line, mut column) = self.last.get();
        if offset < from {
            (from, line, column) = (0, 1, 1);
        }
        for byte in &self.text.as_bytes()[from..offset] {
            if *byte == b'\n' {
                (line, column) = (line + 1, 1);
            } else if byte & 0xC0 != 0x80 {
                // Continuation bytes of a character do not count.
                column += 1;
            }
        }
        self.last.set((offset, line, column));
        SourceLocation::File { file: self.name.clone(), line, column }
    }

    /// The text as a tree. The caller must run [`super::guard::check`] first.
    pub(super) fn tree(&self) -> Result<roxmltree::Document<'t>, (SourceLocation, ParseFault)> {
        roxmltree::Document::parse(self.text).map_err(|error| syntax(&error, self))
    }
}

/// A fault of the XML itself.
fn syntax(error: &roxmltree::Error, source: &SourceText<'_>) -> (SourceLocation, ParseFault) {
    use roxmltree::Error;
    let position = error.pos();
    let what = error.to_string().replace(&format!(" at {position}"), "");
    let fault = ParseFault::new(format!("not XML: {what}"));
    let place = match error {
        Error::UnexpectedEndOfStream => source.place(source.text.len()),
        _ => SourceLocation::File { file: source.name.clone(), line: position.row, column: position.col },
    };
    let fault = match error {
        Error::MalformedEntityReference(_) | Error::UnknownEntityReference(..) => fault.hint("write &amp; for &"),
        Error::InvalidAttributeValue(_) | Error::InvalidChar(b'"' | b'\'', b'<', _) => {
            fault.hint("write &lt; for < in an attribute, and close the quotes before a tag")
        }
        Error::InvalidComment(_) => fault.hint("write fewer dashes"),
        Error::NoRootNode => fault.hint("a scene file begins with <scene version=\"3.0.0\">"),
        _ => fault,
    };
    (place, fault)
}
