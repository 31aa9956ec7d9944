use glam::{DMat3, DVec3, DVec4};

use crate::math::{Ray, roots};

/// The left side of the equation of a quadric, `pᵀ M p + v·p + k`. It is negative inside the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct QuadraticForm {
    /// `M`, which is symmetric.
    m: DMat3,
    v: DVec3,
    k: f64,
}

/// The intervals of a line's parameter in which a quadratic form is not positive: at most two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum InsideIntervals {
    None,
    All,
    Between([f64; 2]),
    /// Below the first parameter and above the second.
    Outside([f64; 2]),
}

impl QuadraticForm {
    /// A form from the coefficients of x², y², z², xy, xz, yz, x, y, z and 1.
    pub(super) fn new([a, b, c, d, e, f, g, h, i, j]: [f64; 10]) -> Self {
        let (d, e, f) = (0.5 * d, 0.5 * e, 0.5 * f);
        let m = DMat3::from_cols(DVec3::new(a, d, e), DVec3::new(d, b, f), DVec3::new(e, f, c));
        Self { m, v: DVec3::new(g, h, i), k: j }
    }

    /// A form that is symmetric around the z axis: `x² + y² - (c0 + c1 z + c2 z²)`.
    pub(super) fn revolved([c0, c1, c2]: [f64; 3]) -> Self {
        Self { m: DMat3::from_diagonal(DVec3::new(1.0, 1.0, -c2)), v: DVec3::new(0.0, 0.0, -c1), k: -c0 }
    }

    #[inline]
    pub(super) fn value(&self, p: DVec3) -> f64 {
        p.dot(self.m * p + self.v) + self.k
    }

    #[inline]
    pub(super) fn gradient(&self, p: DVec3) -> DVec3 {
        2.0 * (self.m * p) + self.v
    }

    /// Whether the form can change its sign across its zero set: it is not constant, and it is not plus or minus the
    /// square of a linear form. In both excluded cases all 2 x 2 minors of its 4 x 4 matrix vanish.
    pub(super) fn has_sides(&self) -> bool {
        let column = |i: usize| self.m.col(i).extend(0.5 * self.v[i]);
        let columns = [column(0), column(1), column(2), (0.5 * self.v).extend(self.k)];
        let scale = columns.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max);
        let columns = columns.map(|column| column / scale);
        // Equal products differ by a few ulp because of rounding.
        let is_minor = |a: DVec4, b: DVec4, i: usize, j: usize| {
            let (one, other) = (a[i] * b[j], a[j] * b[i]);
            (one - other).abs() > 1e-13 * (one.abs() + other.abs())
        };
        let pairs = || (0..4).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs().any(|(a, b)| pairs().any(|(i, j)| is_minor(columns[a], columns[b], i, j)))
    }

    /// The parameter at which a line is nearest to `centre`, and the coefficients of the form along the line as a
    /// polynomial around that parameter. They stay accurate for distant origins.
    #[inline]
    fn along_line(&self, ray: &Ray, centre: DVec3) -> (f64, [f64; 3]) {
        let d = ray.direction;
        let shift = (centre - ray.origin).dot(d) / d.length_squared();
        let o = ray.at(shift);
        let md = self.m * d;
        (shift, [d.dot(md), 2.0 * o.dot(md) + self.v.dot(d), self.value(o)])
    }

    /// The parameters at which a line intersects the surface, in order.
    #[inline]
    pub(super) fn roots(&self, ray: &Ray, centre: DVec3) -> Option<[f64; 2]> {
        let (shift, [a, b, c]) = self.along_line(ray, centre);
        roots::quadratic(a, b, c).map(|roots| roots.map(|t| t + shift))
    }

    /// The intervals in which a line is inside the solid.
    pub(super) fn inside(&self, ray: &Ray, centre: DVec3) -> InsideIntervals {
        let (shift, [a, b, c]) = self.along_line(ray, centre);
        let Some([first, second]) = roots::quadratic(a, b, c).map(|roots| roots.map(|t| t + shift)) else {
            return if c <= 0.0 && a <= 0.0 { InsideIntervals::All } else { InsideIntervals::None };
        };
        if a > 0.0 {
            InsideIntervals::Between([first, second])
        } else if a < 0.0 {
            InsideIntervals::Outside([first, second])
        } else if b > 0.0 {
            InsideIntervals::Between([f64::NEG_INFINITY, first])
        } else {
            InsideIntervals::Between([first, f64::INFINITY])
        }
    }

    /// Projects a point onto the surface, which it misses by a rounding error. Also returns the unit gradient there.
    #[inline]
    pub(super) fn project(&self, p: DVec3) -> (DVec3, DVec3) {
        let gradient = self.gradient(p);
        let squared = gradient.length_squared();
        // The gradient vanishes only at the apex of a cone.
        if squared == 0.0 {
            return (p, DVec3::Z);
        }
        let projected = p - (self.value(p) / squared) * gradient;
        (projected, self.gradient(projected).try_normalize().unwrap_or(DVec3::Z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evaluates x² + 2y² + 3z² + 4xy + 5xz + 6yz + 7x + 8y + 9z + 10 and its gradient at (1, 2, 3).
    #[test]
    fn each_coefficient_multiplies_its_monomial() {
        let form = QuadraticForm::new([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        let p = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!(form.value(p), 1.0 + 8.0 + 27.0 + 8.0 + 15.0 + 36.0 + 7.0 + 16.0 + 27.0 + 10.0);
        assert_eq!(
            form.gradient(p),
            DVec3::new(2.0 + 8.0 + 15.0 + 7.0, 8.0 + 4.0 + 18.0 + 8.0, 18.0 + 5.0 + 12.0 + 9.0)
        );
    }

    #[test]
    fn squares_of_linear_forms_have_no_sides() {
        // (x + 2y - z + 3)²
        let double = [1.0, 4.0, 1.0, 4.0, -2.0, -4.0, 6.0, 12.0, -6.0, 9.0];
        assert!(!QuadraticForm::new(double).has_sides());
        assert!(!QuadraticForm::new([0.0; 10]).has_sides());
        let large = QuadraticForm::new([1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1e14]);
        let far = QuadraticForm::new([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1e9]);
        assert!(large.has_sides() && far.has_sides());
        let constant = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0];
        assert!(!QuadraticForm::new(constant).has_sides());
        let plane = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        assert!(QuadraticForm::new(plane).has_sides());
        assert!(QuadraticForm::revolved([0.0, 0.0, 1.0]).has_sides());
    }

    #[test]
    fn a_line_is_inside_between_or_outside_the_roots() {
        let along_x = |y: f64, z: f64| Ray::new(DVec3::new(0.0, y, z), DVec3::X);
        let up = Ray::new(DVec3::new(0.5, 0.0, 0.0), DVec3::Z);
        let sphere = QuadraticForm::new([1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0]);
        assert_eq!(sphere.inside(&along_x(0.0, 0.0), DVec3::ZERO), InsideIntervals::Between([-1.0, 1.0]));
        assert_eq!(sphere.inside(&along_x(2.0, 0.0), DVec3::ZERO), InsideIntervals::None);
        let cone = QuadraticForm::revolved([0.0, 0.0, 1.0]);
        assert_eq!(cone.inside(&up, DVec3::ZERO), InsideIntervals::Outside([-0.5, 0.5]));
        let one_sheet = QuadraticForm::revolved([1.0, 0.0, 1.0]);
        assert_eq!(one_sheet.inside(&up, DVec3::ZERO), InsideIntervals::All);
        let paraboloid = QuadraticForm::revolved([0.0, 1.0, 0.0]);
        assert_eq!(paraboloid.inside(&up, DVec3::ZERO), InsideIntervals::Between([0.25, f64::INFINITY]));
    }
}
