use serde::Serialize;

use crate::{stats::Outcome, validation::SceneEvidence};

/// Pass or fail as a symbol and a word. The CSS class adds a colour with the same meaning.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Mark {
    pub(super) symbol: &'static str,
    pub(super) word: &'static str,
    class: &'static str,
}

impl Mark {
    /// The mark of a finding.
    pub(super) fn of_finding(passed: bool) -> Self {
        if passed { Self::pass("holds") } else { Self::fail("fails") }
    }

    /// The mark of a prediction; None means that nothing is predicted.
    pub(crate) fn of_prediction(holds: Option<bool>) -> Self {
        holds.map_or(Self { symbol: "–", word: "nothing predicted", class: "open" }, Self::of_finding)
    }

    /// The mark of a scene. Agreement does not count if the verdict failed to detect the scaled image.
    pub(super) fn of_scene(scene: &SceneEvidence) -> Self {
        match scene.comparison.verdict.as_ref().map(|verdict| verdict.outcome) {
            _ if scene.passed => Self::pass("agrees"),
            Some(Outcome::Agrees) => Self::fail("agrees, but misses a known bias"),
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
