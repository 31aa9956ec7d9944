use std::path::PathBuf;

use clap::Args;
use etendue::{
    integrator::{IntegratorModel as _, Overrides},
    render::{
        Renderer,
        checkpoint::{Identity, RenderSource},
    },
    sampler::Sampler,
    scene_file::{Document, xml},
};

use super::{faults, numbers};

/// The scene with its parameters, the seed and the threads.
#[derive(Debug, Args)]
pub(super) struct SceneOptions {
    /// The scene, in Mitsuba 3's XML
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    /// Set a $parameter of the scene
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = definition)]
    define: Vec<(String, String)>,
    /// Replace the scene's sampler; sample_count and seed stay
    #[arg(long, value_name = "NAME")]
    sampler: Option<String>,
    /// Set a parameter of the integrator
    #[arg(long, value_name = "NAME=VALUE", value_parser = definition)]
    param: Vec<(String, String)>,
    /// The seed [default: the sampler's, or 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = numbers::seed)]
    seed: Option<u64>,
    /// The number of threads [default: one per core]. It never changes the image
    #[arg(long, value_name = "N", value_parser = numbers::count)]
    threads: Option<u16>,
}

/// A word quoted for a shell.
pub(super) fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

fn definition(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("write it as name=value")?;
    Ok((name.to_owned(), value.to_owned()))
}

impl SceneOptions {
    /// The document of the scene file, with the requested sampler.
    pub(super) fn read(&self) -> anyhow::Result<Document> {
        let mut document = xml::read(&self.scene, &self.define).map_err(|error| faults::of_scene(&error))?;
        if let Some(name) = &self.sampler {
            Sampler::replace(&mut document, name);
        }
        Ok(document)
    }

    /// The changes to the scene's integrator: its name and its parameters.
    pub(super) fn overrides(&self, integrator: Option<String>) -> Overrides {
        Overrides { name: integrator, params: self.param.clone() }
    }

    /// Builds the scene with its own integrator or the requested one, and prints warnings.
    pub(super) fn renderer(&self, document: &Document, overrides: &Overrides) -> anyhow::Result<Renderer> {
        let renderer = Renderer::new(document, overrides).map_err(|error| faults::of_scene(&error))?;
        super::warn(&renderer.warnings());
        Ok(renderer)
    }

    /// What a render with these options is made from.
    pub(super) fn source<'a>(
        &'a self,
        document: &'a Document,
        overrides: &'a Overrides,
        renderer: &'a Renderer,
    ) -> RenderSource<'a> {
        RenderSource { renderer, document, definitions: &self.define, overrides }
    }

    /// The attributes of an image's header that say how it was made.
    pub(super) fn attributes(&self, identity: &Identity, source: &RenderSource<'_>) -> Vec<(String, String)> {
        let renderer = source.renderer;
        let params: Vec<_> = self.param.iter().chain(&self.define).map(|(n, v)| format!("{n}={v}")).collect();
        let attributes = [
            ("etendue.version", identity.version.clone()),
            ("etendue.scene", self.scene.display().to_string()),
            ("etendue.scene_sha256", identity.scene_sha256.clone()),
            ("etendue.integrator", renderer.integrator.plugin().name.into()),
            ("etendue.sampler", renderer.scene.sensor.sampler.plugin().name.into()),
            ("etendue.parameters", params.join(" ")),
            ("etendue.seed", identity.seed.to_string()),
            ("etendue.options", self.options(source)),
        ];
        let not_physical = renderer.integrator.not_physical().map(|what| ("etendue.not_physical", what.to_owned()));
        attributes.into_iter().chain(not_physical).map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// The options that reproduce the image of the scene, except for the seed and the number of samples.
    fn options(&self, source: &RenderSource<'_>) -> String {
        let mut options = Vec::new();
        let mut add = |option: &str, value: &str| options.extend([option.to_owned(), quoted(value)]);
        self.define.iter().for_each(|(name, value)| add("-D", &format!("{name}={value}")));
        source.overrides.name.iter().for_each(|name| add("--integrator", name));
        self.param.iter().for_each(|(name, value)| add("--param", &format!("{name}={value}")));
        self.sampler.iter().for_each(|name| add("--sampler", name));
        options.join(" ")
    }

    /// The requested seed; None means the scene's seed.
    pub(super) fn seed(&self) -> Option<u64> {
        self.seed
    }

    /// The pool of the requested threads.
    pub(super) fn threads(&self) -> anyhow::Result<rayon::ThreadPool> {
        super::threads(self.threads)
    }
}
