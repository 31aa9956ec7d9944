//! Renders the caustic of a glass ball under a point light by stochastic progressive photon mapping. No path tracer can
//! render it: a path from the camera through the glass never hits a point.
//!
//! ```text
//! cargo run --release --example sppm_caustic -- FOLDER     # writes FOLDER/caustic.exr and FOLDER/caustic.png
//! ```

use std::{
    io::Write as _,
    path::PathBuf,
    sync::atomic::{AtomicU64, Ordering},
};

use etendue::prelude::*;

const PASSES: u32 = 32;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map_or_else(std::env::temp_dir, PathBuf::from);
    let renderer = Renderer::new(&ball_on_floor()?, &Overrides::default())?;

    // A pass emits photons and gathers them once from every pixel, so each pass adds one sample to each pixel. The
    // callback receives the number of samples that were added, from any thread.
    let crop = renderer.scene.sensor.film.rendered();
    let samples_of_a_pass = u64::from(crop.width) * u64::from(crop.height);
    let done = AtomicU64::new(0);
    let progress = |samples: u64| {
        let before = done.fetch_add(samples, Ordering::Relaxed);
        let passes = (before + samples) / samples_of_a_pass;
        if passes > before / samples_of_a_pass {
            eprint!("\rpass {passes} of {PASSES}");
            // A failure to show the progress is ignored.
            std::io::stderr().flush().unwrap_or_default();
        }
    };
    let film = renderer.render(Replicate { seed: 1, number: 0, samples: PASSES }, &progress);
    eprintln!();

    // The EXR file has linear 32-bit floats, and any text as an attribute of its header.
    let mut image = film.image();
    image.attributes.push(("passes".into(), PASSES.to_string()));
    exr::write(&folder.join("caustic.exr"), &image)?;

    // The PNG file is for viewing: the exposure maps the mean luminance to a middle grey, and brighter values are
    // clipped.
    let pixels = image.rgb(["R", "G", "B"]).ok_or("the image has no channels R, G and B")?;
    let exposure = picture::automatic_exposure(&pixels);
    picture::write_png(&folder.join("caustic.png"), &picture::tone_mapped(crop.width, &pixels, exposure))?;

    let brightest = pixels.iter().map(|pixel| pixel[1]).fold(0.0, f32::max);
    println!("brightest pixel {brightest:.3}, exposure {exposure:+.2} stops");
    println!("wrote caustic.exr and caustic.png to {}", folder.display());
    Ok(())
}

/// A glass ball that hangs above a floor and focuses a point light on it. Lengths are in metres, y points up.
fn ball_on_floor() -> Result<Document, SceneError> {
    let camera = sensor("perspective")
        .with("fov", 35.0)
        .with("to_world", Transform::new().look_at([0.0, 2.5, 4.0], [0.0, 0.3, 0.0], [0.0, 1.0, 0.0]))
        .child(film("hdrfilm").with("width", 160).with("height", 120).child(rfilter("box")));
    let floor = shape("rectangle")
        .with("to_world", Transform::new().scale_uniformly(4.0).rotate([1.0, 0.0, 0.0], -90.0))
        .child(bsdf("diffuse").with("reflectance", 0.6));
    let ball = shape("sphere").with("center", [0.0, 0.9, 0.0]).with("radius", 0.5).child(bsdf("dielectric"));
    scene()
        .child(integrator("sppm").with("photon_count", 200_000).with("max_depth", 8))
        .child(camera)
        .child(floor)
        .child(ball)
        .child(emitter("point").with("position", [1.0, 4.0, 0.0]).with("intensity", 20.0))
        .build()
}
