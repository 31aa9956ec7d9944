//! Étendue is a deterministic light-transport testbed. It reads Mitsuba 3 scenes, renders them, and checks its images
//! against closed-form laws and against Mitsuba, with known error rates.
//!
//! It is meant for people who develop or compare rendering algorithms and need to know whether a difference between two
//! images is noise. An image is a function of the scene, the integrator and the seed, to the last bit, on any number of
//! threads. It works in linear RGB on the CPU; it has no participating media but absorption within glass.
//!
//! # A first image
//!
//! A white ball in a uniform environment is invisible: it reflects the same radiance that it hides.
//!
//! ```
//! use etendue::prelude::*;
//!
//! let camera = sensor("perspective")
//!     .with("to_world", Transform::new().look_at([0.0, 0.0, 4.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
//!     .child(film("hdrfilm").with("width", 8).with("height", 8));
//! let document = scene()
//!     .child(integrator("path"))
//!     .child(camera)
//!     .child(shape("sphere").child(bsdf("diffuse").with("reflectance", 1.0)))
//!     .child(emitter("constant").with("radiance", 0.5))
//!     .build()?;
//!
//! let renderer = Renderer::new(&document, &Overrides::default())?;
//! let film = renderer.render(Replicate { seed: 1, number: 0, samples: 256 }, &|_| {});
//! for [red, green, blue] in film.means() {
//!     assert!((red - 0.5).abs() < 0.1 && green == red && blue == red);
//! }
//! # Ok::<(), SceneError>(())
//! ```
//!
//! A scene file gives the same document: `xml::read(Path::new("scene.xml"), &[])?`. The folder `examples` of the
//! repository has programs that render to an array, render a caustic by photon mapping, and compare two films.
//!
//! # A tour
//!
//! The modules form layers: each module uses only itself and the modules before it. A test checks this. The
//! [`glossary`] defines the terms that are our own.
//!
//! 1. **Foundations.** [`memory`] allocates large arrays and reports failures. [`math`] has rays, boxes, frames,
//!    densities and random streams. [`stats`] has moments, exact sums, tests and the verdict on two images. [`law`]
//!    defines claims and how they are judged. [`spectrum`] converts spectra to RGB.
//! 2. **Scene descriptions.** [`scene_file`] makes a [`Document`](scene_file::Document) from Mitsuba's XML
//!    ([`scene_file::xml`]) or from code ([`scene_file::builder`]). [`provenance`] hashes the files of a scene.
//! 3. **Scenes.** Each kind of plugin has a module with a closed list of members, whose documentation is their manual:
//!    [`texture`], [`shape`], [`bsdf`], [`emitter`], [`sampler`], [`film`], [`sensor`]. A [`scene`] is built from a
//!    document, for ray tracing.
//! 4. **Light transport.** [`transport`] has the code that integrators share, [`photon`] has photon maps, and
//!    [`integrator`] has the estimators: `path`, `ptracer`, `photonmapper`, `sppm` and others. A
//!    [`Renderer`](render::Renderer) of [`render`] takes samples on all threads and adds them to a
//!    [`Film`](film::Film).
//! 5. **Use and checks.** The [`catalogue`] lists all plugins with their parameters. A [`comparison`] computes the
//!    verdict on two images. The [`prelude`] has what most programs need. `validation` runs all laws and compares all
//!    scenes, `report` writes the result as a page, and a `study` measures how errors fall.
//!
//! The command line is the binary's own module and not part of the library.
//!
//! # Features
//!
//! All features are on by default. Without them the library reads scenes, renders them and compares images. The feature
//! `verify` adds the modules `validation` and `report`, and `study` adds `study`.

pub mod memory;
pub mod math;
pub mod stats;
pub mod law;
pub mod spectrum;
pub mod scene_file;
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
pub mod prelude;
#[cfg(feature = "verify")]
pub mod validation;
#[cfg(feature = "verify")]
mod plot;
#[cfg(feature = "verify")]
pub mod report;
#[cfg(feature = "study")]
pub mod study;

#[doc = include_str!("../docs/glossary.md")]
pub mod glossary {}
