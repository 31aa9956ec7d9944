//! Masks: the pixels over which errors are measured.

use super::spec::MaskSpec;
use crate::stats::tiles::luminance;

/// Marks the pixels that lie in the rectangle of a mask and whose luminance in the reference lies within its limits.
pub(super) fn mark(spec: &MaskSpec, width: usize, reference: &[[f64; 3]]) -> Vec<bool> {
    let within =
        |range: Option<[u32; 2]>, at: usize| range.is_none_or(|[from, to]| (from as usize..to as usize).contains(&at));
    let counts = |(i, pixel): (usize, &[f64; 3])| {
        let y = luminance(*pixel);
        within(spec.x, i % width)
            && within(spec.y, i / width)
            && spec.above.is_none_or(|limit| y > limit)
            && spec.below.is_none_or(|limit| y < limit)
    };
    reference.iter().enumerate().map(counts).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_and_luminances() {
        let image: Vec<[f64; 3]> = (0..6).map(|i| [f64::from(i); 3]).collect();
        let marked = |spec: MaskSpec| {
            let marks = mark(&spec, 3, &image);
            (0..6).filter(|i| marks[*i]).collect::<Vec<_>>()
        };
        assert_eq!(marked(MaskSpec { x: Some([1, 3]), ..MaskSpec::default() }), [1, 2, 4, 5]);
        assert_eq!(marked(MaskSpec { y: Some([1, 9]), above: Some(3.5), ..MaskSpec::default() }), [4, 5]);
        assert_eq!(marked(MaskSpec { below: Some(1.5), above: Some(0.5), ..MaskSpec::default() }), [1]);
    }
}
