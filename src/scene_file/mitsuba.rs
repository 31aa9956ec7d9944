//! The plugins of Mitsuba 3.9.1, to report which of them étendue reads.

use super::Category;

/// A plugin of Mitsuba.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MitsubaPlugin {
    /// The category of the plugin.
    pub category: Category,
    /// The name of the plugin.
    pub name: &'static str,
    /// The subject of the plugin.
    pub subject: Subject,
}

/// The subject of a plugin, which decides whether it is in étendue's scope.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// Light in linear RGB between surfaces, which is étendue's scope.
    Surfaces,
    /// Participating media.
    Media,
    /// Spectra that are not RGB.
    Spectra,
    /// Polarised light.
    Polarisation,
    /// Derivatives of images.
    Derivatives,
}

impl Subject {
    /// The subject in words if it is out of scope; None if it is in scope.
    #[must_use]
    pub fn out_of_scope(self) -> Option<&'static str> {
        match self {
            Self::Surfaces => None,
            Self::Media => Some("media"),
            Self::Spectra => Some("spectral"),
            Self::Polarisation => Some("polarisation"),
            Self::Derivatives => Some("derivatives"),
        }
    }
}

impl MitsubaPlugin {
    /// A message about a plugin that étendue does not read.
    #[must_use]
    pub fn missing(&self) -> String {
        match self.subject.out_of_scope() {
            None => "Mitsuba 3.9 has it, étendue does not yet".to_owned(),
            Some(subject) => format!("Mitsuba 3.9 has it; it is out of étendue's scope ({subject})"),
        }
    }
}

/// Every plugin of Mitsuba 3.9.1.
pub const PLUGINS: &[MitsubaPlugin] = {
    use Category::{Bsdf, Emitter, Film, Filter, Integrator, Medium, Phase, Sampler, Sensor, Shape, Texture, Volume};
    use Subject::{Derivatives, Media, Polarisation, Spectra, Surfaces};
    const fn plugin(category: Category, name: &'static str, subject: Subject) -> MitsubaPlugin {
        MitsubaPlugin { category, name, subject }
    }
    &[
        plugin(Integrator, "aov", Surfaces),
        plugin(Integrator, "depth", Surfaces),
        plugin(Integrator, "direct", Surfaces),
        plugin(Integrator, "direct_projective", Derivatives),
        plugin(Integrator, "moment", Surfaces),
        plugin(Integrator, "path", Surfaces),
        plugin(Integrator, "prb", Derivatives),
        plugin(Integrator, "prb_basic", Derivatives),
        plugin(Integrator, "prb_projective", Derivatives),
        plugin(Integrator, "prbvolpath", Derivatives),
        plugin(Integrator, "ptracer", Surfaces),
        plugin(Integrator, "stokes", Polarisation),
        plugin(Integrator, "volpath", Media),
        plugin(Integrator, "volpathmis", Media),
        plugin(Integrator, "volprim_rf_basic", Media),
        plugin(Sensor, "batch", Surfaces),
        plugin(Sensor, "distant", Surfaces),
        plugin(Sensor, "flat_sensor", Derivatives),
        plugin(Sensor, "irradiancemeter", Surfaces),
        plugin(Sensor, "orthographic", Surfaces),
        plugin(Sensor, "perspective", Surfaces),
        plugin(Sensor, "radiancemeter", Surfaces),
        plugin(Sensor, "thinlens", Surfaces),
        plugin(Film, "hdrfilm", Surfaces),
        plugin(Film, "specfilm", Spectra),
        plugin(Filter, "box", Surfaces),
        plugin(Filter, "catmullrom", Surfaces),
        plugin(Filter, "gaussian", Surfaces),
        plugin(Filter, "lanczos", Surfaces),
        plugin(Filter, "mitchell", Surfaces),
        plugin(Filter, "tent", Surfaces),
        plugin(Sampler, "independent", Surfaces),
        plugin(Sampler, "ldsampler", Surfaces),
        plugin(Sampler, "multijitter", Surfaces),
        plugin(Sampler, "orthogonal", Surfaces),
        plugin(Sampler, "stratified", Surfaces),
        plugin(Shape, "blender", Surfaces),
        plugin(Shape, "bsplinecurve", Surfaces),
        plugin(Shape, "cube", Surfaces),
        plugin(Shape, "cylinder", Surfaces),
        plugin(Shape, "disk", Surfaces),
        plugin(Shape, "ellipsoids", Media),
        plugin(Shape, "ellipsoidsmesh", Media),
        plugin(Shape, "instance", Surfaces),
        plugin(Shape, "linearcurve", Surfaces),
        plugin(Shape, "merge", Surfaces),
        plugin(Shape, "obj", Surfaces),
        plugin(Shape, "ply", Surfaces),
        plugin(Shape, "rectangle", Surfaces),
        plugin(Shape, "sdfgrid", Surfaces),
        plugin(Shape, "serialized", Surfaces),
        plugin(Shape, "shapegroup", Surfaces),
        plugin(Shape, "sphere", Surfaces),
        plugin(Bsdf, "blendbsdf", Surfaces),
        plugin(Bsdf, "bumpmap", Surfaces),
        plugin(Bsdf, "circular", Surfaces),
        plugin(Bsdf, "conductor", Surfaces),
        plugin(Bsdf, "dielectric", Surfaces),
        plugin(Bsdf, "diffuse", Surfaces),
        plugin(Bsdf, "hair", Surfaces),
        plugin(Bsdf, "mask", Surfaces),
        plugin(Bsdf, "measured", Surfaces),
        plugin(Bsdf, "measured_polarized", Polarisation),
        plugin(Bsdf, "normalmap", Surfaces),
        plugin(Bsdf, "null", Surfaces),
        plugin(Bsdf, "plastic", Surfaces),
        plugin(Bsdf, "polarizer", Surfaces),
        plugin(Bsdf, "pplastic", Polarisation),
        plugin(Bsdf, "principled", Surfaces),
        plugin(Bsdf, "principledthin", Surfaces),
        plugin(Bsdf, "retarder", Surfaces),
        plugin(Bsdf, "roughconductor", Surfaces),
        plugin(Bsdf, "roughdielectric", Surfaces),
        plugin(Bsdf, "roughplastic", Surfaces),
        plugin(Bsdf, "thindielectric", Surfaces),
        plugin(Bsdf, "twosided", Surfaces),
        plugin(Texture, "bitmap", Surfaces),
        plugin(Texture, "blackbody", Surfaces),
        plugin(Texture, "checkerboard", Surfaces),
        plugin(Texture, "d65", Surfaces),
        plugin(Texture, "irregular", Surfaces),
        plugin(Texture, "mesh_attribute", Surfaces),
        plugin(Texture, "rawconstant", Surfaces),
        plugin(Texture, "regular", Surfaces),
        plugin(Texture, "srgb", Surfaces),
        plugin(Texture, "uniform", Surfaces),
        plugin(Texture, "volume", Media),
        plugin(Emitter, "area", Surfaces),
        plugin(Emitter, "constant", Surfaces),
        plugin(Emitter, "directional", Surfaces),
        plugin(Emitter, "directionalarea", Surfaces),
        plugin(Emitter, "envmap", Surfaces),
        plugin(Emitter, "point", Surfaces),
        plugin(Emitter, "projector", Surfaces),
        plugin(Emitter, "spot", Surfaces),
        plugin(Emitter, "sunsky", Surfaces),
        plugin(Emitter, "timed_sunsky", Surfaces),
        plugin(Medium, "heterogeneous", Media),
        plugin(Medium, "homogeneous", Media),
        plugin(Phase, "blendphase", Media),
        plugin(Phase, "hg", Media),
        plugin(Phase, "isotropic", Media),
        plugin(Phase, "rayleigh", Media),
        plugin(Phase, "sggx", Media),
        plugin(Phase, "tabphase", Media),
        plugin(Volume, "constvolume", Media),
        plugin(Volume, "gridvolume", Media),
    ]
};
