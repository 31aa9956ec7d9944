use crate::{bsdf::Lobe, math::Rgb};

/// The classes of paths, in Heckbert's notation: `L` an emitter, `E` the eye, `S` a delta lobe (a mirror, glass, an
/// invisible surface), `D` a smooth lobe. Every path belongs to exactly one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathClass {
    /// `LE` and `LDE`: an emitter visible to the camera, and the light that it casts directly on a surface.
    Direct,
    /// `L(S|D)*SE`: everything visible in mirrors and through glass.
    Specular,
    /// `LS+DE`: light that mirrors and glass cast on a surface.
    Caustic,
    /// `L(S|D)*DS*DE`: light that other surfaces scatter on a surface.
    Indirect,
}

impl PathClass {
    /// All classes, in the order of their layers.
    pub const ALL: [Self; 4] = [Self::Direct, Self::Specular, Self::Caustic, Self::Indirect];

    /// The name of the layer.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Specular => "specular",
            Self::Caustic => "caustic",
            Self::Indirect => "indirect",
        }
    }
}

/// Radiance, in total and by class of path.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClassRadiance {
    /// The sum over all classes.
    pub total: Rgb,
    by_class: [Rgb; 4],
}

impl ClassRadiance {
    /// Adds the radiance of a path.
    #[inline]
    pub fn add(&mut self, class: PathClass, radiance: Rgb) {
        self.total += radiance;
        self.by_class[class as usize] += radiance;
    }

    /// Adds all classes of another one, times a factor.
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        for class in PathClass::ALL {
            self.add(class, factor * other.of(class));
        }
    }

    /// The radiance of a class.
    #[must_use]
    pub fn of(&self, class: PathClass) -> Rgb {
        self.by_class[class as usize]
    }

    /// Writes the classes into layers of three channels, in the order of [`PathClass::ALL`].
    pub fn write(&self, layers: &mut [f64]) {
        for (layer, radiance) in layers.chunks_exact_mut(3).zip(self.by_class) {
            radiance.write_to_slice(layer);
        }
    }
}

/// The class of a path that is traced from the camera, so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraPathClass {
    class: PathClass,
    /// Whether the path has scattered at all.
    has_scattered: bool,
}

impl CameraPathClass {
    /// A path that has not scattered yet.
    pub const START: Self = Self { class: PathClass::Direct, has_scattered: false };

    /// The class if the path ends at an emitter now.
    #[inline]
    #[must_use]
    pub fn if_emitter(self) -> PathClass {
        self.class
    }

    /// The class if the next vertex scatters direct light by a smooth lobe.
    #[inline]
    #[must_use]
    pub fn if_direct(self) -> PathClass {
        if self.has_scattered && self.class != PathClass::Specular { PathClass::Indirect } else { self.class }
    }

    /// The class if the next vertex scatters the light of a photon of a class by a smooth lobe.
    #[inline]
    #[must_use]
    pub fn if_photon(self, photon: PathClass) -> PathClass {
        match self.class {
            _ if !self.has_scattered => photon,
            PathClass::Specular => PathClass::Specular,
            _ => PathClass::Indirect,
        }
    }

    /// The class after a vertex that scattered by a lobe.
    #[inline]
    #[must_use]
    pub fn scattered(self, lobe: Lobe) -> Self {
        let class = match (lobe, self.class) {
            (Lobe::Smooth, _) => self.if_direct(),
            (_, _) if !self.has_scattered => PathClass::Specular,
            (_, PathClass::Direct) => PathClass::Caustic,
            (_, class) => class,
        };
        Self { class, has_scattered: true }
    }
}

/// The class of a path that is traced from an emitter, so far: its class if the next vertex scatters it to the camera
/// by a smooth lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightPathClass(PathClass);

impl LightPathClass {
    /// A path that has not scattered yet.
    pub const START: Self = Self(PathClass::Direct);

    /// The class.
    #[inline]
    #[must_use]
    pub fn class(self) -> PathClass {
        self.0
    }

    /// The class after a vertex that scattered by a lobe.
    #[inline]
    #[must_use]
    pub fn scattered(self, lobe: Lobe) -> Self {
        Self(match (lobe, self.0) {
            (Lobe::Smooth, _) | (_, PathClass::Indirect) => PathClass::Indirect,
            _ => PathClass::Caustic,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The class of a path, from its vertices between emitter and camera, by the definition.
    fn class(path: &[Lobe]) -> PathClass {
        let is_delta = |lobe: &Lobe| *lobe != Lobe::Smooth;
        match path.split_last() {
            None => PathClass::Direct,
            Some((last, _)) if is_delta(last) => PathClass::Specular,
            Some((_, [])) => PathClass::Direct,
            Some((_, before)) if before.iter().all(is_delta) => PathClass::Caustic,
            Some(_) => PathClass::Indirect,
        }
    }

    proptest! {
        #[test]
        fn both_directions_find_the_class_of_the_definition(path in prop::collection::vec(
            prop_oneof![Just(Lobe::Smooth), Just(Lobe::Delta), Just(Lobe::Null)], 0..7,
        )) {
            let from_camera = path.iter().rev().fold(CameraPathClass::START, |state, lobe| state.scattered(*lobe));
            prop_assert_eq!(from_camera.if_emitter(), class(&path));
            if let Some((Lobe::Smooth, rest)) = path.split_first() {
                let from_camera = rest.iter().rev().fold(CameraPathClass::START, |state, lobe| state.scattered(*lobe));
                prop_assert_eq!(from_camera.if_direct(), class(&path));
            }
            if let Some((Lobe::Smooth, rest)) = path.split_last() {
                let from_light = rest.iter().fold(LightPathClass::START, |state, lobe| state.scattered(*lobe));
                prop_assert_eq!(from_light.class(), class(&path));
            }
        }
    }
}
