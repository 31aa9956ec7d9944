//! What was probably meant by a word that is not known.

use super::{Category, Plugin, mitsuba};

/// Bytes of a word for which another is looked for. Edit distances of long texts take long.
const MAX_WORD: usize = 64;
/// Words among which one is looked for; among more, something is always near.
const MAX_CANDIDATES: usize = 1_000;

/// The candidate that was probably meant: equal but for case and underscores, or else the nearest spelling.
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
        // Candidates may come in any order, but the same scene gets the same message.
        .max_by(|a, b| a.0.total_cmp(&b.0).then_with(|| b.1.cmp(a.1)))
        .map(|(_, candidate)| candidate)
}

/// What a message says after a word that is not known: the word that was probably meant, or all that are known.
pub(super) fn hint(word: &str, known: &[&str]) -> String {
    match closest(word, known.iter().copied()) {
        Some(near) => format!("did you mean \"{near}\"?"),
        None if known.is_empty() => "there are none".to_owned(),
        None => format!("known: {}", known.join(", ")),
    }
}

/// That no plugin of a category has a name, and what was probably meant.
#[must_use]
pub fn unknown_plugin(category: Category, name: &str, plugins: &[&'static Plugin]) -> (String, String) {
    let what = format!("no {category} is called \"{name}\"");
    match mitsuba::PLUGINS.iter().find(|plugin| plugin.category == category && plugin.name == name) {
        Some(plugin) => (format!("{what} here"), plugin.missing()),
        None => (what, hint(name, &plugins.iter().map(|plugin| plugin.name).collect::<Vec<_>>())),
    }
}
