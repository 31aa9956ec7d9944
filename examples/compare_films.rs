//! Tests whether two renders are estimates of the same image, and shows the three verdicts.
//!
//! ```text
//! cargo run --release --example compare_films
//! ```

use std::error::Error;

use etendue::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let path = room(integrator("path"))?;
    let light = room(integrator("ptracer"))?;
    let direct = room(integrator("path").with("max_depth", 2))?;

    // The test assumes that the two sides are independent, so each render has its own seed.
    let few = render("path, 16 spp", &path, 1, 16)?;
    let many = render("path, 8192 spp", &path, 2, 8192)?;
    let traced_from_light = render("light tracing, 8192 spp", &light, 3, 8192)?;
    let without_indirect = render("path with max_depth 2, 1024 spp", &direct, 4, 1024)?;

    // Few samples have large errors: the test finds no difference, but it could not have detected a bias of half a
    // percent.
    explain(&few, &many)?;
    // Two algorithms that share little code: one follows light from the camera, the other from the lamp.
    explain(&traced_from_light, &many)?;
    // An image without the light that was reflected more than once.
    explain(&without_indirect, &many)
}

/// Renders one side of a comparison. The scatter of the samples gives the variance of each pixel.
fn render(name: &str, scene: &Document, seed: u64, samples: u32) -> Result<ImageEstimate, Box<dyn Error>> {
    let film = Renderer::new(scene, &Overrides::default())?.render(Replicate { seed, number: 0, samples }, &|_| {});
    // An image from a file has its number of samples in the header.
    Ok(ImageEstimate { spp: Some(samples.into()), ..ImageEstimate::of_image(name, &film.image())? })
}

/// Prints the verdict on two images, and the numbers behind it.
fn explain(test: &ImageEstimate, reference: &ImageEstimate) -> Result<(), Box<dyn Error>> {
    let comparison = comparison::with_image(test, reference)?;
    println!("{} against {}: {}", test.name, reference.name, comparison.conclusion());
    let verdict = comparison.verdict.ok_or("the images have no variances to test by")?;
    let percent = |x: Option<f64>| x.map_or("unknown".to_owned(), |x| format!("{:.2} %", 100.0 * x));
    // Three tests share the level: the means of the whole image, the worst tile of 8 x 8 pixels, and all tiles
    // together.
    let (means, worst, all) = (verdict.global.p, verdict.peak.p, verdict.scatter.chi2.p);
    println!("    p-values: means {means:.3}, worst tile {worst:.3}, all tiles {all:.3}");
    println!("    differences of the means: {}", verdict.global.relative_difference.map(percent).join(", "));
    println!("    smallest bias that would have been found: {}", percent(verdict.global.worst_detectable_bias));
    let meaning = match verdict.outcome {
        Outcome::Agrees => "No difference was found, and a bias of half a percent would have been detected.",
        Outcome::Differs => "Not equal: noise alone gives such p-values in at most one comparison of a hundred.",
        Outcome::Undecided { .. } => "No difference was found, but a bias of half a percent could have been missed.",
    };
    println!("    {meaning}\n");
    Ok(())
}

/// A red ball in a white corner of two walls and a floor, all of them diffuse, under a lamp.
fn room(integrator: ObjectBuilder) -> Result<Document, SceneError> {
    let white = || bsdf("diffuse").with("reflectance", 0.7);
    let square = |to_world| shape("rectangle").with("to_world", to_world);
    let wall = || Transform::new().scale_uniformly(2.0);
    let camera = sensor("perspective")
        .with("to_world", Transform::new().look_at([3.0, 1.5, 4.0], [0.0; 3], [0.0, 1.0, 0.0]))
        .child(film("hdrfilm").with("width", 32).with("height", 32).child(rfilter("box")));
    let lamp = square(Transform::new().rotate([1.0, 0.0, 0.0], 90.0).translate([0.0, 2.0, 0.0]));
    scene()
        .child(integrator)
        .child(camera)
        .child(lamp.child(emitter("area").with("radiance", 3.0)))
        .child(square(wall().translate([0.0, 0.0, -2.0])).child(white()))
        .child(square(wall().rotate([0.0, 1.0, 0.0], 90.0).translate([-2.0, 0.0, 0.0])).child(white()))
        .child(square(wall().rotate([1.0, 0.0, 0.0], -90.0).translate([0.0, -2.0, 0.0])).child(white()))
        .child(shape("sphere").child(bsdf("diffuse").with("reflectance", rgb(0.8, 0.3, 0.2))))
        .build()
}
