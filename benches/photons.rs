//! Photon maps: the time to build a tree of a million photons, and the number of estimates per second, compared with
//! kiddo alone on the same points. `cargo bench --bench photons`.

use std::{num::NonZeroUsize, path::Path, sync::LazyLock};

use divan::{Bencher, black_box, counter::ItemsCount};
use etendue::{
    math::{Ray, rng::Stream, warp},
    photon::{EmittedPhotons, EstimateParameters, GatherPoint, Kernel, PhotonMap, PhotonMapKind, trace_photons},
    scene::Scene,
    scene_file::xml,
    transport::PathLimits,
};
use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

fn main() {
    divan::main();
}

/// A closed box with a ball in it and a lamp off its centre.
const ROOM: &str = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"/></sensor>
    <shape type="cube"><boolean name="flip_normals" value="true"/><bsdf type="diffuse"/></shape>
    <shape type="sphere"><point name="center" x="0.3" y="-0.2" z="-0.5"/><float name="radius" value="0.4"/></shape>
    <emitter type="point"><point name="position" x="0.2" y="0.1" z="0.7"/></emitter></scene>"#;

/// The scene with a million photons.
struct Setup {
    scene: Scene,
    found: EmittedPhotons,
}

static SETUP: LazyLock<Setup> = LazyLock::new(|| {
    let document = xml::parse(ROOM, "bench", Path::new(""), &[]).expect("the scene is valid XML");
    let scene = Scene::build(&document).expect("the scene is valid");
    let mut found = trace_photons(
        &scene,
        PhotonMapKind::Global,
        520_000,
        PathLimits { max_depth: u32::MAX, rr_depth: 1 },
        [1, 0, 0],
    );
    found.positions.truncate(PHOTONS);
    found.photons.truncate(PHOTONS);
    assert_eq!(found.photons.len(), PHOTONS);
    Setup { scene, found }
});

const PHOTONS: usize = 1_000_000;
const QUERIES: usize = 10_000;
const NEAREST: NonZeroUsize = NonZeroUsize::new(50).expect("fifty is not zero");

/// Points that are visible from the middle of the room, in random order.
fn sites() -> Vec<GatherPoint> {
    let scene = &SETUP.scene;
    let mut sampler = Stream::at(&[2]);
    let mut site = || {
        let ray = Ray::new(DVec3::new(0.0, 0.1, 0.2), warp::square_to_sphere(sampler.next_2d()));
        GatherPoint::new(scene, &scene.intersect(&ray).expect("the room is closed"))
    };
    (0..QUERIES).map(|_| site()).collect()
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn trace_a_million(bencher: Bencher<'_, '_>) {
    let scene = &SETUP.scene;
    bencher.counter(ItemsCount::new(PHOTONS)).bench(|| {
        trace_photons(scene, PhotonMapKind::Global, 500_000, PathLimits { max_depth: u32::MAX, rr_depth: 1 }, [1, 0, 0])
    });
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn build_of_a_million(bencher: Bencher<'_, '_>) {
    let found = &SETUP.found;
    bencher
        .counter(ItemsCount::new(PHOTONS))
        .with_inputs(|| found.photons.clone())
        .bench_values(|photons| PhotonMap::new(&found.positions, photons));
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn build_of_a_million_by_kiddo(bencher: Bencher<'_, '_>) {
    let found = &SETUP.found;
    bencher
        .counter(ItemsCount::new(PHOTONS))
        .bench(|| ImmutableKdTree::<f32, 3>::new_from_slice(&found.positions).expect("a tree of any shape"));
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn fifty_nearest(bencher: Bencher<'_, '_>) {
    let map = PhotonMap::new(&SETUP.found.positions, SETUP.found.photons.clone());
    let sites = sites();
    let lookup = EstimateParameters { nearest: Some(NEAREST), radius: 0.1, kernel: Kernel::Epanechnikov };
    bencher.counter(ItemsCount::new(QUERIES)).bench(|| {
        for site in &sites {
            let mut sum = DVec3::ZERO;
            map.for_each_nearby(site, &lookup, |nearby| sum += nearby.density * nearby.photon.power());
            black_box(sum);
        }
    });
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn fifty_nearest_by_kiddo(bencher: Bencher<'_, '_>) {
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&SETUP.found.positions).expect("a tree of any shape");
    let points: Vec<[f32; 3]> = sites().iter().map(|site| site.p.as_vec3().to_array()).collect();
    bencher.counter(ItemsCount::new(QUERIES)).bench(|| {
        for point in &points {
            black_box(tree.query(point).nearest_n::<SquaredEuclidean<f32>>(NEAREST).within(0.01).execute());
        }
    });
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn all_within(bencher: Bencher<'_, '_>) {
    let map = PhotonMap::new(&SETUP.found.positions, SETUP.found.photons.clone());
    let sites = sites();
    // About fifty photons.
    let lookup = EstimateParameters { nearest: None, radius: 0.02, kernel: Kernel::Epanechnikov };
    bencher.counter(ItemsCount::new(QUERIES)).bench(|| {
        for site in &sites {
            let mut sum = DVec3::ZERO;
            map.for_each_nearby(site, &lookup, |nearby| sum += nearby.density * nearby.photon.power());
            black_box(sum);
        }
    });
}
