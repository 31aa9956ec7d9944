//! Modules use only what stands above them in `src/lib.rs`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::kit;

/// The modules that a file declares, in their order.
fn modules(file: &str) -> Vec<String> {
    let text = fs::read_to_string(kit::root().join(file)).unwrap();
    let name = |line: &str| {
        line.strip_prefix("pub ").unwrap_or(line).strip_prefix("mod ")?.strip_suffix(';').map(str::to_owned)
    };
    text.lines().filter_map(name).collect()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect()
}

/// The modules that a text names after `prefix`, such as `crate::`, alone or as the items of a group; `$crate` in a macro
/// speaks for whoever calls it.
fn used(text: &str, prefix: &str) -> Vec<String> {
    let code: String = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let mut found = Vec::new();
    for (at, _) in code.match_indices(prefix).filter(|(at, _)| !code[..*at].ends_with('$')) {
        let rest = &code[at + prefix.len()..];
        match rest.strip_prefix('{') {
            Some(group) => found.extend(items(group)),
            None => found.push(word(rest)),
        }
    }
    found
}

/// The first words of the items of a group, up to its closing brace.
fn items(group: &str) -> Vec<String> {
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            ',' | '}' if depth == 0 => {
                found.push(word(group[start..at].trim_start()));
                start = at + 1;
                if c == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    found.retain(|word| !word.is_empty());
    found
}

fn word(text: &str) -> String {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

/// Counts the uses of modules of a list by one another, and fails at the first of one that stands below its user.
///
/// `folder` holds the modules, and its files name them after `prefix`. Files of `outside` may use all of them.
fn edges(folder: &str, modules: &[String], prefix: &str, outside: &[&str]) -> usize {
    let position = |name: &str| modules.iter().position(|module| module == name);
    let folder = kit::root().join(folder);
    let mut edges = 0;
    for path in sources(&folder) {
        let inside = path.strip_prefix(&folder).unwrap();
        let top = inside.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
        let Some(here) = position(top) else {
            assert!(outside.contains(&top), "{top} is not declared");
            continue;
        };
        for name in used(&fs::read_to_string(&path).unwrap(), prefix) {
            let there = position(&name);
            assert!(there.is_none_or(|there| there <= here), "{} uses {name}, which stands below it", path.display());
            edges += usize::from(there.is_some());
        }
    }
    edges
}

#[test]
fn no_module_uses_one_below_it() {
    let edges = edges("src", &modules("src/lib.rs"), "crate::", &["cli", "main", "lib"]);
    assert!(edges > 100, "only {edges} uses were found");
}

#[test]
fn no_topic_of_validation_uses_one_below_it() {
    let edges = edges("src/validation", &modules("src/validation/mod.rs"), "validation::", &["mod"]);
    assert!(edges > 30, "only {edges} uses were found");
}

#[test]
fn groups_and_paths_are_understood() {
    let text = "use crate::{\n    a::{b, c},\n    d,\n};\n// crate::e\nlet x = crate::f::g(); $crate::h";
    assert_eq!(used(text, "crate::"), ["a", "d", "f"]);
    assert_eq!(used("use crate::{a, validation::{b::c, d}};", "validation::"), ["b", "d"]);
}
