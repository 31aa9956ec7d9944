//! Scenes as exporters and tutorials of Mitsuba write them: redundant parameters, references, and objects that nothing
//! uses.

use crate::kit::{self, Folder, INTEGRATOR, SENSOR, SKY, bits, image, run};

const BALL: &str = r#"<shape type="sphere"/>"#;

/// The bits of a scene of an integrator, a sensor, the sky and shapes.
fn bits_of(integrator: &str, sensor: &str, shapes: &str) -> Vec<u32> {
    let image = image(&kit::scene_of(&[integrator, sensor, SKY, shapes]), 4);
    bits(&image).into_iter().flat_map(|(_, values)| values).collect()
}

/// An element with more text after its first tag.
fn with(element: &str, more: &str) -> String {
    element.replacen('>', &format!(">{more}"), 1)
}

#[test]
fn parameters_of_mitsuba_without_effect_change_nothing() {
    let plain = bits_of(INTEGRATOR, SENSOR, BALL);
    for more in [r#"<integer name="samples_per_pass" value="16"/>"#, r#"<integer name="block_size" value="32"/>"#] {
        assert_eq!(bits_of(&with(INTEGRATOR, more), SENSOR, BALL), plain, "{more}");
    }
    for more in [
        r#"<float name="shutter_open" value="0"/><float name="shutter_close" value="1"/>"#,
        r#"<float name="focus_distance" value="1000"/>"#,
        r#"<float name="principal_point_offset_x" value="0"/><float name="principal_point_offset_y" value="-0"/>"#,
    ] {
        assert_eq!(bits_of(INTEGRATOR, &with(SENSOR, more), BALL), plain, "{more}");
    }
    let faces = r#"<boolean name="face_normals" value="true"/>"#;
    let weight = r#"<float name="silhouette_sampling_weight" value="1"/>"#;
    for shape in ["cube", "rectangle"] {
        let of = |more: &str| bits_of(INTEGRATOR, SENSOR, &format!(r#"<shape type="{shape}">{more}</shape>"#));
        assert_eq!(of(""), of(&format!("{faces}{weight}")), "{shape}");
    }
}

#[test]
fn parameters_without_effect_have_a_type() {
    for (element, what) in [
        (
            with(INTEGRATOR, r#"<string name="block_size" value="32"/>"#),
            "\"block_size\" is a string; must be an integer",
        ),
        (with(INTEGRATOR, r#"<boolean name="timeout" value="true"/>"#), "\"timeout\" is a boolean; must be a float"),
    ] {
        let said = run(&mut Folder::with_scene(&kit::scene_of(&[&element, SENSOR, SKY, BALL]))
            .etendue("render scene.xml -o a.exr"));
        assert!(said.code == Some(2) && said.err.contains(what), "{}", said.err);
    }
}

#[test]
fn a_timeout_ends_a_render_unless_a_limit_is_given() {
    let after = |seconds: &str| with(INTEGRATOR, &format!(r#"<float name="timeout" value="{seconds}"/>"#));
    let render = |seconds: &str, options: &str| {
        let folder = Folder::with_scene(&kit::scene_of(&[&after(seconds), SENSOR, SKY, BALL]));
        let said = run(&mut folder.etendue(&format!("render scene.xml -o a.exr --spp 64 {options}")));
        assert_eq!(said.code, Some(0), "{}", said.err);
        said.err
    };
    assert!(render("1e-9", "").contains("the time is up with 1 samples of each pixel"));
    for (seconds, options) in [("0", ""), ("-1", ""), ("1e-9", "--time-limit 1h")] {
        assert!(!render(seconds, options).contains("the time is up"), "{seconds} {options}");
    }
}

#[test]
fn objects_are_declared_anywhere_and_used_by_reference() {
    let film = r#"<film type="hdrfilm" id="f"><integer name="width" value="16"/><integer name="height" value="12"/>
        <ref id="b"/></film><rfilter type="box" id="b"/><sampler type="independent" id="s"/>"#;
    let camera = r#"<transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>"#;
    let sensor = format!(r#"{film}<sensor type="perspective">{camera}<ref id="f"/><ref id="s"/></sensor>"#);
    let lamp = r#"<emitter type="area" id="l"><rgb name="radiance" value="3, 2, 1"/></emitter>"#;
    let inside = format!(r#"<shape type="sphere">{lamp}</shape>"#);
    let outside = format!(r#"{lamp}<shape type="sphere"><ref id="l"/></shape>"#);
    assert_eq!(bits_of(INTEGRATOR, &sensor, &outside), bits_of(INTEGRATOR, SENSOR, &inside));
    let folder = Folder::with_scene(&kit::scene_of(&[INTEGRATOR, &sensor, SKY, &outside]));
    let said = run(&mut folder.etendue("render scene.xml -o a.exr --quiet"));
    assert_eq!((said.code, &*said.err), (Some(0), ""));
}

#[test]
fn objects_that_nothing_uses_change_nothing_and_their_faults_are_warnings() {
    let plain = bits_of(INTEGRATOR, SENSOR, BALL);
    for (unused, what) in [
        (r#"<bsdf type="roughplastic" id="never used"/>"#, "no bsdf is called \"roughplastic\" here"),
        (r#"<bsdf type="twosided"><bsdf type="velvet"/></bsdf>"#, "no bsdf is called \"velvet\""),
        (r#"<texture type="bitmap"><string name="filename" value="gone.png"/></texture>"#, "gone.png: "),
        (r#"<bsdf type="velvet" id="v"/><bsdf type="twosided"><ref id="v"/></bsdf>"#, "no bsdf is called \"velvet\""),
        (r#"<emitter type="area"/>"#, "no shape uses this emitter, so it emits no light"),
        (r#"<medium type="homogeneous"/>"#, ""),
        (r#"<bsdf type="dielectric"><rgb name="absorption" value="1"/></bsdf>"#, ""),
    ] {
        let folder = Folder::with_scene(&kit::scene_of(&[INTEGRATOR, SENSOR, SKY, BALL, unused]));
        let said = run(&mut folder.etendue("render scene.xml -o a.exr --spp 4 --quiet"));
        assert_eq!(said.code, Some(0), "{}", said.err);
        assert!(said.err.contains(what) && said.err.lines().count() == usize::from(!what.is_empty()), "{}", said.err);
        assert_eq!(bits_of(INTEGRATOR, SENSOR, &format!("{BALL}{unused}")), plain, "{unused}");
    }
}

#[test]
fn a_lens_without_an_aperture_is_a_pinhole() {
    let pinhole = image(&kit::scene_of(&[INTEGRATOR, SENSOR, SKY, BALL]), 16);
    let lens = with(SENSOR, r#"<float name="aperture_radius" value="0"/><float name="focus_distance" value="4"/>"#);
    let lens = image(&kit::scene_of(&[INTEGRATOR, &lens.replace("perspective", "thinlens"), SKY, BALL]), 16);
    for name in ["R", "G", "B"] {
        let planes = [&pinhole, &lens].map(|image| image.channel(name).expect("a colour"));
        let differences = planes[0].iter().zip(planes[1]).map(|(a, b)| (a - b).abs());
        assert!(differences.fold(0.0, f32::max) < 1e-5, "{name}");
    }
}

#[test]
fn media_and_metals_have_names_in_any_case() {
    let ball = |bsdf: &str, name: &str, value: &str| {
        let bsdf = format!(r#"<bsdf type="{bsdf}"><string name="{name}" value="{value}"/></bsdf>"#);
        bits_of(INTEGRATOR, SENSOR, &format!(r#"<shape type="sphere">{bsdf}</shape>"#))
    };
    assert_eq!(ball("dielectric", "int_ior", "BK7"), ball("dielectric", "int_ior", "bk7"));
    assert_eq!(ball("dielectric", "int_ior", "Diamond"), ball("dielectric", "int_ior", "diamond"));
    assert_eq!(ball("conductor", "material", "au"), ball("conductor", "material", "Au"));
    // Palik's copper is another table.
    assert_ne!(ball("conductor", "material", "Cu_palik"), ball("conductor", "material", "Cu"));
}
