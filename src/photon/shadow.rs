use super::{
    EstimateParameters, GatherPoint, Kernel, PhotonMap, Stored, SurfaceSide,
    trace::{PhotonAddress, in_batches},
};
use crate::{
    math::Ray,
    scene::{Scene, SurfaceInteraction},
};

/// Visibility of emitters from shadow photons. Each emitted ray stores a direct photon at the first surface that it
/// hits, and shadow photons at all surfaces behind. Jensen and Christensen 1995, "Efficiently Rendering Shadows using
/// the Photon Map".
#[derive(Debug)]
pub struct ShadowMap {
    map: PhotonMap<ShadowPhoton>,
    parameters: EstimateParameters,
}

/// A direct photon or a shadow photon at a surface on a ray from an emitter.
#[derive(Clone, Copy, Debug)]
struct ShadowPhoton {
    side: SurfaceSide,
    /// The index of the emitter.
    emitter: u32,
    /// Whether the surface is the first on the ray.
    is_lit: bool,
}

impl Stored for ShadowPhoton {
    #[inline]
    fn side(&self) -> SurfaceSide {
        self.side
    }
}

/// The visibility of an emitter according to nearby photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// All nearby photons are direct photons.
    Lit,
    /// All nearby photons are shadow photons.
    Dark,
    /// Both kinds are nearby, or too few photons.
    Unknown,
}

/// The minimum number of an emitter's photons to decide its visibility.
const MIN_COUNT: usize = 8;

impl ShadowMap {
    /// Emits `count` photons. Each depends only on the address and its own index.
    #[must_use]
    pub fn new(scene: &Scene, count: u64, parameters: EstimateParameters, address: PhotonAddress) -> Self {
        let batches = in_batches(count, address, |sampler, batch: &mut Vec<_>| {
            if let Some((emission, emitter)) = scene.emit(sampler) {
                for_each_surface(scene, emission.ray, |si, is_lit| {
                    let photon = ShadowPhoton { side: SurfaceSide::facing(scene, si), emitter: emitter as u32, is_lit };
                    batch.push((si.surface.p.as_vec3().to_array(), photon));
                });
            }
        });
        let (positions, photons): (Vec<_>, Vec<_>) = batches.into_iter().flatten().unzip();
        let parameters = EstimateParameters { kernel: Kernel::Constant, ..parameters };
        Self { map: PhotonMap::new(&positions, photons), parameters }
    }

    /// The number of photons of both kinds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.map.len()
    }

    /// Whether it holds no photon.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.map.is_empty()
    }

    /// The visibility of an emitter, given by its index, according to the photons around a point.
    #[must_use]
    pub fn visibility(&self, point: &GatherPoint, emitter: usize) -> Visibility {
        let (mut lit, mut dark) = (0, 0);
        self.map.for_each_nearby(point, &self.parameters, |nearby| {
            if nearby.photon.emitter as usize == emitter {
                *(if nearby.photon.is_lit { &mut lit } else { &mut dark }) += 1;
            }
        });
        match (lit, dark) {
            (lit, 0) if lit >= MIN_COUNT => Visibility::Lit,
            (0, dark) if dark >= MIN_COUNT => Visibility::Dark,
            _ => Visibility::Unknown,
        }
    }
}

/// Calls `visit` for the surfaces that a ray hits, and whether each is the first.
fn for_each_surface(scene: &Scene, mut ray: Ray, mut visit: impl FnMut(&SurfaceInteraction, bool)) {
    const MAX_SURFACES: u32 = 64;
    for index in 0..MAX_SURFACES {
        let Some(si) = scene.intersect(&ray) else { return };
        visit(&si, index == 0);
        ray = Ray::leaving(si.surface.p, ray.direction);
    }
}
