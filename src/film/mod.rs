//! The film: its size and reconstruction filter, the layers that accumulate samples, and image files.

pub mod exr;
pub mod filter;
pub mod laws;
mod layers;
pub mod picture;
pub mod splats;
mod sums;

pub use filter::Filter;
pub use layers::{Film, Image, LayerSource, LayerSpec, Pixels, VARIANCE};
pub use splats::Splats;
pub use sums::Frame;

use glam::DVec2;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use crate::scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, catalogue, manual};
use filter::Profile;

catalogue! {
    /// A film.
    pub enum FilmPlugin in Category::Film, {
        /// High dynamic range, for `OpenEXR` files.
        Hdr(HdrFilm),
    }
}

/// The size of the image in pixels, and the reconstruction filter. Files are always `OpenEXR` with 32-bit floats;
/// Mitsuba's file parameters are accepted but have no effect.
#[derive(Clone, Debug)]
pub struct HdrFilm {
    width: u32,
    height: u32,
    crop: Crop,
    profile: Profile,
    sample_border: bool,
}

/// The part of a film that is rendered, in pixels from the top left corner of the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crop {
    /// The first column.
    pub x: u32,
    /// The first row.
    pub y: u32,
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
}

/// The maximum number of pixels, whose sums take about 10 GB.
const MAX_PIXELS: u64 = 100_000_000;
const SIZE: Range = Range { min: 1.0, max: 1_000_000.0, open: false };

impl Described for HdrFilm {
    const PLUGIN: Plugin = Plugin {
        category: Category::Film,
        manual: manual!("mod.rs": "HdrFilm"),
        name: "hdrfilm",
        summary: "A high dynamic range image.",
        params: &[
            Param::new("width", ParamKind::Integer, "768", "the width of the film in pixels").within(SIZE),
            Param::new("height", ParamKind::Integer, "576", "the height of the film in pixels").within(SIZE),
            Param::new("crop_offset_x", ParamKind::Integer, "0", "the first rendered column")
                .within(Range::NON_NEGATIVE),
            Param::new("crop_offset_y", ParamKind::Integer, "0", "the first rendered row").within(Range::NON_NEGATIVE),
            Param::optional("crop_width", ParamKind::Integer, "width", "the number of rendered columns").within(SIZE),
            Param::optional("crop_height", ParamKind::Integer, "height", "the number of rendered rows").within(SIZE),
            Param::new(
                "sample_border",
                ParamKind::Boolean,
                "false",
                "whether filters extend beyond the border of the crop",
            ),
            Param::ignored("file_format", ParamKind::Choice(&["openexr", "rgbe", "pfm"]), "files are always OpenEXR"),
            Param::ignored(
                "pixel_format",
                ParamKind::Choice(&["luminance", "luminance_alpha", "rgb", "rgba", "xyz", "xyza"]),
                "files always contain RGB",
            ),
            Param::ignored(
                "component_format",
                ParamKind::Choice(&["float16", "float32", "uint32"]),
                "files always contain float32",
            ),
            Param::ignored("compensate", ParamKind::Boolean, "sums are always exact"),
            Param::ignored("banner", ParamKind::Boolean, "there is no banner"),
            Param::optional("rfilter", ParamKind::Object(Category::Filter), "gaussian", "the reconstruction filter"),
        ],
        examples: &[r#"<film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="32"/>
            <rfilter type="box"/></film>"#],
        evidence: &["film/filter", "film/footprint", "film/coverage"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let integer = |name| params.integer(name).map(|i| i.unsigned_abs() as u32);
        let (width, height) = (integer("width")?, integer("height")?);
        let crop = Self::crop(params, width, height)?;
        if u64::from(crop.width) * u64::from(crop.height) > MAX_PIXELS {
            let error = params.error("width", format!("the film has {} x {} pixels", crop.width, crop.height));
            return Err(error.hint(format!("at most {MAX_PIXELS} pixels can be rendered at once")));
        }
        let filter = match params.child(Category::Filter)? {
            Some(id) => Filter::read(params.document(), id)?,
            None => filter::Gaussian::default().into(),
        };
        let sample_border = params.boolean("sample_border")?;
        Ok(Self { width, height, crop, profile: Profile::new(&filter), sample_border })
    }
}

impl Default for HdrFilm {
    /// The film of a sensor without a film.
    fn default() -> Self {
        let (width, height) = (768, 576);
        let profile = Profile::new(&filter::Gaussian::default());
        Self { width, height, crop: Crop { x: 0, y: 0, width, height }, profile, sample_border: false }
    }
}

impl HdrFilm {
    fn crop(params: &Params<'_>, width: u32, height: u32) -> Result<Crop, SceneError> {
        let along = |offset, size, whole: u32| {
            let start = params.integer(offset)?.unsigned_abs();
            let given = params.find(size).is_some();
            let length = if given { params.integer(size)?.unsigned_abs() } else { u64::from(whole) };
            if length == 0 || start.saturating_add(length) > u64::from(whole) {
                let what = format!("the crop of {length} from {start} is not within the film's {whole}");
                return Err(params
                    .error(if given { size } else { offset }, what)
                    .hint(format!("give a {size} that fits")));
            }
            Ok((start as u32, length as u32))
        };
        let (x, crop_width) = along("crop_offset_x", "crop_width", width)?;
        let (y, crop_height) = along("crop_offset_y", "crop_height", height)?;
        Ok(Crop { x, y, width: crop_width, height: crop_height })
    }

    /// The size of the entire film in pixels, which the sensor's field of view spans.
    #[must_use]
    pub fn size(&self) -> DVec2 {
        DVec2::new(f64::from(self.width), f64::from(self.height))
    }

    /// The rendered part.
    #[must_use]
    pub fn rendered(&self) -> Crop {
        self.crop
    }

    /// Samples a position on the film, in pixels, for the pixel in column `x` and row `y` of the rendered part.
    #[inline]
    #[must_use]
    pub fn sample(&self, x: u32, y: u32, u: DVec2) -> DVec2 {
        DVec2::new(self.along(self.crop.x, x, self.crop.width, u.x), self.along(self.crop.y, y, self.crop.height, u.y))
    }

    fn along(&self, first: u32, index: u32, count: u32, u: f64) -> f64 {
        let centre = f64::from(index) + 0.5;
        let (from, to) = self.window(centre, count);
        f64::from(first) + centre + self.profile.sample_within(u, from, to)
    }

    /// The interval of offsets from a pixel's centre to which the filter is restricted. As in Mitsuba, the filter is
    /// truncated at the border unless the border is sampled.
    fn window(&self, centre: f64, count: u32) -> (f64, f64) {
        if self.sample_border { (f64::MIN, f64::MAX) } else { (-centre, f64::from(count) - centre) }
    }

    /// The pixels of the rendered part, by column and row, whose filter covers a position on the film, in pixels. Each
    /// comes with the density with which [`HdrFilm::sample`] samples the position.
    #[inline]
    pub fn pixels_covering(&self, position: DVec2) -> impl Iterator<Item = ((u32, u32), f64)> {
        let columns = self.indices_covering(self.crop.x, self.crop.width, position.x);
        let rows = self.indices_covering(self.crop.y, self.crop.height, position.y);
        rows.into_iter()
            .flat_map(move |(y, across)| columns.clone().into_iter().map(move |(x, along)| ((x, y), along * across)))
    }

    fn indices_covering(&self, first: u32, count: u32, position: f64) -> SmallVec<[(u32, f64); 4]> {
        let position = position - f64::from(first);
        let radius = self.profile.radius();
        // The casts saturate outside the film.
        let (from, to) = ((position - radius - 0.5).ceil().max(0.0) as u32, (position + radius + 0.5).max(0.0) as u32);
        let density = |index| {
            let centre = f64::from(index) + 0.5;
            let (from, to) = self.window(centre, count);
            (index, self.profile.density_within(position - centre, from, to))
        };
        (from..to.min(count)).map(density).filter(|(_, density)| *density > 0.0).collect()
    }
}

impl FilmPlugin {
    /// The film's parameters.
    #[must_use]
    pub fn format(&self) -> &HdrFilm {
        let Self::Hdr(film) = self;
        film
    }
}
