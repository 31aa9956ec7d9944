use super::{Params, Plugin, SceneError};

/// A plugin type: its manual page and its reader.
pub trait Described: Sized {
    /// The manual page.
    const PLUGIN: Plugin;

    /// Reads the parameters of an element.
    ///
    /// # Errors
    /// A parameter is missing, has the wrong type, or is out of range.
    fn read(params: &Params<'_>) -> Result<Self, SceneError>;
}
