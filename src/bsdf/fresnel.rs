//! Fresnel reflectance and refraction at smooth interfaces, for unpolarised light.

use glam::DVec3;

use crate::math::Rgb;

/// Reflection and refraction at a smooth interface between two dielectrics, for one angle of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// The reflected fraction of the power, from 0 to 1.
    pub reflectance: f64,
    /// The cosine between the refracted ray and the normal, of opposite sign to the incident cosine; 0 at total
    /// reflection.
    pub cos_t: f64,
    /// The index of refraction on the transmitted side over that on the incident side.
    pub eta: f64,
}

/// Fresnel's equations for unpolarised light. `eta` is the index below the normal over that above it, and `cos_i` is
/// negative for light from below. Born and Wolf 1999, *Principles of Optics*, section 1.5.2, eq. (20) and (21).
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

/// Schlick's approximation of the reflectance, with the cosine on the less dense side. Total reflection follows Snell's
/// law. The largest error at an index of 1.5 is 0.035693, at 84.975 degrees. Schlick 1994, "An Inexpensive BRDF Model
/// for Physically-based Rendering", Computer Graphics Forum 13(3), eq. (15).
#[must_use]
pub fn schlick(cos_i: f64, eta: f64) -> Interface {
    let exact = dielectric(cos_i, eta);
    if exact.reflectance == 1.0 || exact.eta == 1.0 {
        return exact;
    }
    let cos = if exact.eta > 1.0 { cos_i } else { exact.cos_t }.abs();
    let normal_incidence = ((exact.eta - 1.0) / (exact.eta + 1.0)).powi(2);
    Interface { reflectance: normal_incidence + (1.0 - normal_incidence) * (1.0 - cos).powi(5), ..exact }
}

/// An interface that reflects only by total internal reflection.
#[must_use]
pub fn refracting(cos_i: f64, eta: f64) -> Interface {
    let exact = dielectric(cos_i, eta);
    if exact.reflectance == 1.0 { exact } else { Interface { reflectance: 0.0, ..exact } }
}

/// The refracted direction for a local `wi`, at an interface computed by [`dielectric`].
#[must_use]
pub fn refract(wi: DVec3, interface: &Interface) -> DVec3 {
    DVec3::new(-wi.x / interface.eta, -wi.y / interface.eta, interface.cos_t)
}

/// Fresnel's equations for a conductor with complex index `eta + i k` relative to the outside, for each channel. Born
/// and Wolf 1999, section 14.2; in the form of Lagarde 2013, "Memo on Fresnel equations".
#[must_use]
pub fn conductor(cos_i: f64, eta: Rgb, k: Rgb) -> Rgb {
    let channel = |eta: f64, k: f64| {
        // An imaginary index reflects everything. The formulas below give the same, except 0 / 0 at normal incidence.
        if eta == 0.0 {
            return 1.0;
        }
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
    fn equal_indices_neither_reflect_nor_refract() {
        for cos in [1.0, 0.3, 1e-9, -0.5] {
            let interface = dielectric(cos, 1.0);
            assert_eq!((interface.reflectance, interface.cos_t), (0.0, -cos));
        }
    }

    #[test]
    fn a_perfect_conductor_reflects_everything() {
        assert_eq!(conductor(0.3, Rgb::ZERO, Rgb::ONE), Rgb::ONE);
        assert_eq!(conductor(1.0, Rgb::new(0.0, 1.0, 1.0), Rgb::ZERO), Rgb::new(1.0, 0.0, 0.0));
    }
}
