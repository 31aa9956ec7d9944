//! The files of an image.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use etendue::film::{
    Film, Image, LayerSpec, exr,
    picture::{self, ToneCurve},
};

use super::check_writable;

/// Options of the picture beside an image.
#[derive(Debug, Args)]
pub(super) struct Picture {
    /// Write a tone-mapped PNG beside the image
    #[arg(long, requires = "output")]
    png: bool,
    /// Show this layer in the picture, such as caustic, instead of the image
    #[arg(long, value_name = "NAME", requires = "png")]
    layer: Option<String>,
    /// The exposure of the picture in stops [default: the log-average luminance becomes middle grey]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, requires = "png", value_parser = stops)]
    exposure: Option<f64>,
    /// The tone curve: clip cuts bright parts off, filmic keeps their details (Narkowicz 2016, a fit to ACES)
    #[arg(long, value_name = "CURVE", requires = "png", value_enum, default_value_t = Curve::Clip)]
    tonemap: Curve,
}

/// The tone curves by their names.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Curve {
    Clip,
    Filmic,
}

impl Curve {
    fn of_picture(self) -> ToneCurve {
        match self {
            Self::Clip => ToneCurve::Clip,
            Self::Filmic => ToneCurve::Filmic,
        }
    }
}

fn stops(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|stops: &f64| stops.is_finite()).ok_or_else(|| "write a number like -1.5".into())
}

/// The image, and the picture if there is one.
pub(super) struct Outputs<'a> {
    exr: &'a Path,
    png: Option<PathBuf>,
    picture: &'a Picture,
}

impl Picture {
    /// The files of a film's image with this picture. Checks, as far as possible before the work, that they can be
    /// written.
    pub(super) fn beside<'a>(&'a self, exr: &'a Path, film: &Film) -> anyhow::Result<Outputs<'a>> {
        let is_exr = exr.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"));
        anyhow::ensure!(is_exr, "{}: images are OpenEXR files; give it a name that ends in .exr", exr.display());
        if let Some(layer) = &self.layer {
            let is_colour = |spec: &&LayerSpec| spec.channels == ["R", "G", "B"] && !spec.name.is_empty();
            let names: Vec<_> = film.layers.iter().filter(is_colour).map(|spec| spec.name.as_str()).collect();
            anyhow::ensure!(
                names.contains(&layer.as_str()),
                "--layer {layer}: the image has no such layer with red, green and blue; it has: {}",
                if names.is_empty() { "none".into() } else { names.join(", ") }
            );
        }
        let png = self.png.then(|| exr.with_extension("png"));
        [exr].into_iter().chain(png.as_deref()).try_for_each(check_writable)?;
        Ok(Outputs { exr, png, picture: self })
    }
}

impl Outputs<'_> {
    /// Checks that no other output has the same path.
    pub(super) fn are_not(&self, other: &Path) -> anyhow::Result<()> {
        let is_one = [self.exr].into_iter().chain(self.png.as_deref()).any(|file| file == other);
        anyhow::ensure!(!is_one, "{}: is named twice; give the two files different names", other.display());
        Ok(())
    }

    /// Writes the image and the picture. Both headers state the exposure of the picture. Returns a message about the
    /// picture, if there is one.
    pub(super) fn write(&self, image: &mut Image) -> anyhow::Result<Option<String>> {
        let Some(png) = &self.png else {
            exr::write(self.exr, image)?;
            return Ok(None);
        };
        let prefix = self.picture.layer.as_ref().map_or(String::new(), |layer| format!("{layer}."));
        let names = ["R", "G", "B"].map(|channel| format!("{prefix}{channel}"));
        let pixels = image.rgb(names.each_ref().map(String::as_str)).expect("outputs were checked");
        let exposure = self.picture.exposure.unwrap_or_else(|| picture::automatic_exposure(&pixels));
        let curve = self.picture.tonemap.to_possible_value().expect("no curve is hidden").get_name().to_owned();
        image.attributes.push(("etendue.exposure".to_owned(), exposure.to_string()));
        image.attributes.push(("etendue.tonemap".to_owned(), curve));
        exr::write(self.exr, image)?;
        let curve = self.picture.tonemap.of_picture();
        let picture = picture::tone_mapped_by(curve, image.crop.width, &pixels, exposure);
        picture::write_png_with(png, &picture, &image.attributes)?;
        Ok(Some(format!("{} at exposure {exposure:.3}", png.display())))
    }
}
