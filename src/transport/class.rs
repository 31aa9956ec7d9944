use crate::bsdf::Lobe;

/// The four parts of the light that an image shows, in Heckbert's notation: `L` a light, `E` the eye, `S` a single
/// direction (a mirror, glass, a surface that is not there), `D` everything else that scatters. Every path belongs to
/// exactly one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathClass {
    /// `LE` and `LDE`: a light that is seen, and what it lights.
    Direct,
    /// `L(S|D)*SE`: what is seen in mirrors and through glass.
    Specular,
    /// `LS+DE`: light that mirrors and glass cast on a surface.
    Caustic,
    /// `L(S|D)*DS*DE`: light from surfaces that are lit themselves.
    Indirect,
}

impl PathClass {
    /// All of them, in the order of their layers.
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

/// What is known of a path's class while it is followed from the eye: the class that it has if it ends at a light now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraPathClass {
    class: PathClass,
    /// Whether the path has met a surface at all.
    has_begun: bool,
}

impl CameraPathClass {
    /// A path that has met nothing yet.
    pub const START: Self = Self { class: PathClass::Direct, has_begun: false };

    /// The class if it meets a light.
    #[inline]
    #[must_use]
    pub fn if_emitter(self) -> PathClass {
        self.class
    }

    /// The class if its next vertex scatters light that comes straight from a light, over more than single directions.
    #[inline]
    #[must_use]
    pub fn if_direct(self) -> PathClass {
        if self.has_begun && self.class != PathClass::Specular { PathClass::Indirect } else { self.class }
    }

    /// After a vertex that scattered.
    #[inline]
    #[must_use]
    pub fn scattered(self, lobe: Lobe) -> Self {
        let class = match (lobe, self.class) {
            (Lobe::Smooth, _) => self.if_direct(),
            (_, _) if !self.has_begun => PathClass::Specular,
            (_, PathClass::Direct) => PathClass::Caustic,
            (_, class) => class,
        };
        Self { class, has_begun: true }
    }
}

/// What is known of a path's class while it is followed from a light: the class that it has if the eye sees its next
/// vertex scatter over more than single directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightPathClass(PathClass);

impl LightPathClass {
    /// A path that has met nothing yet.
    pub const START: Self = Self(PathClass::Direct);

    /// The class.
    #[inline]
    #[must_use]
    pub fn class(self) -> PathClass {
        self.0
    }

    /// After a vertex that scattered.
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

    /// The class of a path, from its vertices between light and eye, by the definition.
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
        fn both_ways_find_the_class_of_the_definition(path in prop::collection::vec(
            prop_oneof![Just(Lobe::Smooth), Just(Lobe::Delta), Just(Lobe::Null)], 0..7,
        )) {
            let from_eye = path.iter().rev().fold(CameraPathClass::START, |state, lobe| state.scattered(*lobe));
            prop_assert_eq!(from_eye.if_emitter(), class(&path));
            if let Some((Lobe::Smooth, rest)) = path.split_first() {
                let from_eye = rest.iter().rev().fold(CameraPathClass::START, |state, lobe| state.scattered(*lobe));
                prop_assert_eq!(from_eye.if_direct(), class(&path));
            }
            if let Some((Lobe::Smooth, rest)) = path.split_last() {
                let from_light = rest.iter().fold(LightPathClass::START, |state, lobe| state.scattered(*lobe));
                prop_assert_eq!(from_light.class(), class(&path));
            }
        }
    }
}
