//! Real roots of polynomials.

/// The real roots of `a x² + b x + c` in ascending order, or `None`. A double root is returned twice, as is the root of
/// a linear polynomial (`a = 0`).
///
/// The root that would suffer from cancellation is computed from the product of the roots, so that both are accurate to
/// a few ulp. Press et al. 2007, *Numerical Recipes*, section 5.6.
#[must_use]
pub fn quadratic(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    if a == 0.0 {
        let root = -c / b;
        return root.is_finite().then_some([root, root]);
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return None;
    }
    from_root(a, b, c, discriminant.sqrt())
}

/// The roots for a given square root of the discriminant, for callers that know it more exactly than `b² - 4ac`.
#[must_use]
pub fn from_root(a: f64, b: f64, c: f64, root: f64) -> Option<[f64; 2]> {
    let q = -0.5 * (b + root.copysign(b));
    let (x, y) = if q == 0.0 { (0.0, 0.0) } else { (q / a, c / q) };
    Some(if x <= y { [x, y] } else { [y, x] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_small_root_beside_a_large_one_keeps_its_digits() {
        let [small, large] = quadratic(1.0, -1e8, 1.0).expect("two roots");
        assert!((small - 1e-8).abs() < 1e-22 && (large - 1e8).abs() < 1e-6);
    }

    #[test]
    fn lines_and_parabolas_without_roots() {
        assert_eq!(quadratic(0.0, 2.0, -4.0), Some([2.0, 2.0]));
        assert_eq!(quadratic(0.0, 0.0, 1.0), None);
        assert_eq!(quadratic(1.0, 0.0, 1.0), None);
        assert_eq!(quadratic(1.0, 0.0, 0.0), Some([0.0, 0.0]));
    }

    proptest! {
        #[test]
        fn the_roots_of_a_product(a in 0.1..10.0f64, x in -10.0..10.0f64, gap in 1e-3..10.0f64) {
            let y = x + gap;
            let [found_x, found_y] = quadratic(a, -a * (x + y), a * x * y).expect("two roots");
            prop_assert!((found_x - x).abs() < 1e-9 && (found_y - y).abs() < 1e-9);
        }
    }
}
