//! The first hit of a ray with a scene is the nearest hit with any of its shapes, each intersected alone.

use etendue::{math::Ray, scene::Scene, scene_file::xml};
use glam::DVec3;
use proptest::{collection::vec, prelude::*, sample::select};

use crate::kit;

fn built(shapes: &str) -> Scene {
    let text = kit::scene_of(&[kit::SENSOR, shapes]);
    let document = xml::parse(&text, "scene.xml", kit::root(), &[]).unwrap_or_else(|error| panic!("{error}"));
    Scene::build(&document).unwrap_or_else(|error| panic!("{error}"))
}

/// A shape under an affine map that is not too close to a singular one.
fn shape() -> impl Strategy<Value = String> {
    let kinds = select(vec!["sphere", "rectangle", "cube", "disk", "cylinder"]);
    let linear = vec(-1.0_f64..1.0, 9)
        .prop_filter("close to singular", |m| glam::DMat3::from_cols_slice(m).determinant().abs() > 1e-3);
    (kinds, linear, vec(-3.0_f64..3.0, 3), any::<bool>()).prop_map(|(kind, m, t, flip)| {
        format!(
            r#"<shape type="{kind}"><boolean name="flip_normals" value="{flip}"/><transform name="to_world">
            <matrix value="{} {} {} {}  {} {} {} {}  {} {} {} {}  0 0 0 1"/></transform></shape>"#,
            m[0], m[1], m[2], t[0], m[3], m[4], m[5], t[1], m[6], m[7], m[8], t[2]
        )
    })
}

/// A segment or a half-line from around the scene, or from inside, through its middle. Some rays are parallel to the
/// axes, where slabs are parallel, and directions do not have unit length.
fn ray() -> impl Strategy<Value = Ray> {
    let point = |reach: f64| (-reach..reach, -reach..reach, -reach..reach).prop_map(DVec3::from);
    let length = select(vec![f64::INFINITY, 1.0, 0.5]);
    (point(8.0), point(3.0), length, 0..6_usize).prop_map(|(origin, target, t_max, axis)| {
        let along = [DVec3::X, DVec3::NEG_Y, DVec3::Z].get(axis).map(|axis| 7.0 * *axis);
        Ray { t_max, ..Ray::new(origin, along.unwrap_or(target - origin)) }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_scene_is_met_where_its_nearest_shape_is(shapes in vec(shape(), 1..24), rays in vec(ray(), 256)) {
        let whole = built(&shapes.concat());
        let alone: Vec<Scene> = shapes.iter().map(|shape| built(shape)).collect();
        for ray in rays {
            let hits = alone.iter().map(|scene| scene.intersect(&ray));
            let nearest = hits.flatten().min_by(|a, b| a.t.total_cmp(&b.t));
            let found = whole.intersect(&ray);
            prop_assert_eq!(found.map(|v| v.t), nearest.map(|v| v.t), "{:?}", ray);
            prop_assert_eq!(found.map(|v| v.surface), nearest.map(|v| v.surface), "{:?}", ray);
            prop_assert_eq!(whole.occluded(&ray), nearest.is_some(), "{:?}", ray);
        }
    }
}
