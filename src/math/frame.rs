use glam::DVec3;

/// A right-handed orthonormal frame. The normal is the z axis of local directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The first tangent.
    pub s: DVec3,
    /// The second tangent.
    pub t: DVec3,
    /// The normal.
    pub n: DVec3,
}

impl Frame {
    /// A frame around a unit normal. It is continuous in the normal except at `n.z = 0`.
    /// Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1), listing 3.
    #[must_use]
    pub fn from_normal(n: DVec3) -> Self {
        let sign = 1.0_f64.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        let s = DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
        let t = DVec3::new(b, sign + n.y * n.y * a, -n.y);
        Self { s, t, n }
    }

    /// Transforms a vector from the world to the frame.
    #[must_use]
    pub fn to_local(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.s.dot(v), self.t.dot(v), self.n.dot(v))
    }

    /// Transforms a vector from the frame to the world.
    #[must_use]
    pub fn to_world(&self, v: DVec3) -> DVec3 {
        v.x * self.s + v.y * self.t + v.z * self.n
    }
}

/// The cosine between a local unit direction and the normal.
#[must_use]
pub fn cos_theta(v: DVec3) -> f64 {
    v.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn frames_are_orthonormal_and_right_handed(x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64) {
            prop_assume!(DVec3::new(x, y, z).length() > 1e-3);
            let n = DVec3::new(x, y, z).normalize();
            let f = Frame::from_normal(n);
            prop_assert!((f.s.length() - 1.0).abs() < 1e-12 && (f.t.length() - 1.0).abs() < 1e-12);
            prop_assert!(f.s.dot(f.t).abs() < 1e-12 && f.s.dot(n).abs() < 1e-12);
            prop_assert!((f.s.cross(f.t) - n).length() < 1e-12);
            let v = DVec3::new(z, x, y);
            prop_assert!((f.to_world(f.to_local(v)) - v).length() < 1e-12);
        }
    }
}
