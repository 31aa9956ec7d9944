use super::super::draws::Draws;
use super::super::{Ks, binomial};
use super::*;

/// A synthetic renderer: 8 × 8 tiles, smooth radiance, partly correlated channels.
#[derive(Clone, Copy)]
struct Scene {
    /// A random variate of mean 0 for each pixel.
    noise: fn(&mut Draws) -> f64,
    /// The relative standard deviation of a pixel of a sub-render.
    deviation: f64,
    pixels_per_tile: u32,
    /// Factor on every radiance.
    gain: f64,
    /// Factor on tile 27.
    tile_gain: f64,
}

const GAUSSIAN: Scene = Scene { noise: Draws::normal, deviation: 0.3, pixels_per_tile: 4, gain: 1.0, tile_gain: 1.0 };
const EXPONENTIAL: Scene = Scene { noise: |d| d.exponential() - 1.0, ..GAUSSIAN };
const LOGNORMAL: Scene = Scene { noise: |d| d.lognormal() - 1.0, ..GAUSSIAN };

impl Scene {
    fn render(&self, batches: usize, draws: &mut Draws) -> TiledMeans {
        let tile_mean = |tile: usize, draws: &mut Draws| {
            let mut noise = || -> f64 { (0..self.pixels_per_tile).map(|_| (self.noise)(draws)).sum() };
            let (common, own) = (noise(), noise());
            let scale = self.deviation / f64::from(self.pixels_per_tile);
            let gain = if tile == 27 { self.gain * self.tile_gain } else { self.gain };
            std::array::from_fn(|c| {
                let radiance = 0.1 + 0.02 * tile as f64 + 0.1 * c as f64;
                gain * radiance * (1.0 + scale * (common + (c as f64 - 1.0) * own))
            })
        };
        let mut batch = || (0..64).map(|tile| tile_mean(tile, draws)).collect();
        let batches: Vec<Vec<[f64; 3]>> = (0..batches).map(|_| batch()).collect();
        TiledMeans::from_batches(8, 8, &batches, &[self.pixels_per_tile; 64]).unwrap()
    }
}

fn compare(ours: &TiledMeans, reference: &TiledMeans) -> Verdict {
    Verdict::compare(ours, reference, None, &VerdictConfig::default()).unwrap()
}

/// `count` verdicts of `ours` against `reference`, each with its number of sub-renders.
fn verdicts(seed: u64, count: usize, ours: (Scene, usize), reference: (Scene, usize)) -> Vec<Verdict> {
    let mut draws = Draws::new(seed);
    let mut one = || {
        let ours = ours.0.render(ours.1, &mut draws);
        compare(&ours, &reference.0.render(reference.1, &mut draws))
    };
    (0..count).map(|_| one()).collect()
}

fn rejections(verdicts: &[Verdict]) -> u64 {
    verdicts.iter().filter(|verdict| verdict.outcome == Outcome::Differs).count() as u64
}

fn one_tile(ours: Estimate, reference: Estimate) -> (TiledMeans, TiledMeans) {
    let side = |estimate| TiledMeans {
        columns: 1,
        rows: 1,
        tiles: vec![Some([estimate; 3])],
        luminance: vec![Some(estimate)],
        global: [estimate; 3],
    };
    (side(ours), side(reference))
}

#[test]
fn equal_renders_are_rejected_no_more_often_than_alpha() {
    let scenes = [("gaussian", GAUSSIAN), ("exponential", EXPONENTIAL), ("log-normal", LOGNORMAL)];
    for (seed, (name, scene)) in (10..).zip(scenes) {
        // With four sub-renders the power is low, but the level must hold.
        for batches in [4, 16, 32] {
            let found = rejections(&verdicts(seed, 400, (scene, batches), (scene, batches)));
            println!("A/A {name}, K = {batches}: {found} of 400");
            assert!(binomial::at_least_p(found, 400, 0.01) > 0.005, "{name}, K = {batches}: {found} of 400");
        }
    }
}

#[test]
fn a_different_estimator_of_the_same_image_is_not_rejected() {
    // Our side has twice the deviation and skewed noise, as in a comparison of a light tracer with a path tracer.
    let noisy = Scene { deviation: 0.6, pixels_per_tile: 16, ..EXPONENTIAL };
    let found = rejections(&verdicts(20, 400, (noisy, 32), (GAUSSIAN, 16)));
    println!("A/B: {found} of 400");
    assert!(binomial::at_least_p(found, 400, 0.01) > 0.005, "{found} of 400");
}

#[test]
fn p_values_are_uniform_if_the_images_are_equal() {
    let verdicts = verdicts(21, 600, (GAUSSIAN, 32), (GAUSSIAN, 32));
    let scatter: Vec<f64> = verdicts.iter().map(|v| v.scatter.chi2.p).collect();
    let tiles: Vec<f64> = verdicts.iter().flat_map(|v| v.tiles.iter().flatten().map(|tile| tile.luminance.p)).collect();
    for (name, p) in [("scatter", scatter), ("tile luminances", tiles)] {
        let ks = Ks::one_sample(&p, |p| p);
        println!("uniformity of {name}: {ks:?}");
        assert!(ks.p > 0.01, "{name}: {ks:?}");
    }
    // The channels are correlated, so Šidák's correction is conservative for these two: a small p is at most as
    // frequent as stated.
    let global: Vec<f64> = verdicts.iter().map(|v| v.global.p).collect();
    let peak: Vec<f64> = verdicts.iter().map(|v| v.peak.p).collect();
    for (name, p) in [("global", global), ("peak", peak)] {
        for level in [0.01, 0.1, 0.3] {
            let below = p.iter().filter(|p| **p <= level).count() as u64;
            assert!(binomial::at_least_p(below, 600, level) > 0.002, "{name}: {below} below {level}");
        }
    }
}

#[test]
fn a_bias_of_the_target_size_is_detected_with_the_configured_power() {
    // The deviation is chosen so that half a percent is exactly the detectable bias.
    let (mut draws, config) = (Draws::new(22), VerdictConfig::default());
    let coarse = Scene { pixels_per_tile: 1, ..LOGNORMAL };
    let (ours, reference) = (coarse.render(1000, &mut draws), coarse.render(1000, &mut draws));
    let detectable = compare(&ours, &reference).global.worst_detectable_bias.unwrap() * 10.0_f64.sqrt();
    let scene = Scene { deviation: coarse.deviation * config.target_bias / detectable, ..coarse };
    let biased = Scene { gain: 1.0 + config.target_bias, ..scene };
    let verdicts = verdicts(23, 200, (biased, 100), (scene, 100));
    let worst: f64 = verdicts.iter().map(|v| v.global.worst_detectable_bias.unwrap()).sum::<f64>() / 200.0;
    assert!((worst / config.target_bias - 1.0).abs() < 0.1, "{worst}");
    let found = rejections(&verdicts);
    println!("+0.5 %: {found} of 200, detectable {worst}");
    assert!(binomial::at_most_p(found, 200, config.power) > 0.005, "{found} of 200");

    // The noise is the same for all pairs, so the red channel is always the worst. It alone also detects the bias.
    let red = |v: &&Verdict| v.global.channels[0].p <= multiple::sidak_level(v.global.level, 3);
    let found = verdicts.iter().filter(red).count() as u64;
    println!("+0.5 %, red alone: {found} of 200");
    assert!(binomial::at_most_p(found, 200, config.power) > 0.005, "{found} of 200");
}

#[test]
fn a_brighter_tile_is_found_and_located() {
    // Tile means have a standard error of 0.6 % on each side: 5 % is six standard errors of the difference.
    let scene = Scene { deviation: 0.02, ..EXPONENTIAL };
    let bright = Scene { tile_gain: 1.05, ..scene };
    let verdicts = verdicts(24, 100, (bright, 16), (scene, 16));
    let peak = |v: &&Verdict| v.peak.p <= v.peak.level && v.peak.tile_and_channel.unwrap().0 == 27;
    let found = verdicts.iter().filter(peak).count();
    let located = verdicts.iter().filter(|v| v.localised.contains(&27)).count();
    println!("8x8 tile x 1.05: {found} of 100 by the peak, {located} located");
    assert!(found >= 97 && located >= 97, "{found} {located}");
    assert!(verdicts.iter().filter(|v| v.localised.len() > 1).count() <= 10);
}

#[test]
fn errors_that_cancel_are_found_by_the_scatter() {
    // Every tile is off by ±2 standard errors: no single tile is significant, and the mean is correct.
    let estimate = |mean| Estimate { mean, variance_of_mean: 1e-4, dof: 31.0 };
    let side = |means: &dyn Fn(usize) -> f64| TiledMeans {
        columns: 8,
        rows: 8,
        tiles: (0..64).map(|tile| Some([estimate(means(tile)); 3])).collect(),
        luminance: (0..64).map(|tile| Some(estimate(means(tile)))).collect(),
        global: [Estimate { mean: 1.0, variance_of_mean: 1e-6, dof: 31.0 }; 3],
    };
    let offset = 2.0 * 2e-4_f64.sqrt();
    let verdict = compare(&side(&|tile| if tile % 2 == 0 { 1.0 + offset } else { 1.0 - offset }), &side(&|_| 1.0));
    assert_eq!(verdict.outcome, Outcome::Differs);
    assert!(verdict.global.p > 0.9 && verdict.peak.p > verdict.peak.level);
    assert!(verdict.scatter.chi2.p < 1e-8, "{:?}", verdict.scatter);
    assert_eq!(verdict.scatter.chi2.dof, 64.0);
}

#[test]
fn a_z_score_has_the_p_of_its_t_value() {
    let known = |mean, dof| Estimate { mean, variance_of_mean: 0.5, dof };
    let (ours, reference) = one_tile(known(1.0, 3.0), known(4.0, 3.0));
    let tile = compare(&ours, &reference).tiles[0].unwrap();
    assert_eq!((tile.luminance.t, tile.luminance.dof), (-3.0, 6.0));
    // scipy 1.17.1: norm.isf(t.sf(3, 6)).
    assert!((tile.z + 2.256_998_047_758_583).abs() < 1e-9, "{}", tile.z);
}

#[test]
fn without_power_there_is_no_agreement() {
    let (mut draws, scene) = (Draws::new(25), Scene { deviation: 0.05, ..GAUSSIAN });
    let (ours, reference) = (scene.render(16, &mut draws), scene.render(160, &mut draws));
    let verdict = compare(&ours, &reference);
    let Outcome::Undecided { needed_factor: Some(factor) } = verdict.outcome else {
        panic!("{:?}", verdict.outcome);
    };
    // The factor makes the bias detectable; 0.9 times the factor does not.
    let with = |factor: f64| {
        let mut better = ours.clone();
        better.global.iter_mut().for_each(|side| side.variance_of_mean /= factor);
        compare(&better, &reference).global.worst_detectable_bias.unwrap()
    };
    assert!(factor > 1.0 && with(factor) <= 0.005 && with(0.9 * factor) > 0.005, "{factor}");

    // With a reference as noisy as our side was, no number of samples is enough.
    let verdict = compare(&scene.render(160, &mut draws), &ours);
    assert_eq!(verdict.outcome, Outcome::Undecided { needed_factor: None });
}

#[test]
fn enough_samples_agree() {
    let scene = Scene { deviation: 0.02, ..EXPONENTIAL };
    let verdict = &verdicts(26, 1, (scene, 32), (scene, 32))[0];
    assert_eq!(verdict.outcome, Outcome::Agrees);
    assert_eq!((verdict.tiles_compared, verdict.peak.tests), (64, 192));
    assert!(verdict.p > 0.01 && verdict.localised.is_empty());
}

#[test]
fn exact_tiles_are_ignored_if_equal_and_rejected_if_different() {
    let exact = Estimate::exact;
    let (ours, reference) = one_tile(exact(1.0), exact(1.0));
    let same = compare(&ours, &reference);
    assert_eq!((same.outcome, same.peak.tests, same.scatter.chi2.dof, same.p), (Outcome::Agrees, 0, 0.0, 1.0));
    let rounding = compare(&one_tile(exact(1.000_002), exact(1.0)).0, &reference);
    assert_eq!((rounding.outcome, rounding.peak.tests, rounding.p), (Outcome::Agrees, 0, 1.0));
    let (ours, reference) = one_tile(exact(1.0), exact(1.000_01));
    let other = compare(&ours, &reference);
    assert_eq!((other.outcome, other.p, other.localised.as_slice()), (Outcome::Differs, 0.0, [0].as_slice()));
    let (ours, reference) = one_tile(exact(f64::INFINITY), exact(1.0));
    assert_eq!(compare(&ours, &reference).outcome, Outcome::Differs);
}

#[test]
fn a_black_channel_needs_no_power() {
    let lit = Estimate { mean: 1.0, variance_of_mean: 1e-7, dof: 31.0 };
    let (mut ours, mut reference) = one_tile(lit, lit);
    for side in [&mut ours, &mut reference] {
        side.global[2] = Estimate::exact(0.0);
    }
    let verdict = compare(&ours, &reference);
    assert_eq!((verdict.outcome, verdict.global.detectable_bias[2]), (Outcome::Agrees, None));
    // The green channel has ten times the standard error, so it decides.
    ours.global[1].variance_of_mean = 1e-5;
    assert!(matches!(compare(&ours, &reference).outcome, Outcome::Undecided { .. }));
}

#[test]
fn incomparable_sides_are_errors() {
    let error_of = |ours: &TiledMeans, reference: &TiledMeans| {
        Verdict::compare(ours, reference, None, &VerdictConfig::default()).unwrap_err()
    };
    let (ours, reference) = one_tile(Estimate::exact(1.0), Estimate::exact(1.0));
    let mut masked = ours.clone();
    (masked.tiles[0], masked.luminance[0]) = (None, None);
    assert_eq!(error_of(&masked, &reference), VerdictError::MasksDiffer { column: 0, row: 0 });
    assert_eq!(error_of(&masked, &masked), VerdictError::NothingCompared);
    let wider = TiledMeans { columns: 2, ..ours.clone() };
    let error = error_of(&wider, &reference).to_string();
    assert_eq!(error, "our image has (2, 1) tiles (columns, rows), the reference has (1, 1)");
    // Deterministic pixels alone can be compared.
    let check = Some(DeterministicCheck::compare(
        &[Estimate::exact(1.0)],
        &[Estimate::exact(1.0)],
        DeterministicCheck::TOLERANCE,
    ));
    let verdict = Verdict::compare(&masked, &masked, check, &VerdictConfig::default()).unwrap();
    assert_eq!(verdict.outcome, Outcome::Agrees);
}

#[test]
fn deterministic_pixels_affect_the_verdict() {
    let exact = |values: &[f64]| values.iter().map(|x| Estimate::exact(*x)).collect::<Vec<_>>();
    let check = |ours: &[f64], reference: &[f64]| {
        DeterministicCheck::compare(&exact(ours), &exact(reference), DeterministicCheck::TOLERANCE)
    };
    assert!(check(&[2.0, 0.0, 1e-12], &[2.000_1, 0.0, 0.0]).passed);
    assert!(!check(&[2.0], &[2.001]).passed);
    assert!(!check(&[2.0, 1e-9], &[2.0, 0.0]).passed);
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(!check(&[bad], &[1.0]).passed && !check(&[1.0], &[bad]).passed && !check(&[bad], &[bad]).passed);
    }
    let (ours, reference) = one_tile(Estimate::exact(1.0), Estimate::exact(1.0));
    let failed = Some(check(&[2.0], &[2.001]));
    let verdict = Verdict::compare(&ours, &reference, failed, &VerdictConfig::default()).unwrap();
    assert_eq!((verdict.outcome, verdict.p), (Outcome::Differs, 1.0));
}

#[test]
fn remaining_noise_does_not_fail_the_deterministic_check() {
    let noisy = |mean, std_error: f64, dof| Estimate { mean, variance_of_mean: std_error * std_error, dof };
    let check = |ours, reference| DeterministicCheck::compare(&[ours], &[reference], DeterministicCheck::TOLERANCE);
    // Four standard errors pass although they exceed the tolerance. Forty fail unless the variance has few degrees of
    // freedom.
    for (ours, reference) in
        [(noisy(1.004, 1e-3, 31.0), Estimate::exact(1.0)), (Estimate::exact(1.004), noisy(1.0, 1e-3, 31.0))]
    {
        assert_eq!((check(ours, reference).passed, check(ours, reference).worst_relative), (true, 0.0));
    }
    assert!(!check(noisy(1.04, 1e-3, 31.0), Estimate::exact(1.0)).passed);
    assert!(check(noisy(1.04, 1e-3, 3.0), Estimate::exact(1.0)).passed);
    // Within the tolerance, significance does not matter.
    assert!(check(noisy(1.000_05, 1e-9, 31.0), Estimate::exact(1.0)).passed);
}

#[test]
fn round_trips_through_json() {
    let verdict = &verdicts(27, 1, (EXPONENTIAL, 16), (EXPONENTIAL, 16))[0];
    let read: Verdict = serde_json::from_str(&serde_json::to_string(verdict).unwrap()).unwrap();
    assert_eq!((read.peak.tile_and_channel, read.tiles.len()), (verdict.peak.tile_and_channel, 64));
    // serde_json parses decimals exactly only with its feature `float_roundtrip`.
    assert!((read.scatter.chi2.p / verdict.scatter.chi2.p - 1.0).abs() < 1e-15);
}
