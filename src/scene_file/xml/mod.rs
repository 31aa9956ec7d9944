//! Reads Mitsuba 3's scene XML into a [`Document`]: typed objects with typed properties, references resolved. This
//! module does not depend on any plugin.
//!
//! The steps, one file each: `source` reads a file within limits and turns offsets into places. `guard` rejects hostile
//! text before a tree is built from it. `params` substitutes `$name`. `element` checks attributes; `values` and
//! `transform` parse them. `reader` walks the tree; `property` reads values, and `include` reads included files.
//! `upgrade` renames the properties of files older than 2.0.0. `refs` resolves `<ref>` at the end, so that an object
//! may be defined after the references to it.
//!
//! # Where this reader differs from Mitsuba 3
//!
//! A scene that étendue reads means the same in Mitsuba 3. The reverse holds except for the following cases. Mitsuba
//! (3.9.1) accepts them with a meaning that their author cannot have wanted; each is an error here:
//!
//! - `<rotate>` with an axis that is not a unit vector: Mitsuba does not normalise the axis, and shears. A length
//!   within 1e-5 of 1 is accepted as 1, so four digits are enough.
//! - A child object with the name of an earlier property: Mitsuba ignores the earlier one.
//! - Direct children of an included `<scene>` that are not objects: Mitsuba ignores properties and `<ref>`s there. It
//!   also ignores the `name` of an included root and of an `<include>` of a scene.
//! - `<path>` in an included file: Mitsuba ignores it when it opens the files that plugins name.
//! - A parameter value that contains `$` or ends with `\`: Mitsuba substitutes again, but only shorter names.
//! - Transforms that are singular or not finite; a `<matrix>` whose last row is not `0 0 0 1` (which Mitsuba ignores);
//!   elements inside `<translate>` and the other operations (which Mitsuba ignores).
//! - Numbers that are empty (0 in Mitsuba), `nan`, or too large for a double (infinity in Mitsuba). `inf` is a valid
//!   `<float>`, but not a valid coordinate or colour.
//! - `<scene>` inside a scene, a root object without a `type`, a property without a name, versions like `3.0.0a`.
//! - In files older than 2.0.0, `toWorld` beside `to_world` (Mitsuba keeps the old name and ignores it later).
//! - `up` within 1e-9 of the direction of a `<lookat>`, where rounding alone would determine the roll.
//! - A document type declaration, a second root element, and anything that exceeds the limits of this module.
//!
//! étendue accepts more than Mitsuba in three cases: an `<alias>` in an included file sees the ids of the including
//! file, an `<integer>` is accepted where a `<float>` is expected, and a `$parameter` for an integer may be written as
//! `1e5`.
//!
//! As in Mitsuba, an `<include>` is searched beside the including file, then beside the files that include that one,
//! then in each `<path>`, the last first. The files that *plugins* name are relative to the folder of the *scene*, also
//! in an included file. A `<path>` is applied by rewriting `filename`: it is searched before the scene's folder.

mod element;
mod guard;
mod include;
mod params;
mod property;
mod reader;
pub(super) mod refs;
mod source;
#[cfg(test)]
mod tests;
mod transform;
mod upgrade;
pub(super) mod values;

use std::path::Path;

use crate::scene_file::{Document, SceneError};

/// Limits of a scene, over all its files together. They are far above any real scene, and low enough to reject a
/// hostile one before it takes memory or stack.
mod limit {
    /// Bytes of XML.
    pub(super) const BYTES: usize = 64 << 20;
    /// Elements.
    pub(super) const ELEMENTS: usize = 1_000_000;
    /// Attributes, comments and processing instructions in one file.
    pub(super) const PIECES: usize = 4_000_000;
    /// Attributes of one element; valid elements have at most five.
    pub(super) const ATTRIBUTES: usize = 16;
    /// Nesting depth of elements, through includes too; it bounds the stack.
    pub(super) const NESTING: usize = 100;
    /// Nesting depth of objects through references; it bounds the stack of the code that builds them.
    pub(super) const LEVELS: usize = 200;
    /// Nesting depth of includes; the same as Mitsuba's.
    pub(super) const INCLUDE_DEPTH: usize = 15;
    /// `<include>` elements in all: included files may include others, so that their number may double with each level.
    pub(super) const INCLUDES: usize = 1_000;
    /// Parameter substitutions.
    pub(super) const SUBSTITUTIONS: usize = 1_000_000;
    /// Bytes of text that substitutions produce.
    pub(super) const SUBSTITUTED: usize = 64 << 20;
    /// Bytes of a parameter's name.
    pub(super) const PARAMETER_NAME: usize = 64;
}

/// Reads a scene file and all files that it includes.
///
/// `definitions` are the parameters of the command line, as names and values. They override the `<default>`s of the
/// scene. A parameter that the scene does not use is an error.
///
/// # Errors
///
/// All faults that were found, file by file in the order of their lines.
pub fn read(path: &Path, definitions: &[(String, String)]) -> Result<Document, SceneError> {
    let name = path.display().to_string();
    let text = source::load(path, &name, limit::BYTES).map_err(|fault| SceneError(vec![fault]))?;
    let folder = path.parent().unwrap_or_else(|| Path::new(""));
    reader::document(&text, &name, folder, path.canonicalize().ok(), definitions)
}

/// Reads a scene from text. File names in it are relative to `folder`, and messages call it `name`.
///
/// # Errors
///
/// As [`read`].
pub fn parse(text: &str, name: &str, folder: &Path, definitions: &[(String, String)]) -> Result<Document, SceneError> {
    reader::document(text, name, folder, None, definitions)
}

/// Reads a single element without a `version`, such as an example of a manual page.
///
/// # Errors
///
/// As [`read`].
pub fn parse_element(element: &str) -> Result<Document, SceneError> {
    let versioned = element.replacen(" type=", " version=\"3.0.0\" type=", 1);
    parse(&versioned, "example", Path::new(""), &[])
}
