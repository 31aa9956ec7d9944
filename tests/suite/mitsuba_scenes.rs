//! Scenes as exporters and tutorials of Mitsuba write them: redundant parameters, references, and objects that nothing
//! uses.

use crate::kit::{self, Folder, INTEGRATOR, SENSOR, SKY, bits, image, image_in, run};
use etendue::{math::Rgb, prelude::*, provenance, scene_file::xml, spectrum};

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

/// The image of a lamp with this radiance over a ball with this BSDF, in a folder with a spectrum file.
fn lit_ball(radiance: &str, bsdf: &str) -> Image {
    let lamp = format!(
        r#"<shape type="sphere"><point name="center" x="1" y="2" z="4"/><float name="radius" value="0.5"/>
           <emitter type="area">{radiance}</emitter></shape>"#
    );
    let ball = format!(r#"<shape type="sphere">{bsdf}</shape>"#);
    let folder = Folder::with_scene(&kit::scene_of(&[INTEGRATOR, SENSOR, &lamp, &ball]));
    folder.write("a.spd", "# wavelength and value\n400 0.1\n500 0.6\n600 0.3\n700 0.9\n");
    image_in(&folder, 16)
}

/// The greatest difference of two images, relative to the mean of the second.
fn difference(one: &Image, other: &Image) -> f64 {
    let differences = ["R", "G", "B"].map(|name| {
        let [one, other] = [one, other].map(|image| image.channel(name).expect("a colour"));
        let mean = other.iter().map(|&x| f64::from(x)).sum::<f64>() / other.len() as f64;
        one.iter().zip(other).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max) / mean
    });
    differences.into_iter().fold(0.0, f64::max)
}

const PAIRS: &str = r#"value="400:0.1 500:0.6 600:0.3 700:0.9"/>"#;
const WHITE: &str = r#"<rgb name="radiance" value="8"/>"#;
const PAINT: &str = r#"<bsdf type="diffuse"/>"#;

/// A spectrum in every form, as the parameter of this name.
fn forms(name: &str) -> [String; 4] {
    [
        format!(r#"<spectrum name="{name}" {PAIRS}"#),
        format!(r#"<spectrum name="{name}" filename="a.spd"/>"#),
        format!(
            r#"<spectrum type="irregular" name="{name}"><string name="wavelengths" value="400, 500, 600, 700"/>
               <string name="values" value="0.1, 0.6, 0.3, 0.9"/></spectrum>"#
        ),
        format!(
            r#"<spectrum type="regular" name="{name}"><float name="wavelength_min" value="400"/>
               <float name="wavelength_max" value="700"/><string name="values" value="0.1, 0.6, 0.3, 0.9"/></spectrum>"#
        ),
    ]
}

#[test]
fn spectra_of_reflectances_and_lights_are_the_colours_of_mitsuba() {
    let paint = |reflectance: &str| format!(r#"<bsdf type="diffuse">{reflectance}</bsdf>"#);
    // Mitsuba 3.9.1, as in the law spectrum/rgb: a reflectance is weighted by D65, a light is not.
    let rgb = |name: &str, value: &str| format!(r#"<rgb name="{name}" value="{value}"/>"#);
    let painted = lit_ball(WHITE, &paint(&rgb("reflectance", "0.3380708, 0.4875679, 0.3586755")));
    let lit = lit_ball(&rgb("radiance", "0.4329627, 0.4593427, 0.3177919"), PAINT);
    for [reflectance, radiance] in forms("reflectance").into_iter().zip(forms("radiance")).map(<[_; 2]>::from) {
        assert!(difference(&lit_ball(WHITE, &paint(&reflectance)), &painted) < 1e-4, "{reflectance}");
        assert!(difference(&lit_ball(&radiance, PAINT), &lit) < 1e-4, "{radiance}");
    }
    let constant = r#"<spectrum name="radiance" value="2"/>"#;
    let tinted = lit_ball(&rgb("radiance", "2.409588, 1.896582, 1.817832"), PAINT);
    assert!(difference(&lit_ball(constant, PAINT), &tinted) < 1e-4);
    let grey = r#"<spectrum type="uniform" name="radiance"><float name="value" value="2"/></spectrum>"#;
    assert!(difference(&lit_ball(grey, PAINT), &lit_ball(&rgb("radiance", "2"), PAINT)) < 1e-6);
}

#[test]
fn spectra_of_conductors_and_black_bodies() {
    let metal = |eta: &str, k: &str| format!(r#"<bsdf type="conductor">{eta}{k}</bsdf>"#);
    let spectra = metal(
        r#"<spectrum name="eta" value="400:0.2 500:0.9 700:0.3"/>"#,
        r#"<spectrum name="k" value="400:3 700:5"/>"#,
    );
    let colours = metal(
        r#"<rgb name="eta" value="0.4422433, 0.8094388, 0.5561301"/>"#,
        r#"<rgb name="k" value="4.594323, 3.95218, 3.256811"/>"#,
    );
    assert!(difference(&lit_ball(WHITE, &spectra), &lit_ball(WHITE, &colours)) < 1e-4);
    let black_body =
        r#"<spectrum type="blackbody" name="radiance"><float name="temperature" value="3000"/></spectrum>"#;
    let Rgb { x, y, z } = spectrum::blackbody_to_rgb(3000.0, spectrum::WAVELENGTHS, spectrum::Quantity::Light);
    let colour = format!(r#"<rgb name="radiance" value="{x}, {y}, {z}"/>"#);
    assert!(difference(&lit_ball(black_body, PAINT), &lit_ball(&colour, PAINT)) < 1e-6 && x > 2.0 * z);
}

#[test]
fn spectrum_files_are_part_of_a_scene_and_faults_in_them_have_a_place() {
    let paint =
        r#"<shape type="sphere"><bsdf type="diffuse"><spectrum name="reflectance" filename="b.spd"/></bsdf></shape>"#;
    let folder = Folder::with_scene(&kit::scene(paint));
    let hash = |content: &str| {
        folder.write("b.spd", content);
        provenance::scene_hash(&xml::read(&folder.path("scene.xml"), &[]).expect("a scene"))
            .expect("the files are there")
    };
    assert_ne!(hash("400 0.1\n700 0.2\n"), hash("400 0.1\n700 0.3\n"));
    for (content, what) in [
        ("400 0.1\n500\n", "b.spd: line 2: is not a wavelength and a value"),
        ("400 0.1\n", "b.spd: a spectrum needs 2 pairs of wavelength and value, got 1"),
        ("500 0.1\n400 0.1\n", "b.spd: the wavelength 400 does not rise above 500"),
    ] {
        folder.write("b.spd", content);
        let said = run(&mut folder.etendue("render scene.xml -o a.exr"));
        assert!(said.code == Some(2) && said.err.contains(what) && said.err.lines().count() == 1, "{}", said.err);
    }
}

#[test]
fn environments_that_are_no_maps_are_refused() {
    let map = |more: &str| format!(r#"<emitter type="envmap"><string name="filename" value="m.exr"/>{more}</emitter>"#);
    let flat = r#"<transform name="to_world"><scale x="1" y="0" z="1"/></transform>"#;
    for ([width, height], value, more, what) in [
        ([1, 4], 1.0, "", "the image has 1 x 4 texels; an environment needs at least 2 x 3"),
        ([4, 4], -1.0, "", "the image has a value that is negative, infinite or NaN"),
        ([4, 4], f32::INFINITY, "", "the image has a value that is negative, infinite or NaN"),
        ([4, 4], 1.0, flat, "the transform is singular"),
    ] {
        let folder = Folder::with_scene(&kit::scene_of(&[INTEGRATOR, SENSOR, BALL, &map(more)]));
        ::exr::prelude::write_rgb_file(folder.path("m.exr"), width, height, |_, _| (1.0_f32, 1.0_f32, value))
            .expect("a file");
        let said = run(&mut folder.etendue("render scene.xml -o a.exr"));
        assert!(said.code == Some(2) && said.err.contains(what) && said.err.lines().count() == 1, "{}", said.err);
    }
}
