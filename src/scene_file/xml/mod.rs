//! Reads Mitsuba 3's scene XML into a [`Document`]: typed objects with typed properties, references resolved.
//! Nothing in here knows a shape from a light.
//!
//! The steps, one file each: `source` reads a file within limits and turns offsets into places; `guard` refuses
//! hostile text before a tree is made of it; `params` substitutes `$name`; `element` checks attributes; `values` and
//! `transform` read what they say; `reader` walks the tree, `property` takes its values and `include` its other files;
//! `upgrade` renames the properties of files older than 2.0.0; `refs` resolves `<ref>` at the end, so that references
//! to what stands later work.
//!
//! # Where this reader differs from Mitsuba 3
//!
//! A scene that is read here means the same in Mitsuba 3. The reverse holds but for these, which Mitsuba (3.9.1) takes
//! and gives a meaning that its writer cannot have wanted; each is an error here:
//!
//! - `<rotate>` with an axis that is not a unit vector: Mitsuba does not normalise it and shears. A length of 1 to
//!   within 1e-5 is taken for 1, so four digits do.
//! - A child object with the name of an earlier property: Mitsuba forgets the earlier one.
//! - What stands directly in an included `<scene>` and is not an object: Mitsuba forgets properties and `<ref>`s there;
//!   it also forgets the `name` of an included root and of an `<include>` of a scene.
//! - `<path>` in an included file: Mitsuba has forgotten it when it opens the files that plugins name.
//! - A parameter's value with a `$` in it or a `\` at its end: Mitsuba substitutes again, shorter names only.
//! - Transforms that are singular or not finite, and a `<matrix>` whose last row is not `0 0 0 1` (which Mitsuba does
//!   not look at); elements inside `<translate>` and the like (ignored).
//! - Numbers that are empty (0 in Mitsuba), `nan`, or too large for a double (infinity in Mitsuba). `inf` is a
//!   `<float>`, but no coordinate or colour.
//! - `<scene>` inside a scene, a root object without a `type`, a property without a name, versions like `3.0.0a`.
//! - In files older than 2.0.0, `toWorld` beside `to_world` (Mitsuba keeps the old name and ignores it later).
//! - `up` within 1e-9 of the direction of a `<lookat>`, where rounding alone would choose the roll.
//! - A document type declaration, a second root element, and whatever exceeds the limits of this module.
//!
//! More is allowed in three cases: an `<alias>` in an included file sees the ids of the including file, an `<integer>`
//! may stand where a `<float>` is wanted, and a `$parameter` that stands for an integer may be given as `1e5`.
//!
//! As in Mitsuba, an `<include>` is looked for beside the including file (then beside the files around it, then in
//! each `<path>`, the last first), but the files that *plugins* name start from the folder of the *scene*, also when
//! an included file names them. A `<path>` is honoured by rewriting `filename`: it comes before the scene's folder.

mod element;
pub(super) mod fault;
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

/// What a scene may take, all its files together. Far above any real scene, and low enough that a hostile one is
/// refused before it takes memory or stack.
mod limit {
    /// Bytes of XML.
    pub(super) const BYTES: usize = 64 << 20;
    /// Elements.
    pub(super) const ELEMENTS: usize = 1_000_000;
    /// Attributes, comments and processing instructions in one file.
    pub(super) const PIECES: usize = 4_000_000;
    /// Attributes of one element; no element has more than five.
    pub(super) const ATTRIBUTES: usize = 16;
    /// Elements inside one another, through includes too; it bounds the stack.
    pub(super) const NESTING: usize = 100;
    /// Objects inside one another through references; it bounds the stack of whoever builds them.
    pub(super) const LEVELS: usize = 200;
    /// Files inside one another; Mitsuba's number.
    pub(super) const INCLUDE_DEPTH: usize = 15;
    /// `<include>` elements in all, because each may double the next.
    pub(super) const INCLUDES: usize = 1_000;
    /// Parameter substitutions.
    pub(super) const SUBSTITUTIONS: usize = 1_000_000;
    /// Bytes that substitutions make.
    pub(super) const SUBSTITUTED: usize = 64 << 20;
    /// Bytes of a parameter's name.
    pub(super) const PARAMETER_NAME: usize = 64;
    /// Faults that are reported.
    pub(super) const FAULTS: usize = 50;
    /// Bytes that a message may have before its middle is left out.
    pub(super) const MESSAGE: usize = 400;
}

/// Reads a scene file and all it includes.
///
/// `definitions` are the parameters of the command line, name and value; they come before the scene's `<default>`s,
/// and one that the scene does not use is an error.
///
/// # Errors
///
/// Every fault that was found, file by file in the order of their lines.
pub fn read(path: &Path, definitions: &[(String, String)]) -> Result<Document, SceneError> {
    let name = path.display().to_string();
    let text = source::load(path, &name, limit::BYTES).map_err(|fault| SceneError(vec![fault]))?;
    let folder = path.parent().unwrap_or_else(|| Path::new(""));
    reader::document(&text, &name, folder, path.canonicalize().ok(), definitions)
}

/// The same from text; file names in it are relative to `folder`, and messages call it `name`.
///
/// # Errors
///
/// As [`read`].
pub fn parse(text: &str, name: &str, folder: &Path, definitions: &[(String, String)]) -> Result<Document, SceneError> {
    reader::document(text, name, folder, None, definitions)
}

/// A single element that needs no `version`, such as the examples of the manual pages.
///
/// # Errors
///
/// As [`read`].
pub fn parse_element(element: &str) -> Result<Document, SceneError> {
    let versioned = element.replacen(" type=", " version=\"3.0.0\" type=", 1);
    parse(&versioned, "example", Path::new(""), &[])
}
