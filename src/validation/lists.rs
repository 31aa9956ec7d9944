//! The lists of laws.

use crate::{
    bsdf, emitter, film,
    law::Law,
    sampler, scene, sensor, shape,
    validation::{
        absorption, caustics, csg, extras, glass, images, light_tracing, lights, optics, photon_map, progressive, rooms,
    },
};

/// Every law, list by list.
pub fn laws() -> impl Iterator<Item = &'static Law> {
    let lists = [
        shape::laws::LAWS,
        shape::laws::csg::LAWS,
        shape::mesh::laws::LAWS,
        bsdf::laws::LAWS,
        emitter::laws::LAWS,
        sampler::laws::LAWS,
        film::laws::LAWS,
        sensor::laws::LAWS,
        scene::laws::LAWS,
        photon_map::LAWS,
        lights::LAWS,
        rooms::LAWS,
        extras::LAWS,
        glass::LAWS,
        optics::LAWS,
        absorption::LAWS,
        caustics::ball::LAWS,
        caustics::profile::LAWS,
        caustics::cylinder::LAWS,
        caustics::pane::LAWS,
        caustics::density::LAWS,
        progressive::radius::LAWS,
        progressive::pixel::LAWS,
        progressive::finite::LAWS,
        progressive::flux::LAWS,
        progressive::glossy::LAWS,
        progressive::pane::LAWS,
        images::LAWS,
        light_tracing::LAWS,
        csg::LAWS,
    ];
    lists.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glob::Pattern;

    use super::*;
    use crate::{
        catalogue,
        validation::reference::{scenes, stem},
    };

    #[test]
    fn every_plugin_names_evidence_that_exists() {
        let scenes = scenes(Path::new(env!("CARGO_MANIFEST_DIR"))).expect("the scenes are there");
        let known: Vec<String> = laws()
            .map(|law| law.name.to_owned())
            .chain(scenes.iter().map(|scene| format!("reference/{}", stem(scene))))
            .collect();
        for plugin in catalogue::plugins() {
            assert!(!plugin.evidence.is_empty(), "{} \"{}\" has no evidence", plugin.category, plugin.name);
            for name in plugin.evidence {
                let pattern = Pattern::new(name).expect("a name or a glob");
                let exists = known.iter().any(|known| pattern.matches(known));
                assert!(exists, "{} \"{}\": no row is called {name}", plugin.category, plugin.name);
            }
        }
    }

    #[test]
    fn laws_have_names_of_their_own() {
        let mut names: Vec<_> = laws().map(|law| law.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
