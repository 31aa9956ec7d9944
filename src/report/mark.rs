use serde::Serialize;

use crate::{stats::Outcome, validation::SceneEvidence};

/// Pass or fail for the eye: a symbol and a word, and a class for the colour that only repeats them.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Mark {
    pub(super) symbol: &'static str,
    pub(super) word: &'static str,
    class: &'static str,
}

impl Mark {
    /// Of a finding.
    pub(super) fn of_finding(passed: bool) -> Self {
        if passed { Self::pass("holds") } else { Self::fail("fails") }
    }

    /// Of a prediction, if there is one.
    pub(crate) fn of_prediction(holds: Option<bool>) -> Self {
        holds.map_or(Self { symbol: "–", word: "nothing predicted", class: "open" }, Self::of_finding)
    }

    /// Of a scene: agreement does not count where the verdict is blind.
    pub(super) fn of_scene(scene: &SceneEvidence) -> Self {
        match scene.comparison.verdict.as_ref().map(|verdict| verdict.outcome) {
            _ if scene.passed => Self::pass("agrees"),
            Some(Outcome::Agrees) => Self::fail("agrees, but is blind"),
            Some(Outcome::Differs) => Self::fail("differs"),
            Some(Outcome::Undecided { .. }) | None => Self { symbol: "?", word: "undecided", class: "open" },
        }
    }

    const fn pass(word: &'static str) -> Self {
        Self { symbol: "✓", word, class: "pass" }
    }

    const fn fail(word: &'static str) -> Self {
        Self { symbol: "✗", word, class: "fail" }
    }
}
