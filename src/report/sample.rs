//! Artificial evidence for tests.

use crate::{
    comparison::{Comparison, Metrics},
    law::{Effort, Finding, Measured},
    stats::{DeterministicCheck, Estimate, Outcome, TiledMeans, Verdict, VerdictConfig},
    validation::{Evidence, Images, LawTime, Row, SceneEvidence},
};

fn row(name: &str, finding: Finding, passed: bool) -> Row {
    Row {
        name: name.into(),
        claim: format!("The claim of {name}."),
        source: "a book".into(),
        finding,
        level: 0.001,
        detectable_bias: None,
        passed,
        reproduce: format!("etendue verify --only '{name}' --full"),
    }
}

/// A row of an equivalence test.
pub(super) fn equivalent(name: &str, limit: f64, bound: f64) -> Row {
    let finding = Finding { measured: Measured::Equivalence { limit, bound }, ..Finding::error("a mean", 0.0, 0.0) };
    row(name, finding, limit <= bound)
}

/// Tests of one law, with their p-values.
pub(super) fn many(tests: &[(f64, bool)]) -> Vec<Row> {
    let test = |(i, &(p, passed)): (usize, &(f64, bool))| {
        row("bsdf/chi2", Finding::test(format!("case {i}"), "chi²", p), passed)
    };
    tests.iter().enumerate().map(test).collect()
}

/// A scene of 8 × 16 pixels, two tiles; our image differs by `off` standard errors.
fn scene(name: &str, off: f64, outcome: Outcome) -> SceneEvidence {
    let estimate = |mean| Estimate { mean, variance_of_mean: 1e-8, dof: 31.0 };
    let side = |mean| TiledMeans {
        columns: 1,
        rows: 2,
        tiles: vec![Some([estimate(mean); 3]); 2],
        luminance: vec![Some(estimate(mean)); 2],
        global: [estimate(mean); 3],
    };
    let ours = 1.0 + off * 1e-4 * 2_f64.sqrt();
    let exact = Some(DeterministicCheck::compare(
        &[Estimate::exact(2.0)],
        &[Estimate::exact(2.0)],
        DeterministicCheck::TOLERANCE,
    ));
    let verdict = Verdict::compare(&side(ours), &side(1.0), exact, &VerdictConfig::default()).unwrap();
    assert_eq!(verdict.outcome, outcome);
    let images = Images { width: 8, ours: vec![[ours; 3]; 128], reference: vec![[1.0; 3]; 128] };
    // JSON keeps these numbers to the last bit even without serde_json's feature `float_roundtrip`.
    let metrics = Metrics { bias: 0.5, rmse: 0.25, relative_mse: 0.125, mean: 1.0, reference_mean: 1.0 };
    let comparison =
        Comparison { verdict: Some(verdict), without_variances: vec![], identical: false, metrics, spp: Some(512) };
    SceneEvidence {
        name: format!("reference/{name}"),
        scene: format!("assets/scenes/{name}.xml").into(),
        reference: format!("reference/{name}").into(),
        reference_by: "Mitsuba 3.9.0 scalar_rgb, 16384 spp".into(),
        conclusion: comparison.conclusion(),
        comparison,
        passed: outcome == Outcome::Agrees,
        scale: 1.005,
        scaled: Outcome::Differs,
        seconds: 1.5,
        reproduce: vec![format!("etendue verify --only 'reference/{name}' --full")],
        images,
    }
}

fn evidence(rows: Vec<Row>, scenes: Vec<SceneEvidence>) -> Evidence {
    Evidence {
        version: "0.1.0".into(),
        only: "*".into(),
        effort: Effort::Full,
        seconds: 12.5,
        threads: 2,
        times: [("fresnel/table", 0.25), ("bsdf/chi2", 1.5)]
            .map(|(name, seconds)| LawTime { name: name.into(), seconds })
            .into(),
        rows,
        scenes,
    }
}

/// Evidence in which every row holds.
pub(super) fn passing() -> Evidence {
    let rows = vec![
        row("fresnel/table", Finding::value("0°", 0.04, 0.04, 1e-8), true),
        row("bsdf/chi2", Finding::test("a test that holds", "chi² = 300.5, 310 dof", 0.5), true),
    ];
    evidence(rows, vec![scene("agrees", 0.5, Outcome::Agrees)])
}

/// Evidence in which a test and a scene fail. One subject contains characters that must be escaped.
pub(super) fn failing() -> Evidence {
    let rows = vec![
        row("fresnel/table", Finding::value("0° | <b>bold</b> & 'quoted'", 0.04, 0.04, 1e-8), true),
        row("bsdf/chi2", Finding::test("a test that holds", "chi² = 300.5, 310 dof", 0.5), true),
        row("bsdf/chi2", Finding::test("a test that fails", "chi² = 900.25, 310 dof", 0.0), false),
    ];
    evidence(rows, vec![scene("differs", 50.0, Outcome::Differs)])
}
