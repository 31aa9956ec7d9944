//! Closed forms of caustics, and what estimators of density make of them. Nothing here renders.
//!
//! Lengths are in the units of the scene, angles in radians, power in the units of the light.

pub mod ball;
pub mod cylinder;
pub mod density;
pub mod numeric;
pub mod pane;
