//! The sections of the scenes: pictures and the statistics of the verdict.

use serde::Serialize;

use super::{
    anchor,
    drawings::{self, Drawing},
    mark::Mark,
    number,
    pictures::Pictures,
};
use crate::{
    comparison::TILE,
    stats::{Outcome, Verdict, verdict::PeakTest},
    validation::SceneEvidence,
};

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// The section of a scene.
#[derive(Debug, Serialize)]
pub(super) struct SceneView {
    pub(super) anchor: String,
    pub(super) title: String,
    pub(super) name: String,
    pub(super) conclusion: String,
    /// Why the scene fails; empty if no statistic rejects.
    pub(super) reasons: String,
    pub(super) mark: Mark,
    pub(super) passed: bool,
    pictures: Option<Pictures>,
    histogram: Option<Drawing>,
    channels: Vec<ChannelsView>,
    numbers: Vec<Number>,
    reproduce: Vec<String>,
}

/// A labelled number for each channel.
#[derive(Debug, Serialize)]
struct ChannelsView {
    label: &'static str,
    channels: [String; 3],
}

/// A labelled number.
#[derive(Debug, Serialize)]
struct Number {
    label: &'static str,
    text: String,
}

impl SceneView {
    pub(super) fn new(scene: &SceneEvidence) -> Self {
        let verdict = scene.comparison.verdict.as_ref();
        let title = scene.name.rsplit('/').next().unwrap_or_default().to_owned();
        Self {
            anchor: format!("scene-{}", anchor(&title)),
            title,
            name: scene.name.clone(),
            conclusion: scene.conclusion.clone(),
            reasons: reasons(scene),
            mark: Mark::of_scene(scene),
            passed: scene.passed,
            pictures: Pictures::new(scene),
            histogram: verdict.and_then(drawings::of_tiles),
            channels: verdict.map(|verdict| channels(scene, verdict)).unwrap_or_default(),
            numbers: verdict.map(statistics).unwrap_or_default().into_iter().chain(circumstances(scene)).collect(),
            reproduce: scene.reproduce.clone(),
        }
    }
}

fn channels(scene: &SceneEvidence, verdict: &Verdict) -> Vec<ChannelsView> {
    let global = &verdict.global;
    let mean =
        |pixels: &[[f64; 3]]| [0, 1, 2].map(|c| pixels.iter().map(|pixel| pixel[c]).sum::<f64>() / pixels.len() as f64);
    let means = |pixels: &[[f64; 3]]| mean(pixels).map(|mean| number::significant(mean, 5));
    let known = |text: Option<String>| text.unwrap_or_else(|| "–".into());
    let difference = global.relative_difference.map(|x| known(x.map(number::signed_percent)));
    let detectable = global.detectable_bias.map(|x| known(x.map(number::percent)));
    vec![
        ChannelsView { label: "Ours", channels: means(&scene.images.ours) },
        ChannelsView { label: "Reference", channels: means(&scene.images.reference) },
        ChannelsView { label: "Difference", channels: difference },
        ChannelsView { label: "p", channels: global.channels.map(|welch| number::probability(welch.p)) },
        ChannelsView { label: "Detectable bias", channels: detectable },
    ]
}

/// The statistics that reject, and a missed known bias.
fn reasons(scene: &SceneEvidence) -> String {
    let mut reasons = Vec::new();
    if let Some(verdict) = &scene.comparison.verdict {
        let (global, peak, scatter) = (&verdict.global, &verdict.peak, &verdict.scatter);
        let tests = [
            ("global means", global.p, global.level),
            ("worst tile", peak.p, peak.level),
            ("scatter of tiles", scatter.chi2.p, scatter.level),
        ];
        let rejecting = tests.into_iter().filter(|(_, p, level)| p <= level);
        reasons.extend(rejecting.map(|(name, p, _)| format!("{name} p = {}", number::probability(p))));
        if let Some(check) = verdict.deterministic.filter(|check| !check.passed) {
            reasons.push(format!("exact values off by {}", number::significant(check.worst_relative, 2)));
        }
    }
    if scene.scaled != Outcome::Differs {
        reasons.push(format!("the same image times {} is not detected as different", scene.scale));
    }
    reasons.join(", ")
}

/// The statistics of the verdict.
fn statistics(verdict: &Verdict) -> Vec<Number> {
    let at = |p: f64, level: f64| {
        format!("p = {}, rejects at {} or less", number::probability(p), number::significant(level, 2))
    };
    let (peak, chi2, config) = (&verdict.peak, &verdict.scatter.chi2, &verdict.config);
    let sum = number::significant(chi2.statistic, 4);
    let exact = verdict.deterministic.map_or("none".into(), |check| {
        let (worst, allowed) = (number::significant(check.worst_relative, 2), number::significant(check.tolerance, 2));
        format!("worst relative difference {worst} of {} values, allowed {allowed}", check.compared)
    });
    let detectable = match verdict.global.worst_detectable_bias {
        Some(bias) => format!(
            "a bias of {} in any lit channel's mean, with probability {}; target: {}",
            number::percent(bias),
            number::percent(config.power),
            number::percent(config.target_bias)
        ),
        None => "none: no noisy pixel of the reference is lit".into(),
    };
    vec![
        Number { label: "All statistics", text: at(verdict.p, config.alpha) },
        Number { label: "Global means", text: at(verdict.global.p, verdict.global.level) },
        Number {
            label: "Worst tile",
            text: format!("{}{}", at(peak.p, peak.level), worst_tile(peak, verdict.columns)),
        },
        Number {
            label: "Scatter of tiles",
            text: format!("χ² = {sum} of {} dof; {}", chi2.dof, at(chi2.p, verdict.scatter.level)),
        },
        Number { label: "Localised", text: format!("{} of {} tiles", verdict.localised.len(), verdict.tiles_compared) },
        Number { label: "Exact values", text: exact },
        Number { label: "Detectable bias", text: detectable },
    ]
}

/// The position of the worst tile, in tiles and in pixels.
fn worst_tile(peak: &PeakTest, columns: usize) -> String {
    let Some((tile, channel)) = peak.tile_and_channel else {
        return "; no tile has noise".into();
    };
    let (x, y) = (tile % columns, tile / columns);
    format!(
        "; the smallest p of {} tests, {}, is that of {} in column {x}, row {y} of tiles: pixels from ({}, {})",
        peak.tests,
        number::probability(peak.smallest_p),
        CHANNELS[channel],
        x * TILE,
        y * TILE
    )
}

fn circumstances(scene: &SceneEvidence) -> Vec<Number> {
    let metrics = &scene.comparison.metrics;
    let scaled = match scene.scaled {
        Outcome::Differs => "✓ differs, as it must",
        Outcome::Agrees => "✗ agrees: the verdict misses this bias",
        Outcome::Undecided { .. } => "✗ undecided: the verdict misses this bias",
    };
    let errors = format!(
        "{}; relative MSE {}; bias {}",
        number::significant(metrics.rmse, 3),
        number::significant(metrics.relative_mse, 3),
        number::significant(metrics.bias, 2)
    );
    let ours = scene.comparison.spp.map_or("unknown".into(), |spp| format!("{spp} spp"));
    vec![
        Number { label: "Ours, scaled", text: format!("times {}: {scaled}", scene.scale) },
        Number { label: "Samples of ours", text: format!("{ours}, {}", number::duration(scene.seconds)) },
        Number { label: "Reference by", text: scene.reference_by.clone() },
        Number { label: "RMSE", text: errors },
        Number { label: "Scene", text: scene.scene.display().to_string() },
        Number { label: "Reference", text: scene.reference.display().to_string() },
    ]
}
