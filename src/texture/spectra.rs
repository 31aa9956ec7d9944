use glam::DVec2;

use super::TextureModel;
use crate::{
    math::Rgb,
    scene_file::{Category, Described, Param, ParamKind, Params, Plugin, Range, SceneError, manual},
    spectrum::{self, Quantity},
};

/// A spectrum that a plugin defines, as two colours: as a reflectance, and as the emission of a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Colours {
    reflectance: Rgb,
    light: Rgb,
}

impl Colours {
    fn of(colour: impl Fn(Quantity) -> Rgb) -> Self {
        Self { reflectance: colour(Quantity::Reflectance), light: colour(Quantity::Light) }
    }

    /// The colour as the emission of a light.
    pub(super) fn light(self) -> Rgb {
        self.light
    }
}

/// The same value at every wavelength. As in Mitsuba's RGB variants it is grey, also as the emission of a light; a
/// light `<spectrum value="1"/>` is not grey.
#[derive(Clone, Debug)]
pub struct Uniform {
    value: f64,
}

/// A colour in linear Rec. 709 RGB.
#[derive(Clone, Debug)]
pub struct Srgb {
    colour: Rgb,
}

/// The standard illuminant D65, which is white, times a colour and a factor.
#[derive(Clone, Debug)]
pub struct D65 {
    colour: Rgb,
}

/// The emission of a black body by Planck's law, in W per m², sr and nm. Mitsuba has it in its spectral variants only;
/// the colour here is the colour that they render.
#[derive(Clone, Debug)]
pub struct BlackBody(pub(super) Colours);

/// A spectrum of values at equal distances, linear between them. Mitsuba has it in its spectral variants only; here it
/// becomes the same RGB as the same values in a `<spectrum>`.
#[derive(Clone, Debug)]
pub struct Regular(pub(super) Colours);

/// A spectrum of values at any wavelengths, linear between them. Mitsuba has it in its spectral variants only; here it
/// becomes the same RGB as the same values in a `<spectrum>`.
#[derive(Clone, Debug)]
pub struct Irregular(pub(super) Colours);

const WAVELENGTH: Range = Range::POSITIVE;
const EVIDENCE: &[&str] = &["spectrum/rgb"];

impl Described for Uniform {
    const PLUGIN: Plugin = Plugin {
        category: Category::Texture,
        manual: manual!("spectra.rs": "Uniform"),
        name: "uniform",
        summary: "A spectrum with the same value at every wavelength.",
        params: &[
            Param::required("value", ParamKind::Float, "the value"),
            Param::ignored("wavelength_min", ParamKind::Float, "RGB has no wavelengths"),
            Param::ignored("wavelength_max", ParamKind::Float, "RGB has no wavelengths"),
        ],
        examples: &[r#"<spectrum type="uniform"><float name="value" value="0.3"/></spectrum>"#],
        evidence: EVIDENCE,
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { value: params.float("value")? })
    }
}

impl Described for Srgb {
    const PLUGIN: Plugin = Plugin {
        category: Category::Texture,
        manual: manual!("spectra.rs": "Srgb"),
        name: "srgb",
        summary: "A colour in linear RGB.",
        params: &[
            Param::required("color", ParamKind::Rgb, "the colour, linear RGB"),
            Param::new("unbounded", ParamKind::Boolean, "false", "whether channels may exceed 1"),
        ],
        examples: &[r#"<spectrum type="srgb"><rgb name="color" value="0.2, 0.5, 0.7"/></spectrum>"#],
        evidence: EVIDENCE,
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let (colour, is_unbounded) = (params.rgb("color")?, params.boolean("unbounded")?);
        let is_reflectance = colour.min_element() >= 0.0 && colour.max_element() <= 1.0;
        if !is_reflectance && !is_unbounded {
            let error = params.error("color", format!("\"color\" is {colour}"));
            return Err(error.hint("each channel must be from 0 to 1, unless \"unbounded\" is true"));
        }
        Ok(Self { colour })
    }
}

impl Described for D65 {
    const PLUGIN: Plugin = Plugin {
        category: Category::Texture,
        manual: manual!("spectra.rs": "D65"),
        name: "d65",
        summary: "The standard illuminant D65.",
        params: &[
            Param::new("color", ParamKind::Rgb, "1", "scales the channels, linear RGB"),
            Param::new("scale", ParamKind::Float, "1", "scales all channels"),
        ],
        examples: &[r#"<spectrum type="d65"><float name="scale" value="0.6"/></spectrum>"#],
        evidence: EVIDENCE,
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { colour: params.rgb("color")? * params.float("scale")? })
    }
}

impl Described for BlackBody {
    const PLUGIN: Plugin = Plugin {
        category: Category::Texture,
        manual: manual!("spectra.rs": "BlackBody"),
        name: "blackbody",
        summary: "The emission of a black body.",
        params: &[
            Param::required("temperature", ParamKind::Float, "the temperature in K").within(Range {
                min: 0.0,
                max: 1e6,
                open: true,
            }),
            Param::new("wavelength_min", ParamKind::Float, "360", "the shortest wavelength in nm").within(WAVELENGTH),
            Param::new("wavelength_max", ParamKind::Float, "830", "the longest wavelength in nm").within(WAVELENGTH),
        ],
        examples: &[],
        evidence: &["spectrum/blackbody"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let (temperature, range) = (params.float("temperature")?, range(params)?);
        Ok(Self(Colours::of(|quantity| spectrum::blackbody_to_rgb(temperature, range, quantity))))
    }
}

impl Described for Regular {
    const PLUGIN: Plugin = Plugin {
        category: Category::Texture,
        manual: manual!("spectra.rs": "Regular"),
        name: "regular",
        summary: "A spectrum of values at equal distances.",
        params: &[
            Param::required("wavelength_min", ParamKind::Float, "the first wavelength in nm").within(WAVELENGTH),
            Param::required("wavelength_max", ParamKind::Float, "the last wavelength in nm").within(WAVELENGTH),
            Param::required("values", ParamKind::String, "the values, separated by commas or blanks"),
        ],
        examples: &[r#"<spectrum type="regular"><float name="wavelength_min" value="400"/>
            <float name="wavelength_max" value="700"/><string name="values" value="0.1, 0.2, 0.7"/></spectrum>"#],
        evidence: EVIDENCE,
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let ((first, last), values) = (range(params)?, params.numbers("values")?);
        let step = (last - first) / (values.len().max(2) - 1) as f64;
        let pairs: Vec<_> = values.into_iter().enumerate().map(|(i, value)| (first + step * i as f64, value)).collect();
        tabulated(params, &pairs).map(Self)
    }
}

impl Described for Irregular {
    const PLUGIN: Plugin = Plugin {
        category: Category::Texture,
        manual: manual!("spectra.rs": "Irregular"),
        name: "irregular",
        summary: "A spectrum of values at any wavelengths.",
        params: &[
            Param::required("wavelengths", ParamKind::String, "the wavelengths in nm, separated by commas or blanks"),
            Param::required("values", ParamKind::String, "the values, separated by commas or blanks"),
        ],
        examples: &[r#"<spectrum type="irregular"><string name="wavelengths" value="400, 500, 600, 700"/>
            <string name="values" value="0.1, 0.6, 0.3, 0.9"/></spectrum>"#],
        evidence: EVIDENCE,
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        let (wavelengths, values) = (params.numbers("wavelengths")?, params.numbers("values")?);
        if wavelengths.len() != values.len() {
            let what = format!("{} wavelengths and {} values", wavelengths.len(), values.len());
            return Err(params.error("values", what).hint("give as many of each"));
        }
        let pairs: Vec<_> = wavelengths.into_iter().zip(values).collect();
        tabulated(params, &pairs).map(Self)
    }
}

/// The wavelengths between which a spectrum is defined.
fn range(params: &Params<'_>) -> Result<(f64, f64), SceneError> {
    let (first, last) = (params.float("wavelength_min")?, params.float("wavelength_max")?);
    if first < last {
        return Ok((first, last));
    }
    Err(params.error("wavelength_max", format!("wavelength_max {last} is not above wavelength_min {first}")))
}

fn tabulated(params: &Params<'_>, pairs: &[(f64, f64)]) -> Result<Colours, SceneError> {
    spectrum::check_pairs(pairs).map_err(|what| params.error("values", what))?;
    Ok(Colours::of(|quantity| spectrum::to_rgb(pairs, quantity)))
}

/// A constant texture.
macro_rules! constant {
    ($($Type:ty => $colour:expr),* $(,)?) => {
        $(impl TextureModel for $Type {
            fn eval(&self, _uv: DVec2) -> Rgb {
                let colour: fn(&Self) -> Rgb = $colour;
                colour(self)
            }

            fn extremes(&self) -> (Rgb, Rgb) {
                super::extremes_of([self.eval(DVec2::ZERO)])
            }
        })*
    };
}

constant! {
    Uniform => |uniform| Rgb::splat(uniform.value),
    Srgb => |srgb| srgb.colour,
    D65 => |d65| d65.colour,
    BlackBody => |spectrum| spectrum.0.reflectance,
    Regular => |spectrum| spectrum.0.reflectance,
    Irregular => |spectrum| spectrum.0.reflectance,
}
