//! The items that most programs need: `use etendue::prelude::*;`.
//!
//! | to | there are |
//! |---|---|
//! | build a scene in code | [`scene`], [`shape`], [`bsdf`], ..., [`reference`](fn@reference), [`rgb`], [`Transform`], [`MeshArrays`] |
//! | read a scene from Mitsuba's XML | [`xml::read`], [`xml::parse`] |
//! | render it | [`Renderer`], [`Replicate`], [`Overrides`] |
//! | use and store the image | [`Film`], [`Image`], [`exr`], [`picture`] |
//! | compare two images | [`comparison`], [`ImageEstimate`], [`Outcome`] |
//! | handle errors | [`SceneError`], [`FileError`], [`ComparisonError`] |

pub use crate::{
    comparison::{self, Comparison, ComparisonError, ImageEstimate},
    film::{
        Film, Image,
        exr::{self, FileError},
        picture,
    },
    integrator::Overrides,
    render::{Renderer, Replicate},
    scene_file::{
        Document, MeshArrays, SceneError, Spectrum, Transform,
        builder::{
            ObjectBuilder, bsdf, emitter, film, integrator, reference, rfilter, rgb, sampler, scene, sensor, shape,
            texture,
        },
        xml,
    },
    stats::{Outcome, Verdict},
};
