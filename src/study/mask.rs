//! Which pixels count.

use super::form::MaskForm;
use crate::stats::tiles::luminance;

/// Marks the pixels of an image that lie in the rectangle and between the luminances of a mask.
pub(super) fn mark(form: &MaskForm, width: usize, reference: &[[f64; 3]]) -> Vec<bool> {
    let within =
        |range: Option<[u32; 2]>, at: usize| range.is_none_or(|[from, to]| (from as usize..to as usize).contains(&at));
    let counts = |(i, pixel): (usize, &[f64; 3])| {
        let y = luminance(*pixel);
        within(form.x, i % width)
            && within(form.y, i / width)
            && form.above.is_none_or(|limit| y > limit)
            && form.below.is_none_or(|limit| y < limit)
    };
    reference.iter().enumerate().map(counts).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_and_luminances() {
        let image: Vec<[f64; 3]> = (0..6).map(|i| [f64::from(i); 3]).collect();
        let marked = |form: MaskForm| {
            let marks = mark(&form, 3, &image);
            (0..6).filter(|i| marks[*i]).collect::<Vec<_>>()
        };
        assert_eq!(marked(MaskForm { x: Some([1, 3]), ..MaskForm::default() }), [1, 2, 4, 5]);
        assert_eq!(marked(MaskForm { y: Some([1, 9]), above: Some(3.5), ..MaskForm::default() }), [4, 5]);
        assert_eq!(marked(MaskForm { below: Some(1.5), above: Some(0.5), ..MaskForm::default() }), [1]);
    }
}
