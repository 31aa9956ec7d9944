use std::{io::IsTerminal as _, path::PathBuf, process::ExitCode, time::Instant};

use clap::Args;
use etendue::{
    film::{Image, LayerSpec, exr, picture, splats},
    integrator::Model as _,
    node::Document,
    provenance,
    render::{Pass, Renderer},
    sampler::Model as _,
};
use indicatif::{ProgressBar, ProgressStyle};

use super::{check_writable, say, source::Source};

/// Renders a scene into an OpenEXR file.
///
/// The file has R, G and B as 32-bit floats, the layers that the integrator makes, the variance of the mean as
/// variance.R, .G and .B, and says in its header how it was made.
#[derive(Debug, Args)]
pub(crate) struct Render {
    #[command(flatten)]
    source: Source,
    /// Replace the scene's integrator, keeping what parameters both have, such as max_depth and rr_depth.
    #[arg(long, value_name = "NAME")]
    integrator: Option<String>,
    /// Samples per pixel [default: the scene's sample_count].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// The image to write.
    #[arg(short, long, value_name = "OUT.exr", required_unless_present = "replay")]
    output: Option<PathBuf>,
    /// Also write a tone-mapped picture beside the image.
    #[arg(long)]
    png: bool,
    /// Show this layer in the picture instead of the image, such as caustic or raw of a photon mapper.
    #[arg(long, value_name = "NAME", requires = "png")]
    layer: Option<String>,
    /// The exposure of the picture in stops [default: automatic].
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, requires = "png", value_parser = stops)]
    exposure: Option<f64>,
    /// Print one sample of one pixel instead of rendering: its column and row in the image, and its number, from 0.
    #[arg(long, value_name = "X,Y,SAMPLE", allow_hyphen_values = true, value_parser = address)]
    replay: Option<[u32; 3]>,
}

fn stops(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|stops: &f64| stops.is_finite()).ok_or_else(|| "write a number like -1.5".into())
}

fn address(text: &str) -> Result<[u32; 3], String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| "write three whole numbers like 3,4,0".into())
}

impl Render {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        let document = self.source.read()?;
        let renderer = self.source.renderer(&document, self.integrator.clone())?;
        let asked = renderer.integrator.samples();
        let samples = self.spp.or(asked).unwrap_or(renderer.scene.sensor.sampler.sample_count());
        let pass = Pass { seed: self.source.seed(&renderer.scene), number: 0, samples };
        if let Some(at) = self.replay {
            return replay(&renderer, pass, at);
        }
        let outputs = self.outputs(&renderer)?;
        let mut attributes = self.attributes(&document, &renderer, pass)?;
        let pool = self.source.threads()?;
        let start = Instant::now();
        let mut image = pool.install(|| gather(&renderer, pass));
        attributes.push(("etendue.seconds".into(), format!("{:.3}", start.elapsed().as_secs_f64())));
        image.attributes = attributes;
        self.write(&outputs, &image)?;
        Ok(ExitCode::SUCCESS)
    }

    /// The files to write, which can be written as far as can be told before the work.
    fn outputs(&self, renderer: &Renderer) -> anyhow::Result<Outputs> {
        let exr = self.output.clone().expect("clap asks for it");
        let is_exr = exr.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"));
        anyhow::ensure!(is_exr, "{}: images are OpenEXR files; give it a name that ends in .exr", exr.display());
        let png = self.png.then(|| exr.with_extension("png"));
        if let Some(layer) = &self.layer {
            let known = renderer.film().layers;
            let is_colour = |spec: &&LayerSpec| spec.channels == ["R", "G", "B"] && !spec.name.is_empty();
            let names: Vec<_> = known.iter().filter(is_colour).map(|spec| spec.name.as_str()).collect();
            anyhow::ensure!(
                names.contains(&layer.as_str()),
                "--layer {layer}: the image has no such layer of colours; it has: {}",
                if names.is_empty() { "none".into() } else { names.join(", ") }
            );
        }
        for file in [Some(&exr), png.as_ref()].into_iter().flatten() {
            check_writable(file)?;
        }
        Ok(Outputs { exr, png })
    }

    fn attributes(
        &self,
        document: &Document,
        renderer: &Renderer,
        pass: Pass,
    ) -> anyhow::Result<Vec<(String, String)>> {
        let attributes = [
            ("etendue.version", provenance::version()),
            ("etendue.scene", self.source.scene().display().to_string()),
            ("etendue.scene_sha256", provenance::scene_hash(document)?),
            ("etendue.integrator", renderer.integrator.plugin().name.into()),
            ("etendue.parameters", self.source.parameters()),
            ("etendue.spp", pass.samples.to_string()),
            ("etendue.seed", pass.seed.to_string()),
        ];
        let not_physical = renderer.integrator.not_physical().map(|what| ("etendue.not_physical", what.to_owned()));
        Ok(attributes.into_iter().chain(not_physical).map(|(name, value)| (name.to_owned(), value)).collect())
    }

    fn write(&self, outputs: &Outputs, image: &Image) -> anyhow::Result<()> {
        exr::write(&outputs.exr, image)?;
        if let Some(png) = &outputs.png {
            let prefix = self.layer.as_ref().map_or(String::new(), |layer| format!("{layer}."));
            let names = ["R", "G", "B"].map(|channel| format!("{prefix}{channel}"));
            let pixels = image.rgb(names.each_ref().map(String::as_str)).expect("outputs were checked");
            let exposure = self.exposure.unwrap_or_else(|| picture::automatic_exposure(&pixels));
            let picture = picture::tone_mapped(image.crop.width, &pixels, exposure);
            picture::write_png(png, &picture)?;
        }
        Ok(())
    }
}

/// The image, and the picture if there is one.
struct Outputs {
    exr: PathBuf,
    png: Option<PathBuf>,
}

/// Renders with a progress bar, which is silent when nobody watches.
fn gather(renderer: &Renderer, pass: Pass) -> Image {
    let crop = renderer.scene.sensor.film.rendered();
    let total = u64::from(crop.width) * u64::from(crop.height) * u64::from(pass.samples);
    let bar = if std::io::stderr().is_terminal() { ProgressBar::new(total) } else { ProgressBar::hidden() };
    let style = ProgressStyle::with_template("{wide_bar} {percent}% {per_sec} samples, {eta} left");
    bar.set_style(style.expect("the template is right"));
    let mut rendering = renderer.begin(pass);
    rendering.advance(pass.samples, &|samples| bar.inc(samples));
    bar.finish_and_clear();
    let notes = rendering.notes();
    notes.facts.iter().for_each(|fact| eprintln!("{fact}"));
    super::warn(&notes.warnings);
    rendering.film().image()
}

fn replay(renderer: &Renderer, pass: Pass, [x, y, sample]: [u32; 3]) -> anyhow::Result<ExitCode> {
    let crop = renderer.scene.sensor.film.rendered();
    anyhow::ensure!(
        x < crop.width && y < crop.height,
        "pixel {x},{y} is outside of the {} x {} film",
        crop.width,
        crop.height
    );
    anyhow::ensure!(sample < pass.samples, "sample {sample} is not among the {} of a pixel", pass.samples);
    let mut values = vec![0.0; renderer.film().stride()];
    let mut path = splats::Path::default();
    let mut rendering = renderer.begin(pass);
    super::warn(&rendering.notes().warnings);
    let radiance = rendering.sample((x, y), sample, &mut values, &mut path);
    say(format_args!("{:?} {:?} {:?}", radiance.x, radiance.y, radiance.z))?;
    for ((x, y), value) in path.pixels() {
        say(format_args!("splat {x},{y}: {:?} {:?} {:?}", value.x, value.y, value.z))?;
    }
    Ok(ExitCode::SUCCESS)
}
