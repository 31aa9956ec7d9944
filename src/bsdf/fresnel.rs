//! How much light a smooth interface reflects, unpolarised, and where the rest goes.

use glam::DVec3;

use crate::math::Rgb;

/// What happens at a smooth interface of two dielectrics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// The reflected part of the power, from 0 to 1.
    pub reflectance: f64,
    /// The cosine of the refracted ray to the normal, of the sign opposite to the incident one; 0 at total reflection.
    pub cos_t: f64,
    /// The index on the far side over that on the near side.
    pub eta: f64,
}

/// Fresnel's equations for unpolarised light at an interface whose index below the normal over that above it is
/// `eta`; `cos_i` is negative for light that comes from below. Born and Wolf 1999, *Principles of Optics*,
/// section 1.5.2, eq. (20) and (21).
#[must_use]
pub fn dielectric(cos_i: f64, eta: f64) -> Interface {
    let eta = if cos_i >= 0.0 { eta } else { 1.0 / eta };
    // Snell's law.
    let sin_t_squared = (1.0 - cos_i * cos_i) / (eta * eta);
    if sin_t_squared >= 1.0 && eta != 1.0 {
        return Interface { reflectance: 1.0, cos_t: 0.0, eta };
    }
    let ci = cos_i.abs();
    let ct = (1.0 - sin_t_squared).max(0.0).sqrt();
    let (reflectance, ct) = if eta == 1.0 {
        (0.0, ci)
    } else {
        let s = (ci - eta * ct) / (ci + eta * ct);
        let p = (eta * ci - ct) / (eta * ci + ct);
        (0.5 * (s * s + p * p), ct)
    };
    Interface { reflectance, cos_t: -ct.copysign(cos_i), eta }
}

/// Schlick's approximation of the reflectance at an interface, with the cosine on its less dense side, and total reflection
/// where Snell's law has it. Its largest error at an index of 1.5 is 0.035693, at 84.975 degrees.
/// Schlick 1994, "An Inexpensive BRDF BsdfModel for Physically-based Rendering", Computer Graphics Forum 13(3), eq. (15).
#[must_use]
pub fn schlick(cos_i: f64, eta: f64) -> Interface {
    let exact = dielectric(cos_i, eta);
    if exact.reflectance == 1.0 || exact.eta == 1.0 {
        return exact;
    }
    let cos = if exact.eta > 1.0 { cos_i } else { exact.cos_t }.abs();
    let straight = ((exact.eta - 1.0) / (exact.eta + 1.0)).powi(2);
    Interface { reflectance: straight + (1.0 - straight) * (1.0 - cos).powi(5), ..exact }
}

/// An interface that reflects nothing but what Snell's law reflects totally.
#[must_use]
pub fn refracting(cos_i: f64, eta: f64) -> Interface {
    let exact = dielectric(cos_i, eta);
    if exact.reflectance == 1.0 { exact } else { Interface { reflectance: 0.0, ..exact } }
}

/// The refracted direction for a local `wi` on an interface already worked out by [`dielectric`].
#[must_use]
pub fn refract(wi: DVec3, interface: &Interface) -> DVec3 {
    DVec3::new(-wi.x / interface.eta, -wi.y / interface.eta, interface.cos_t)
}

/// Fresnel's equations for a conductor of complex index `eta + i k`, relative to the outside, one channel at a time.
/// Born and Wolf 1999, section 14.2; in the form of Lagarde 2013, "Memo on Fresnel equations".
#[must_use]
pub fn conductor(cos_i: f64, eta: Rgb, k: Rgb) -> Rgb {
    // No light gets into a perfect one: the formulas below say the same in more words.
    if eta == Rgb::ZERO {
        return Rgb::ONE;
    }
    let channel = |eta: f64, k: f64| {
        let (cos2, sin2) = (cos_i * cos_i, 1.0 - cos_i * cos_i);
        let (eta2, k2) = (eta * eta, k * k);
        let t0 = eta2 - k2 - sin2;
        let a2_plus_b2 = (t0 * t0 + 4.0 * eta2 * k2).sqrt();
        let a = (0.5 * (a2_plus_b2 + t0)).max(0.0).sqrt();
        let (t1, t2) = (a2_plus_b2 + cos2, 2.0 * cos_i * a);
        let s = (t1 - t2) / (t1 + t2);
        let (t3, t4) = (cos2 * a2_plus_b2 + sin2 * sin2, t2 * sin2);
        let p = s * (t3 - t4) / (t3 + t4);
        0.5 * (s + p)
    };
    Rgb::new(channel(eta.x, k.x), channel(eta.y, k.y), channel(eta.z, k.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_conductor_without_absorption_is_a_dielectric() {
        for degrees in [0.0_f64, 30.0, 56.3, 80.0, 89.0] {
            let cos = degrees.to_radians().cos();
            let metal = conductor(cos, Rgb::splat(1.5), Rgb::ZERO).x;
            assert!((metal - dielectric(cos, 1.5).reflectance).abs() < 1e-13, "{degrees}");
        }
    }

    #[test]
    fn no_interface_reflects_nothing_and_bends_nothing() {
        for cos in [1.0, 0.3, 1e-9, -0.5] {
            let interface = dielectric(cos, 1.0);
            assert_eq!((interface.reflectance, interface.cos_t), (0.0, -cos));
        }
    }

    #[test]
    fn a_perfect_conductor_reflects_all() {
        assert_eq!(conductor(0.3, Rgb::ZERO, Rgb::ONE), Rgb::ONE);
    }
}
