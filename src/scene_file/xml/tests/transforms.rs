use glam::{DAffine3, DMat3, DVec3};
use proptest::prelude::*;

use super::{refused_in_shape, value};
use crate::scene_file::Value;

/// The map of a transform with these operations.
fn map(operations: &str) -> DAffine3 {
    match value(&format!("<transform name=\"to_world\">{operations}</transform>")) {
        Value::Transform(transform) => transform,
        other => panic!("{other:?}"),
    }
}

/// Compares with the rows of a matrix, which were computed by hand; rounding of sines and square roots is allowed.
#[track_caller]
fn assert_rows(operations: &str, rows: [[f64; 4]; 3]) {
    let found = map(operations);
    for (i, row) in rows.iter().enumerate() {
        let m = found.matrix3.row(i);
        let found = [m.x, m.y, m.z, found.translation[i]];
        assert!(found.iter().zip(row).all(|(a, b)| (a - b).abs() < 1e-15), "{operations}: row {i}: {found:?}");
    }
}

const X: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
const Y: [f64; 4] = [0.0, 1.0, 0.0, 0.0];
const Z: [f64; 4] = [0.0, 0.0, 1.0, 0.0];

fn negative([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [-a, -b, -c, -d]
}

#[test]
fn single_operations() {
    assert_rows("", [X, Y, Z]);
    assert_rows("<translate y=\"2\"/>", [X, [0.0, 1.0, 0.0, 2.0], Z]);
    assert_rows("<translate value=\"2\"/>", [[1., 0., 0., 2.], [0., 1., 0., 2.], [0., 0., 1., 2.]]);
    assert_rows("<scale z=\"4\"/>", [X, Y, [0.0, 0.0, 4.0, 0.0]]);
    assert_rows("<scale value=\"1, 2, 3\"/>", [X, [0., 2., 0., 0.], [0., 0., 3., 0.]]);
    assert_rows("<scale/><translate/>", [X, Y, Z]);
    // A quarter turn takes y to z, z to x, x to y.
    assert_rows("<rotate x=\"1\" angle=\"90\"/>", [X, negative(Z), Y]);
    assert_rows("<rotate y=\"1\" angle=\"90\"/>", [Z, Y, negative(X)]);
    assert_rows("<rotate z=\"1\" angle=\"90\"/>", [negative(Y), X, Z]);
    assert_rows("<rotate value=\"0, 0, -1\" angle=\"90\"/>", [Y, negative(X), Z]);
}

/// `M = operation * M`: later operations apply later.
#[test]
fn operations_act_in_document_order() {
    assert_rows("<scale value=\"2\"/><translate x=\"1\"/>", [[2., 0., 0., 1.], [0., 2., 0., 0.], [0., 0., 2., 0.]]);
    assert_rows("<translate x=\"1\"/><scale value=\"2\"/>", [[2., 0., 0., 2.], [0., 2., 0., 0.], [0., 0., 2., 0.]]);
    assert_rows("<translate x=\"1\"/><rotate z=\"1\" angle=\"90\"/>", [negative(Y), [1., 0., 0., 1.], Z]);
}

#[test]
fn matrices_go_row_by_row() {
    let rows = [[1., 2., 3., 4.], [0., 6., 7., 8.], [9., 0., 11., 12.]];
    assert_rows("<matrix value=\"1 2 3 4  0 6 7 8  9 0 11 12  0 0 0 1\"/>", rows);
    assert_rows("<matrix value=\"0,0,1, 1,0,0, 0,1,0\"/>", [Z, X, Y]);
}

/// Columns are left, up, direction, origin.
#[test]
fn lookat() {
    let camera = "<lookat origin=\"1,2,3\" target=\"1,2,-7\" up=\"0,5,1\"/>";
    assert_rows(camera, [[-1., 0., 0., 1.], [0., 1., 0., 2.], [0., 0., -1., 3.]]);
    let rows = [[0., 0.6, 0.8, 1.0], [1., 0., 0., 0.], [0., 0.8, -0.6, 0.]];
    assert_rows("<lookat origin=\"1 0 0\" target=\"5 0 -3\" up=\"0 0 1\"/>", rows);
    // Without `up`, the result of Mitsuba 3.9.1.
    for up in ["", "up=\"\"", "up=\"0 0 0\""] {
        assert_rows(&format!("<lookat origin=\"0,0,0\" target=\"0,0,1\" {up}/>"), [Y, negative(X), Z]);
        assert_rows(&format!("<lookat origin=\"0,0,0\" target=\"0,1,0\" {up}/>"), [Y, Z, X]);
        let found = map(&format!("<lookat origin=\"1,2,3\" target=\"3,5,4\" {up}/>"));
        let left = DVec3::new(0.338187, -0.492719, 0.801784);
        let above = DVec3::new(0.774542, -0.338187, -0.534522);
        assert!((found.matrix3.x_axis - left).length() < 1e-6 && (found.matrix3.y_axis - above).length() < 1e-6);
    }
}

#[test]
fn an_axis_that_was_rounded_is_a_unit_axis() {
    let found = map("<rotate x=\"0.7071\" y=\"0.7071\" angle=\"180\"/>");
    let exact = DMat3::from_cols(DVec3::Y, DVec3::X, -DVec3::Z);
    assert!(found.matrix3.abs_diff_eq(exact, 1e-15), "{found:?}");
}

/// Operations of transforms that are rejected.
const REFUSED_OPERATIONS: [(&str, &str); 18] = [
    ("<rotate x=\"1\"/>", "1: missing attribute \"angle\" in <rotate>; write <rotate angle=\"...\">"),
    ("<rotate angle=\"90\"/>", "1: the rotation axis is zero; write for example x=\"1\""),
    (
        "<rotate z=\"2\" angle=\"1\"/>",
        concat!(
            "1: the rotation axis has length 2.000000, and Mitsuba would shear with it; ",
            "write x=\"0\" y=\"0\" z=\"1\""
        ),
    ),
    (
        "<rotate value=\"0.577\" angle=\"1\"/>",
        concat!(
            "1: the rotation axis has length 0.999393, and Mitsuba would shear with it; ",
            "write x=\"0.5773502691896258\" y=\"0.5773502691896258\" z=\"0.5773502691896258\""
        ),
    ),
    ("<rotate x=\"1\" angle=\"inf\"/>", "15: \"inf\" is not finite; write a number like 1, -0.5 or 2e-3"),
    (
        "<rotate x=\"1\" angle=\"\"/>",
        "15: could not parse floating point value \"\"; write a number like 1, -0.5 or 2e-3",
    ),
    ("<scale value=\"1 2\"/>", "8: \"value\" has 2 numbers; give 1 or 3, separated by commas or blanks"),
    ("<matrix value=\"1 2 3\"/>", "9: a matrix has 9 or 16 numbers, got 3"),
    (
        "<matrix value=\"1 0 0 0  0 1 0 0  0 0 1 0  1 0 0 1\"/>",
        concat!(
            "9: the last row of the matrix is not 0 0 0 1; ",
            "transforms are affine; numbers go row by row, the translation is the last column"
        ),
    ),
    (
        "<lookat origin=\"0,0,0\" target=\"0,1,0\" up=\"0,-3,0\"/>",
        "1: invalid lookat: up is parallel to the direction; turn up, or leave it out",
    ),
    (
        "<lookat origin=\"1,2,3\" target=\"3,6,9\" up=\"1,2,3.0000000001\"/>",
        "1: invalid lookat: up is parallel to the direction; turn up, or leave it out",
    ),
    (
        "<lookat origin=\"1,2,3\" target=\"1,2,3\"/>",
        "1: invalid lookat: origin and target are the same; move one of them",
    ),
    ("<lookat origin=\"0,0,0\" target=\"1\"/>", "24: expected 3 numbers, got 1; separate them by commas or blanks"),
    ("<lookat origin=\"0,0,0\"/>", "1: missing attribute \"target\" in <lookat>; write <lookat target=\"...\">"),
    (
        "<rgb name=\"a\" value=\"1\"/>",
        "1: unexpected <rgb> inside <transform>; it holds translate, rotate, scale, lookat, matrix",
    ),
    (
        "<lookAt origin=\"0,0,0\" target=\"0,0,1\"/>",
        "1: unexpected <lookAt> inside <transform>; did you mean <lookat>?",
    ),
    (
        "<translate x=\"1\"><scale/></translate>",
        "18: <scale> cannot stand inside <translate>; <translate> holds no elements",
    ),
    ("<translate w=\"1\"/>", "12: unexpected attribute \"w\" in <translate>; <translate> may have value, x, y, z"),
];

#[test]
fn refused_operations() {
    for (operation, expected) in REFUSED_OPERATIONS {
        let message = refused_in_shape(&format!("<transform name=\"t\">\n{operation}</transform>"));
        assert_eq!(message, format!("s.xml:4:{expected}"));
    }
}

#[test]
fn refused_results() {
    let singular = "the transform is singular; it must not flatten space; no scale may be 0";
    let infinite = "the transform is not finite; use smaller numbers";
    let cases = [
        ("<scale x=\"0\"/>", singular),
        ("<scale value=\"1 1 1e-320\"/>", singular),
        ("<matrix value=\"1 2 3 4 5 6 7 8 9\"/>", singular),
        // Its determinant is rounded to 7e-18.
        ("<matrix value=\".1 .2 .3 .4 .5 .6 .7 .8 .9\"/>", singular),
        ("<scale value=\"1e200\"/><scale value=\"1e200\"/>", infinite),
    ];
    for (operations, expected) in cases {
        let message = refused_in_shape(&format!("<transform name=\"t\">{operations}</transform>"));
        assert_eq!(message, format!("s.xml:3:1: {expected}"), "{operations}");
    }
    // A small scale with unequal factors is not singular.
    map("<scale value=\"1e-30 1e-30 1e-60\"/>");
    map("<rotate x=\"0.6\" y=\"0.8\" angle=\"40\"/><scale z=\"1e-7\"/>");
}

proptest! {
    /// Every accepted rotation has no scale and no shear, and fixes its axis.
    #[test]
    fn rotations_are_orthonormal(axis in prop::array::uniform3(-1.0..1.0f64), angle in -720.0..720.0f64) {
        prop_assume!(DVec3::from(axis).length() > 0.1);
        let [x, y, z] = DVec3::from(axis).normalize().to_array();
        let found = map(&format!("<rotate x=\"{x}\" y=\"{y}\" z=\"{z}\" angle=\"{angle}\"/>")).matrix3;
        prop_assert!((found * found.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-14));
        prop_assert!((found * DVec3::new(x, y, z) - DVec3::new(x, y, z)).length() < 1e-14);
        prop_assert!((found.determinant() - 1.0).abs() < 1e-14);
    }

    /// Right-handed with the target on +z.
    #[test]
    fn cameras_are_orthonormal(
        origin in prop::array::uniform3(-9.0..9.0f64), target in prop::array::uniform3(-9.0..9.0f64),
    ) {
        let (o, t) = (DVec3::from(origin), DVec3::from(target));
        prop_assume!((t - o).length() > 0.1);
        let list = |v: DVec3| format!("{}, {}, {}", v.x, v.y, v.z);
        let found = map(&format!("<lookat origin=\"{}\" target=\"{}\"/>", list(o), list(t)));
        prop_assert!((found.matrix3 * found.matrix3.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-13));
        prop_assert!((found.matrix3.determinant() - 1.0).abs() < 1e-13);
        let ahead = found.transform_point3(DVec3::new(0.0, 0.0, (t - o).length()));
        prop_assert!((ahead - t).length() < 1e-12);
    }
}
