//! The image depends on the scene, the seed and the number of samples, and on nothing else.

use etendue::film::{Image, exr};

use crate::kit::{self, Folder, bits, busy, pixel};

/// Renders a scene in its own folder.
fn rendered(folder: &Folder, scene: &std::path::Path, options: &str) -> Image {
    let mut command = folder.etendue("render");
    command.arg(scene).args(["-o", "image.exr"]).args(options.split_whitespace()).assert().success();
    exr::read(&folder.path("image.exr")).unwrap()
}

#[test]
fn threads_make_no_difference() {
    let folder = Folder::new();
    for scene in kit::scenes() {
        let one = rendered(&folder, &scene, "--spp 2 --threads 1");
        for threads in [2, 7] {
            let other = rendered(&folder, &scene, &format!("--spp 2 --threads {threads}"));
            assert!(bits(&one) == bits(&other), "{} differs with {threads} threads", scene.display());
        }
    }
}

const SAMPLERS: [&str; 3] = ["independent", "stratified", "ldsampler"];

#[test]
fn seeds_make_a_difference_and_threads_do_not_with_every_sampler() {
    for sampler in SAMPLERS {
        let folder = Folder::with_scene(&busy(sampler, ""));
        let image = |options: &str| folder.render(&format!("--spp 9 {options}"));
        let one = image("--threads 1 --seed 5");
        assert!(bits(&one) == bits(&image("--threads 7 --seed 5")), "{sampler}");
        assert!(bits(&one) != bits(&image("--threads 1 --seed 6")), "{sampler}");
        assert!(bits(&image("")) == bits(&image("--seed 0")), "{sampler}: the seed is 0 unless something else is said");
    }
}

/// Integrators that trace light, with parameters whose sums depend on the order unless they are exact.
const FOLLOWING_LIGHT: [(&str, &str); 11] = [
    ("ptracer", ""),
    ("photonmapper", "direct=traced indirect=final_gather"),
    ("photonmapper", "direct=traced indirect=map"),
    ("photonmapper", "direct=map indirect=final_gather gather_importance=true"),
    ("photonmapper", "direct=map indirect=map lookup_size=0"),
    // Enough photons that several threads build the tree.
    ("photonmapper", "direct=map indirect=map global_photons=150000"),
    ("photonmapper", "direct=shadow_photons indirect=final_gather gather_samples=2"),
    ("sppm", "photon_count=9000 radius_schedule=per_pixel"),
    ("sppm", "photon_count=9000 radius_schedule=error_driven initial_radius=0.3"),
    ("sppm", "photon_count=9000 radius_schedule=per_pass path_classes=true"),
    // Enough photons that several threads build the grid.
    ("sppm", "photon_count=150000 radius_schedule=per_pixel direct=map kernel=cone"),
];

#[test]
fn threads_make_no_difference_to_light_that_is_followed() {
    let crop = r#"<integer name="crop_offset_x" value="5"/><integer name="crop_offset_y" value="3"/>
        <integer name="crop_width" value="13"/><integer name="crop_height" value="11"/>"#;
    for (name, params) in FOLLOWING_LIGHT {
        for film in [r#"<rfilter type="box"/>"#.to_owned(), format!(r#"<rfilter type="gaussian"/>{crop}"#)] {
            let folder = Folder::with_scene(&busy("independent", &film));
            let params: String = params.split_whitespace().map(|param| format!(" --param {param}")).collect();
            let few =
                if name == "photonmapper" { " --param global_photons=9000 --param caustic_photons=9000" } else { "" };
            let image = |options: &str| folder.render(&format!("--spp 3 --integrator {name}{few}{params} {options}"));
            let one = image("--threads 1 --seed 5");
            for threads in [2, 7] {
                assert!(
                    bits(&one) == bits(&image(&format!("--threads {threads} --seed 5"))),
                    "{name}{params} {threads}"
                );
            }
            assert!(bits(&one) != bits(&image("--threads 2 --seed 6")), "{name}{params}");
        }
    }
}

/// Replays all samples of a pixel through the command line.
fn replayed(folder: &Folder, more: &str, (x, y): (u32, u32), samples: u32) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for sample in 0..samples {
        let options = format!("render scene.xml --spp {samples} --seed 3 --replay {x},{y},{sample} {more}");
        let said = kit::run(&mut folder.etendue(&options));
        assert_eq!(said.code, Some(0), "{}", said.err);
        let numbers: Vec<f64> = said.out.split_whitespace().map(|number| number.parse().unwrap()).collect();
        sum.iter_mut().zip(numbers).for_each(|(sum, number)| *sum += number);
    }
    sum.map(|sum| sum / f64::from(samples))
}

#[test]
fn a_pixel_is_the_mean_of_its_replayed_samples() {
    let crop = r#"<integer name="crop_offset_x" value="5"/><integer name="crop_offset_y" value="3"/>
        <integer name="crop_width" value="19"/><integer name="crop_height" value="17"/>"#;
    for sampler in SAMPLERS {
        let folder = Folder::with_scene(&busy(sampler, crop));
        let image = folder.render("--spp 4 --seed 3");
        for at in [(0, 0), (10, 8), (18, 16)] {
            assert_mean(pixel(&image, at.0, at.1), replayed(&folder, "", at, 4), &format!("{sampler} {at:?}"));
        }
    }
}

/// Checks that a pixel is the mean of its samples. The image is rounded to f32, the sum here to f64.
fn assert_mean(of_image: [f32; 3], of_samples: [f64; 3], name: &str) {
    for (of_image, of_samples) in of_image.into_iter().zip(of_samples) {
        let error = (f64::from(of_image) - of_samples).abs();
        assert!(error <= f64::from(f32::EPSILON) * of_samples, "{name}: {of_image} {of_samples}");
    }
}

const SCHEDULES: [&str; 3] = ["per_pixel", "error_driven", "per_pass"];

#[test]
fn a_pixel_of_progressive_photon_mapping_is_the_mean_of_its_replayed_passes() {
    let crop = r#"<integer name="crop_offset_x" value="5"/><integer name="crop_offset_y" value="3"/>
        <integer name="crop_width" value="19"/><integer name="crop_height" value="17"/>"#;
    for (schedule, sampler) in SCHEDULES.into_iter().zip(SAMPLERS) {
        let folder = Folder::with_scene(&busy(sampler, crop));
        let more = format!(
            "--integrator sppm --param photon_count=2000 --param initial_radius=0.4 --param radius_schedule={schedule}"
        );
        let image = folder.render(&format!("--spp 4 --seed 3 {more}"));
        for at in [(0, 0), (10, 8)] {
            assert_mean(pixel(&image, at.0, at.1), replayed(&folder, &more, at, 4), &format!("{schedule} {at:?}"));
        }
    }
}

#[test]
fn progressive_photon_mapping_takes_its_passes_from_every_sampler() {
    for schedule in SCHEDULES {
        let image = |sampler: &str, options: &str| {
            let more =
                format!("--integrator sppm --param photon_count=2000 --param radius_schedule={schedule} --seed 5");
            Folder::with_scene(&busy(sampler, "")).render(&format!("{more} {options}"))
        };
        let images = SAMPLERS.map(|sampler| {
            let one = image(sampler, "--spp 4 --threads 1");
            assert!(bits(&one) == bits(&image(sampler, "--spp 4 --threads 7")), "{schedule} {sampler}");
            // Passes are samples; both options set their number.
            assert!(bits(&one) == bits(&image(sampler, "--param max_passes=4")), "{schedule} {sampler}");
            one
        });
        assert!(bits(&images[0]) != bits(&images[1]) && bits(&images[0]) != bits(&images[2]), "{schedule}");
    }
}

/// The part of an image.
fn cut(image: &Image, x: u32, y: u32, width: u32, height: u32) -> Vec<(&str, Vec<u32>)> {
    let row = |y: u32| (x..x + width).map(move |x| (y * image.crop.width + x) as usize);
    let indices: Vec<usize> = (y..y + height).flat_map(row).collect();
    let part = |(name, all): (_, Vec<u32>)| (name, indices.iter().map(|&i| all[i]).collect());
    bits(image).into_iter().map(part).collect()
}

#[test]
fn a_crop_shows_the_pixels_of_the_whole() {
    // A filter that reaches beyond the border of the crop is truncated there, unless the border is sampled.
    let filters = [
        r#"<rfilter type="box"/>"#,
        r#"<rfilter type="gaussian"/><boolean name="sample_border" value="true"/>"#,
        r#"<rfilter type="tent"/><boolean name="sample_border" value="true"/>"#,
    ];
    let crop = r#"<integer name="crop_offset_x" value="7"/><integer name="crop_offset_y" value="4"/>
        <integer name="crop_width" value="10"/><integer name="crop_height" value="9"/>"#;
    for sampler in SAMPLERS {
        for filter in filters {
            let whole = kit::image(&busy(sampler, filter), 4);
            let part = kit::image(&busy(sampler, &format!("{filter}{crop}")), 4);
            assert!(cut(&whole, 7, 4, 10, 9) == bits(&part), "{sampler} {filter}");
        }
    }
}
