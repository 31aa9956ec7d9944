//! Closed forms of caustics and predictions for density estimators. Nothing here renders.
//!
//! Lengths are in scene units, angles in radians, powers in the units of the light.

pub mod ball;
pub mod cylinder;
pub mod density;
pub mod numeric;
pub mod pane;
