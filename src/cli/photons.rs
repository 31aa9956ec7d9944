use std::{path::PathBuf, process::ExitCode};

use clap::Args;
use etendue::{
    film::exr::write_whole,
    integrator::{Integrator, PhotonMapper},
    math::Rgb,
    photon::{EmittedPhotons, PhotonMapKind, files},
    render::Renderer,
    sampler::SamplerModel as _,
    scene_file::{Described as _, Document},
};

use super::{check_writable, say, source::SceneOptions};

/// Emits the photons of a scene and reports their power, without rendering.
///
/// Photon mapping stores photons where they hit surfaces with a smooth lobe. The global map holds all of them. The
/// caustic map holds only photons that arrive through mirrors or glass; they are emitted separately. The photons are
/// exactly the ones that etendue render uses with the same seed and parameters. If the scene's integrator is not
/// photonmapper, a photonmapper with default parameters emits them. It keeps max_depth and rr_depth, and --param sets
/// others, such as --param global_photons=10000.
///
/// The table has a row for each class: direct (straight from an emitter), caustic (through mirrors or glass alone),
/// indirect (all others). A photon may be stored several times, so more may be stored than are emitted. Power is the
/// sum over stored photons in W, for red, green and blue.
#[derive(Debug, Args)]
pub(crate) struct Photons {
    #[command(flatten)]
    source: SceneOptions,
    /// Write a cloud of coloured points for viewers of PLY files
    #[arg(long, value_name = "FILE.ply")]
    ply: Option<PathBuf>,
    /// Write a structured array for numpy.load, with the fields position, power, direction (towards the previous
    /// surface or the emitter), class (0 direct, 2 caustic, 3 indirect), bounces (surfaces before this one) and map (0
    /// global, 1 caustic)
    #[arg(long, value_name = "FILE.npy")]
    npy: Option<PathBuf>,
}

impl Photons {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        // Meshes are also prepared by several threads.
        self.source.threads()?.install(|| self.emit())
    }

    fn emit(&self) -> anyhow::Result<ExitCode> {
        let document = self.source.read()?;
        let renderer = self.source.renderer(&document, &self.source.overrides(replacement(&document)))?;
        self.check_outputs()?;
        let seed = self.source.seed().unwrap_or_else(|| renderer.scene.sensor.sampler.seed());
        let harvests = PhotonMapKind::ALL.map(|kind| mapper(&renderer).trace_photons(&renderer.scene, kind, seed, 0));
        for (kind, emitted) in PhotonMapKind::ALL.into_iter().zip(&harvests) {
            print(kind, emitted.as_ref())?;
        }
        let filled: Vec<_> =
            PhotonMapKind::ALL.into_iter().zip(&harvests).filter_map(|(a, h)| Some((a, h.as_ref()?))).collect();
        if let Some(ply) = &self.ply {
            write_whole(ply, &files::ply(&filled))?;
        }
        if let Some(npy) = &self.npy {
            write_whole(npy, &files::npy(&filled))?;
        }
        Ok(ExitCode::SUCCESS)
    }

    fn check_outputs(&self) -> anyhow::Result<()> {
        if let (Some(ply), Some(npy)) = (&self.ply, &self.npy) {
            anyhow::ensure!(ply != npy, "{}: is named twice; give the two files different names", ply.display());
        }
        self.ply.iter().chain(&self.npy).try_for_each(|file| check_writable(file))
    }
}

/// The integrator that replaces the scene's own; None if the scene's own is a photonmapper.
fn replacement(document: &Document) -> Option<String> {
    let wanted = PhotonMapper::PLUGIN.name;
    (Integrator::name_in(document) != Some(wanted)).then(|| wanted.to_owned())
}

fn mapper(renderer: &Renderer) -> &PhotonMapper {
    match &renderer.integrator {
        Integrator::PhotonMapper(mapper) => mapper,
        _ => unreachable!("any other integrator was replaced"),
    }
}

fn print(kind: PhotonMapKind, emitted: Option<&EmittedPhotons>) -> anyhow::Result<()> {
    let Some(emitted) = emitted else {
        return say(format_args!("{} map: none, because the scene has neither mirrors nor glass", kind.name()));
    };
    super::warn(emitted.warning(kind).as_slice());
    let (count, stored) = (emitted.emitted, emitted.photons.len());
    say(format_args!("{} map: {count} emitted with{} W, {stored} stored", kind.name(), watts(emitted.power)))?;
    say("  class         stored  per emitted      power in W: R, G, B                  mean bounces")?;
    for class in kind.classes() {
        let statistics = emitted.statistics(*class);
        say(format_args!(
            "  {:<9} {:>10} {:>12.4}     {} {:>13}",
            class.name(),
            statistics.stored,
            statistics.stored as f64 / count as f64,
            watts(statistics.power),
            statistics.mean_bounces().map_or_else(|| "-".into(), |mean| format!("{mean:.3}"))
        ))?;
    }
    Ok(())
}

fn watts(power: Rgb) -> String {
    power.to_array().map(|power| format!(" {power:<11.5e}")).concat()
}
