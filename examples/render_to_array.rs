//! Builds a scene in code, or reads one from a file, and renders it to an array of floats.
//!
//! ```text
//! cargo run --release --example render_to_array
//! cargo run --release --example render_to_array -- assets/scenes/cornell-path.xml
//! ```

use std::path::Path;

use etendue::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A file and code give the same kind of document. The second argument of `read` defines the file's $parameters.
    let document = match std::env::args().nth(1) {
        Some(file) => xml::read(Path::new(&file), &[])?,
        None => room()?,
    };
    let renderer = Renderer::new(&document, &Overrides::default())?;
    for warning in renderer.warnings() {
        eprintln!("warning: {warning}");
    }

    // The image is a function of the scene and of these three numbers, on any number of threads.
    let replicate = Replicate { seed: 1, number: 0, samples: renderer.samples() };
    let film = renderer.render(replicate, &|_| {});

    // One [red, green, blue] for each pixel, in linear Rec. 709, row by row from the top left.
    let pixels = film.means();
    let (height, width) = (film.crop.height as usize, film.crop.width as usize);
    let sum = pixels.iter().fold([0.0; 3], |sum, pixel| [0, 1, 2].map(|c| sum[c] + pixel[c]));
    let [red, green, blue] = sum.map(|channel| channel / pixels.len() as f64);
    let centre = pixels[height / 2 * width + width / 2];
    println!("shape ({height}, {width}, 3), {} samples per pixel", replicate.samples);
    println!("mean {red:.4} {green:.4} {blue:.4}, relative error {:.3}", film.relative_error());
    println!("pixel at row {}, column {}: {centre:.4?}", height / 2, width / 2);

    // Other libraries take a flat array of this shape, such as numpy or ndarray.
    let array: Vec<f32> = pixels.iter().flatten().map(|&x| x as f32).collect();
    assert_eq!(array.len(), height * width * 3);
    Ok(())
}

/// A red and a glass ball on a floor, under a square lamp. Lengths are in metres, y points up.
fn room() -> Result<Document, SceneError> {
    let camera = sensor("perspective")
        .with("fov", 40.0)
        .with("to_world", Transform::new().look_at([0.0, 1.5, 5.0], [0.0, 0.5, 0.0], [0.0, 1.0, 0.0]))
        .child(film("hdrfilm").with("width", 96).with("height", 64).child(rfilter("box")))
        .child(sampler("independent").with("sample_count", 64));
    // The unit square faces +z: turned by 90 degrees about x it faces downwards.
    let lamp = shape("rectangle")
        .with(
            "to_world",
            Transform::new().scale_uniformly(0.7).rotate([1.0, 0.0, 0.0], 90.0).translate([0.0, 3.0, 0.0]),
        )
        .child(emitter("area").with("radiance", rgb(8.0, 7.5, 7.0)));
    // Vertices and triangles; the triangles face upwards, where their corners are seen anticlockwise.
    let corners = vec![[-3.0, 0.0, -3.0], [-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0]];
    let floor = shape("mesh").with("arrays", MeshArrays::new(corners, vec![[0, 1, 2], [0, 2, 3]]));
    let ball = |x: f64, material: ObjectBuilder| {
        shape("sphere").with("center", [x, 0.6, 0.0]).with("radius", 0.6).child(material)
    };
    scene()
        .child(integrator("path").with("max_depth", 8))
        .child(camera)
        .child(lamp)
        .child(floor.child(bsdf("diffuse").with("reflectance", 0.7)))
        .child(ball(-0.8, bsdf("diffuse").with("reflectance", rgb(0.8, 0.1, 0.1))))
        .child(ball(0.8, bsdf("dielectric").with("int_ior", 1.5)))
        .build()
}
