use std::path::{Path, PathBuf};

use clap::Args;
use etendue::{
    integrator::Overrides,
    node::{Document, SceneError, xml},
    render::Renderer,
    sampler::Model as _,
    scene::Scene,
};

/// Which scene, with which values, seed and threads.
#[derive(Debug, Args)]
pub(super) struct Source {
    /// The scene, in Mitsuba 3's XML.
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    /// Set a $parameter of the scene.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = definition)]
    define: Vec<(String, String)>,
    /// Set a parameter of the integrator.
    #[arg(long, value_name = "NAME=VALUE", value_parser = definition)]
    param: Vec<(String, String)>,
    /// The seed [default: the sampler's, or 0].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole)]
    seed: Option<u64>,
    /// Threads [default: one per core]. Results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

fn definition(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("write it as name=value")?;
    Ok((name.to_owned(), value.to_owned()))
}

fn whole(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("write a whole number from 0 to {}", u64::MAX))
}

impl Source {
    /// What the file says.
    pub(super) fn read(&self) -> Result<Document, SceneError> {
        xml::read(&self.scene, &self.define)
    }

    /// The scene with its integrator or the one that is named; warns of what is strange about them.
    pub(super) fn renderer(&self, document: &Document, integrator: Option<String>) -> Result<Renderer, SceneError> {
        let renderer = Renderer::new(document, &Overrides { name: integrator, params: self.param.clone() })?;
        super::warn(&renderer.warnings());
        Ok(renderer)
    }

    /// The file.
    pub(super) fn scene(&self) -> &Path {
        &self.scene
    }

    /// What was set, as text.
    pub(super) fn parameters(&self) -> String {
        let params: Vec<_> = self.param.iter().chain(&self.define).map(|(n, v)| format!("{n}={v}")).collect();
        params.join(" ")
    }

    /// The seed.
    pub(super) fn seed(&self, scene: &Scene) -> u64 {
        self.seed.unwrap_or(scene.sensor.sampler.seed())
    }

    /// So many threads as are asked for.
    pub(super) fn threads(&self) -> anyhow::Result<rayon::ThreadPool> {
        super::threads(self.threads)
    }
}
