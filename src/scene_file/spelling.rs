//! Suggests the word that was probably meant instead of an unknown one.

use super::{Category, Plugin, mitsuba};

/// Longer words, in bytes, get no suggestion, because edit distances of long texts take long.
const MAX_WORD: usize = 64;
/// With more candidates there is no suggestion, because one of them is always near.
const MAX_CANDIDATES: usize = 1_000;

/// The candidate that was probably meant: equal except for case and underscores, or else the nearest spelling.
pub fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let candidates: Vec<_> = candidates.into_iter().take(MAX_CANDIDATES + 1).collect();
    if word.len() > MAX_WORD || candidates.len() > MAX_CANDIDATES {
        return None;
    }
    let plain = |text: &str| text.replace('_', "").to_lowercase();
    candidates
        .into_iter()
        .filter(|candidate| candidate.len() <= MAX_WORD)
        .map(|candidate| {
            let alike = plain(candidate) == plain(word);
            (if alike { 1.0 } else { strsim::normalized_damerau_levenshtein(word, candidate) }, candidate)
        })
        .filter(|(likeness, _)| *likeness >= 0.6)
        // Candidates may come in any order, but the message must not depend on it.
        .max_by(|a, b| a.0.total_cmp(&b.0).then_with(|| b.1.cmp(a.1)))
        .map(|(_, candidate)| candidate)
}

/// The hint after an unknown word: the word that was probably meant, or all known words.
pub(super) fn hint(word: &str, known: &[&str]) -> String {
    match closest(word, known.iter().copied()) {
        Some(near) => format!("did you mean \"{near}\"?"),
        None if known.is_empty() => "there are none".to_owned(),
        None => format!("known: {}", known.join(", ")),
    }
}

/// The error for an unknown plugin of a category, with the name that was probably meant.
#[must_use]
pub fn unknown_plugin(category: Category, name: &str, plugins: &[&'static Plugin]) -> (String, String) {
    let what = format!("no {category} is called \"{name}\"");
    match mitsuba::PLUGINS.iter().find(|plugin| plugin.category == category && plugin.name == name) {
        Some(plugin) => (format!("{what} here"), plugin.missing()),
        None => (what, hint(name, &plugins.iter().map(|plugin| plugin.name).collect::<Vec<_>>())),
    }
}
