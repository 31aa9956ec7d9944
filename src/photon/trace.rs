use std::ops::ControlFlow;

use rayon::prelude::*;

use super::{LONGEST, Photon};
use crate::{
    bsdf::Model as _,
    emitter::Emission,
    math::{Rgb, rng::Stream},
    scene::Scene,
    transport::{Arrival, Depths, PathClass, walk},
};

/// Which light is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// All of it; photons are kept wherever they meet a surface that scatters over more than single directions.
    Everywhere,
    /// Light that meets mirrors or glass first; photons are kept where it leaves them.
    Specular,
}

impl Aim {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Everywhere, Self::Specular];

    /// The name of the map that such light makes.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Everywhere => "global",
            Self::Specular => "caustic",
        }
    }

    /// The classes that photons of the map can have.
    #[must_use]
    pub fn classes(self) -> &'static [PathClass] {
        match self {
            Self::Everywhere => &[PathClass::Direct, PathClass::Caustic, PathClass::Indirect],
            Self::Specular => &[PathClass::Caustic],
        }
    }

    fn emit(self, scene: &Scene, numbers: &mut Stream) -> Option<Emission> {
        match self {
            Self::Everywhere => scene.emit(numbers).map(|(emission, _)| emission),
            Self::Specular => scene.emit_at_specular(numbers),
        }
    }

    /// Whether a path is still one that is followed when it arrives.
    fn follows(self, arrival: &Arrival<'_>) -> bool {
        match (self, arrival.before.class()) {
            (Self::Everywhere, _) | (Self::Specular, PathClass::Caustic) => true,
            (Self::Specular, PathClass::Direct) => arrival.bsdf.has_delta(),
            (Self::Specular, _) => false,
        }
    }

    fn keeps(self, arrival: &Arrival<'_>) -> bool {
        arrival.bsdf.is_smooth() && (self == Self::Everywhere || arrival.before.class() == PathClass::Caustic)
    }
}

/// What was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Photons.
    pub stored: u64,
    /// The sum of their powers in W.
    pub power: Rgb,
    /// The sum of the numbers of surfaces that they had met before.
    pub bounces: u64,
}

impl Tally {
    /// How many surfaces a photon had met before, on average; None without photons.
    #[must_use]
    pub fn mean_bounces(&self) -> Option<f64> {
        (self.stored > 0).then(|| self.bounces as f64 / self.stored as f64)
    }
}

/// Photons with where they arrived.
#[derive(Debug, Default)]
pub struct Harvest {
    /// Positions.
    pub positions: Vec<[f32; 3]>,
    /// Photons; each has the power of its path over the number of emitted ones.
    pub photons: Vec<Photon>,
    /// How many photons were emitted, which is what powers are divided by.
    pub emitted: u64,
    /// The power in W that was emitted.
    pub power: Rgb,
    /// The longest path that was followed, in segments.
    pub longest: u32,
}

impl Harvest {
    /// The counts of the photons of a class.
    #[must_use]
    pub fn tally(&self, class: PathClass) -> Tally {
        let of_class = self.photons.iter().filter(|photon| photon.class() == class);
        of_class.fold(Tally::default(), |tally, photon| Tally {
            stored: tally.stored + 1,
            power: tally.power + photon.power(),
            bounces: tally.bounces + u64::from(photon.bounces()),
        })
    }

    /// All of some, in their order.
    #[must_use]
    pub fn join(parts: Vec<Self>) -> Self {
        let count = parts.iter().map(|part| part.photons.len()).sum();
        let (positions, photons) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut all = Self { positions, photons, ..Self::default() };
        for part in parts {
            all.positions.extend(part.positions);
            all.photons.extend(part.photons);
            all.emitted += part.emitted;
            all.power += part.power;
            all.longest = all.longest.max(part.longest);
        }
        all
    }

    /// What is strange about it, if it holds no photon.
    #[must_use]
    pub fn warning(&self, aim: Aim) -> Option<String> {
        let emitted = self.emitted;
        // Without a segment beyond that to the eye there is nothing to keep.
        if self.longest == 0 || !self.photons.is_empty() {
            return None;
        }
        Some(match aim {
            Aim::Everywhere if self.power == Rgb::ZERO => format!("none of {emitted} photons carried any light"),
            Aim::Everywhere => {
                format!(
                    "none of {emitted} photons met a surface that could keep it: there is no light in the global map"
                )
            }
            Aim::Specular => {
                format!("none of {emitted} photons was cast on a surface by mirrors or glass: no caustics")
            }
        })
    }
}

/// Photons that are followed together.
const BATCH: u64 = 2048;

/// Emits so many photons and follows them. Each is a function of the address and its number alone, and they are kept in
/// the order of their numbers.
#[must_use]
pub fn harvest(scene: &Scene, aim: Aim, emitted: u64, depths: Depths, address: [u64; 3]) -> Harvest {
    Harvest::join(batches(scene, aim, emitted, depths, address))
}

/// What [`harvest`] gives, in the pieces in which it was made.
#[must_use]
pub fn batches(scene: &Scene, aim: Aim, emitted: u64, depths: Depths, address: [u64; 3]) -> Vec<Harvest> {
    let depths = Depths { max: depths.max.min(LONGEST), ..depths };
    let share = 1.0 / emitted as f64;
    let batch = |batch: u64| {
        let numbers = batch * BATCH..emitted.min((batch + 1) * BATCH);
        let mut found = Harvest { emitted: numbers.end - numbers.start, longest: depths.max, ..Harvest::default() };
        for index in numbers {
            let [seed, pass, purpose] = address;
            let mut numbers = Stream::at(&[seed, pass, purpose, index]);
            let Some(emission) = aim.emit(scene, &mut numbers) else { continue };
            found.power += share * emission.flux;
            walk(scene, &emission, depths, &mut numbers, |arrival, _| {
                if !aim.follows(arrival) {
                    return ControlFlow::Break(());
                }
                if aim.keeps(arrival) {
                    found.positions.push(arrival.vertex.surface.p.as_vec3().to_array());
                    found.photons.push(photon(scene, arrival, share));
                }
                ControlFlow::Continue(())
            });
        }
        found
    };
    (0..emitted.div_ceil(BATCH)).into_par_iter().map(batch).collect()
}

fn photon(scene: &Scene, arrival: &Arrival<'_>, share: f64) -> Photon {
    let vertex = &arrival.vertex;
    let (depth, class) = (arrival.depth, arrival.before.class());
    Photon::new(share * arrival.flux, vertex.back, vertex.facing(), scene.patch(vertex), depth, class)
}
