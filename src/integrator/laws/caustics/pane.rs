//! .
use crate::law::Law;
/// These laws.
pub const LAWS: &[Law] = &[];
