//! The lists of laws.

use crate::{
    bsdf, emitter, film,
    law::Law,
    sampler, scene, sensor, shape, spectrum,
    validation::{
        absorption, calibration, caustics, csg, equivalent, extras, glass, images, light_tracing, lights, optics,
        photon_map, progressive, rooms,
    },
};

/// Every law, list by list.
pub fn laws() -> impl Iterator<Item = &'static Law> {
    let lists = [
        spectrum::laws::LAWS,
        shape::laws::LAWS,
        shape::laws::csg::LAWS,
        shape::laws::mesh::LAWS,
        bsdf::laws::LAWS,
        emitter::laws::LAWS,
        emitter::environment_laws::LAWS,
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
        equivalent::LAWS,
        calibration::LAWS,
    ];
    lists.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use std::{
        fs,
        path::{Path, PathBuf},
    };

    use glob::Pattern;

    use super::*;
    use crate::{catalogue, validation::reference::scene_files};

    #[test]
    fn every_plugin_names_evidence_that_exists() {
        let scenes = scene_files(Path::new(env!("CARGO_MANIFEST_DIR"))).expect("the scenes are there");
        let known: Vec<String> =
            laws().map(|law| law.name.to_owned()).chain(scenes.into_iter().map(|scene| scene.name)).collect();
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

    fn sources(folder: &Path) -> Vec<PathBuf> {
        let entries =
            fs::read_dir(folder).expect("the sources are there").map(|entry| entry.expect("it can be read").path());
        entries
            .flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] })
            .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
            .collect()
    }

    /// The names of the laws that a source file defines.
    fn names_in(text: &str) -> Vec<&str> {
        let names = text.split("name: \"").skip(1).filter_map(|rest| rest.split('"').next());
        // Names of other things are not path-like.
        names.filter(|name| name.contains('/')).collect()
    }

    #[test]
    fn every_list_in_the_sources_is_registered() {
        let known: Vec<_> = laws().map(|law| law.name).collect();
        let definitions = ["const", "static"].map(|kind| format!("{kind} LAWS: "));
        let mut found = 0;
        for path in sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src")) {
            let text = fs::read_to_string(&path).expect("sources are text");
            let lists: usize = definitions.iter().map(|definition| text.matches(definition).count()).sum();
            let names = if lists > 0 { names_in(&text) } else { Vec::new() };
            assert!(names.len() >= lists, "{}: a list of laws without names", path.display());
            for name in names {
                assert!(known.contains(&name), "{}: the law {name} is not registered", path.display());
                found += 1;
            }
        }
        assert_eq!(found, known.len());
    }
}
