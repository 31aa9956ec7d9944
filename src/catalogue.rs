//! The list of all plugins that scene files can name.

use crate::{
    bsdf::Bsdf,
    emitter::Emitter,
    film::{FilmPlugin, Filter},
    integrator::Integrator,
    sampler::Sampler,
    scene_file::{Category, Plugin, mitsuba},
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

/// A Markdown table of the plugins of Mitsuba 3.9.1 by their status in étendue, and of the plugins that Mitsuba lacks.
#[must_use]
pub fn mitsuba_table() -> String {
    let mut table = String::from("| | read | not there yet | out of scope | beyond Mitsuba |\n|---|---|---|---|---|\n");
    for (category, tag) in Category::ALL {
        let theirs = || mitsuba::PLUGINS.iter().filter(move |plugin| plugin.category == category);
        let is_read = |name: &str| plugins().any(|plugin| plugin.category == category && plugin.name == name);
        let read = theirs().filter(|plugin| is_read(plugin.name)).map(|plugin| code(plugin.name));
        let missing = || theirs().filter(|plugin| !is_read(plugin.name));
        let yet = missing().filter(|plugin| plugin.subject.out_of_scope().is_none()).map(|plugin| code(plugin.name));
        let out = missing().filter_map(|plugin| {
            plugin.subject.out_of_scope().map(|subject| format!("{} ({subject})", code(plugin.name)))
        });
        let own = plugins().filter(|plugin| plugin.category == category);
        let own = own.filter(|plugin| theirs().all(|other| other.name != plugin.name)).map(|plugin| code(plugin.name));
        let cells = [joined(read), joined(yet), joined(out), joined(own)];
        if cells.iter().any(|cell| !cell.is_empty()) {
            table += &format!("| {tag} | {} |\n", cells.join(" | "));
        }
    }
    table
}

fn code(name: &str) -> String {
    format!("`{name}`")
}

fn joined(names: impl Iterator<Item = String>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene_file::Manual;

    #[test]
    fn every_plugin_has_a_manual_page() {
        for plugin in plugins() {
            let text = plugin.manual.paragraphs();
            for one in plugin.manual.types.chunks(1) {
                let own = Manual { types: one, ..plugin.manual }.paragraphs();
                assert!(!own.is_empty(), "{}: {one:?} has no doc comment", plugin.name);
            }
            assert!(!text.is_empty() && !text.concat().contains("[`"), "{}: {text:?}", plugin.name);
            let page = plugin.page();
            assert!(plugin.all_params().all(|param| page.contains(param.name)), "{page}");
        }
    }

    #[test]
    fn what_is_read_is_not_out_of_scope() {
        for theirs in mitsuba::PLUGINS {
            let is_read = plugins().any(|own| own.category == theirs.category && own.name == theirs.name);
            assert!(!is_read || theirs.subject.out_of_scope().is_none(), "{}", theirs.name);
        }
    }
}
