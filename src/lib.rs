//! A deterministic, seeded light-transport laboratory: it reads Mitsuba 3's scene files, renders them, and proves what
//! it renders.
//!
//! The modules stand in this order, and each uses only itself and those above it; a test holds them to it:
//!
//! 1. what everything stands on: [`math`], [`stats`] and [`law`], which is how claims are written down;
//! 2. what a scene file says: [`node`], and [`provenance`], which hashes its files;
//! 3. what a scene is made of: [`texture`], [`shape`], [`bsdf`], [`emitter`], [`sampler`], [`film`], [`sensor`], and the
//!    [`scene`] that they make;
//! 4. how light travels through it: [`transport`], [`photon`], [`integrator`], [`render`];
//! 5. all of it looked at from outside: the [`catalogue`] of everything that scene files can name, the [`comparison`] of
//!    images, the [`evidence`] that claims hold, its [`report`], and the [`study`] of how errors fall.
//!
//! The command line, `cli`, is the binary's. All features are on by default; without them the library reads scenes, renders
//! them and compares images. The feature `verify` adds the modules `evidence` and `report`, and `study` adds `study`.
//!
//! A white ball under an even sky cannot be seen, because every path brings the sky's radiance:
//!
//! ```
//! use std::path::Path;
//!
//! use etendue::{integrator::Overrides, node::xml, render::{Pass, Renderer}};
//!
//! let scene = r#"<scene version="3.0.0">
//!     <integrator type="path"/>
//!     <sensor type="perspective">
//!         <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
//!         <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
//!     </sensor>
//!     <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></shape>
//!     <emitter type="constant"><rgb name="radiance" value="0.5"/></emitter>
//! </scene>"#;
//! let document = xml::parse(scene, "scene.xml", Path::new(""), &[])?;
//! let renderer = Renderer::new(&document, &Overrides::default())?;
//! let film = renderer.render(Pass { seed: 1, number: 0, samples: 256 }, &|_| {});
//! for [red, green, blue] in film.means() {
//!     assert!((red - 0.5).abs() < 0.1 && green == red && blue == red);
//! }
//! # Ok::<(), etendue::node::SceneError>(())
//! ```

pub mod math;
pub mod stats;
pub mod law;
pub mod node;
pub mod provenance;
pub mod texture;
pub mod shape;
pub mod bsdf;
pub mod emitter;
pub mod sampler;
pub mod film;
pub mod sensor;
pub mod scene;
pub mod transport;
pub mod photon;
pub mod integrator;
pub mod render;
pub mod catalogue;
pub mod comparison;
#[cfg(feature = "verify")]
pub mod evidence;
#[cfg(feature = "verify")]
pub mod report;
#[cfg(feature = "study")]
pub mod study;
