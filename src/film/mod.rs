//! Films: the format and the reconstruction filter of an image, the sums that samples are added to, and image files.

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

use crate::scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, catalogue};
use filter::Profile;

catalogue! {
    /// A film.
    pub enum FilmPlugin in Category::Film, {
        /// High dynamic range, into `OpenEXR` files.
        Hdr(HdrFilm),
    }
}

/// The format of an image: its size in pixels, the part that is rendered, and the reconstruction filter. Files are always
/// `OpenEXR` with 32-bit floats; Mitsuba's parameters about files are read and have no effect.
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

/// No more pixels than this are gathered, some 10 GB of sums.
const MAX_PIXELS: u64 = 100_000_000;
const SIZE: Range = Range { min: 1.0, max: 1_000_000.0, open: false };

impl Described for HdrFilm {
    const PLUGIN: Plugin = Plugin {
        category: Category::Film,
        name: "hdrfilm",
        summary: "An image of high dynamic range.",
        params: &[
            Param::new("width", ParamKind::Integer, "768", "columns").within(SIZE),
            Param::new("height", ParamKind::Integer, "576", "rows").within(SIZE),
            Param::new("crop_offset_x", ParamKind::Integer, "0", "the first column that is rendered")
                .within(Range::NON_NEGATIVE),
            Param::new("crop_offset_y", ParamKind::Integer, "0", "the first row that is rendered")
                .within(Range::NON_NEGATIVE),
            Param::optional("crop_width", ParamKind::Integer, "width", "columns that are rendered").within(SIZE),
            Param::optional("crop_height", ParamKind::Integer, "height", "rows that are rendered").within(SIZE),
            Param::new(
                "sample_border",
                ParamKind::Boolean,
                "false",
                "whether wide filters reach beyond the crop's border",
            ),
            Param::new(
                "file_format",
                ParamKind::Choice(&["openexr", "rgbe", "pfm"]),
                "openexr",
                "read; files are OpenEXR",
            ),
            Param::new(
                "pixel_format",
                ParamKind::Choice(&["luminance", "luminance_alpha", "rgb", "rgba", "xyz", "xyza"]),
                "rgb",
                "read; files hold RGB",
            ),
            Param::new(
                "component_format",
                ParamKind::Choice(&["float16", "float32", "uint32"]),
                "float16",
                "read; files hold float32",
            ),
            Param::new("compensate", ParamKind::Boolean, "false", "read; sums are always exact"),
            Param::new("banner", ParamKind::Boolean, "true", "read; there is none"),
            Param::optional("rfilter", ParamKind::Object(Category::Filter), "gaussian", "the reconstruction filter"),
        ],
        examples: &[r#"<film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="32"/>
            <rfilter type="box"/></film>"#],
        evidence: &["film/filter", "film/footprint", "film/coverage"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        for ignored in ["file_format", "pixel_format", "component_format"] {
            params.string(ignored)?;
        }
        for ignored in ["compensate", "banner"] {
            params.boolean(ignored)?;
        }
        let integer = |name| params.integer(name).map(|i| i.unsigned_abs() as u32);
        let (width, height) = (integer("width")?, integer("height")?);
        let crop = Self::crop(params, width, height)?;
        if u64::from(crop.width) * u64::from(crop.height) > MAX_PIXELS {
            let error = params.error("width", format!("a film of {} x {} pixels", crop.width, crop.height));
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
    /// The film of a sensor that names none.
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
                let what = format!("the crop of {length} from {start} does not lie within the film's {whole}");
                return Err(params
                    .error(if given { size } else { offset }, what)
                    .hint(format!("give a {size} that does")));
            }
            Ok((start as u32, length as u32))
        };
        let (x, crop_width) = along("crop_offset_x", "crop_width", width)?;
        let (y, crop_height) = along("crop_offset_y", "crop_height", height)?;
        Ok(Crop { x, y, width: crop_width, height: crop_height })
    }

    /// The width and height of the whole film in pixels. The sensor's field of view spans it.
    #[must_use]
    pub fn size(&self) -> DVec2 {
        DVec2::new(f64::from(self.width), f64::from(self.height))
    }

    /// The part that is rendered.
    #[must_use]
    pub fn rendered(&self) -> Crop {
        self.crop
    }

    /// Samples a position on the film, in pixels from its top left corner, for the pixel in column `x` and row `y` of the
    /// rendered part. Its density is the filter around the centre of the pixel.
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

    /// Between which offsets from a pixel's centre its filter lies. Without a sampled border, the part beyond it is cut
    /// off, as it is in Mitsuba.
    fn window(&self, centre: f64, count: u32) -> (f64, f64) {
        if self.sample_border { (f64::MIN, f64::MAX) } else { (-centre, f64::from(count) - centre) }
    }

    /// The pixels of the rendered part whose filter covers a position on the film, by column and row, each with the density
    /// with which [`HdrFilm::sample`] samples this position for it, in 1/pixel².
    #[inline]
    pub fn seen_by(&self, position: DVec2) -> impl Iterator<Item = ((u32, u32), f64)> {
        let columns = self.seen_along(self.crop.x, self.crop.width, position.x);
        let rows = self.seen_along(self.crop.y, self.crop.height, position.y);
        rows.into_iter()
            .flat_map(move |(y, across)| columns.clone().into_iter().map(move |(x, along)| ((x, y), along * across)))
    }

    fn seen_along(&self, first: u32, count: u32, position: f64) -> SmallVec<[(u32, f64); 4]> {
        let position = position - f64::from(first);
        let reach = self.profile.radius();
        // Beyond the film the casts saturate.
        let (from, to) = ((position - reach - 0.5).ceil().max(0.0) as u32, (position + reach + 0.5).max(0.0) as u32);
        let density = |index| {
            let centre = f64::from(index) + 0.5;
            let (from, to) = self.window(centre, count);
            (index, self.profile.density_within(position - centre, from, to))
        };
        (from..to.min(count)).map(density).filter(|(_, density)| *density > 0.0).collect()
    }
}

impl FilmPlugin {
    /// The format of the image.
    #[must_use]
    pub fn format(&self) -> &HdrFilm {
        let Self::Hdr(film) = self;
        film
    }
}
