//! Everything that scene files can name.

use crate::{
    bsdf::Bsdf,
    emitter::Emitter,
    film::{FilmPlugin, Filter},
    integrator::Integrator,
    sampler::Sampler,
    scene_file::Plugin,
    sensor::Camera,
    shape::Geometry,
    texture::Texture,
};

/// The manual pages of all plugins, list by list.
pub fn plugins() -> impl Iterator<Item = &'static Plugin> {
    let lists = [
        Integrator::PLUGINS,
        Camera::PLUGINS,
        FilmPlugin::PLUGINS,
        Filter::PLUGINS,
        Sampler::PLUGINS,
        Geometry::PLUGINS,
        Bsdf::PLUGINS,
        Texture::PLUGINS,
        Emitter::PLUGINS,
    ];
    lists.into_iter().flatten().copied()
}
