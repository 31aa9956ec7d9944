//! Modules use only what stands above them in `src/lib.rs`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::kit;

/// The modules of the library, in the order of `lib.rs`.
fn modules() -> Vec<String> {
    let text = fs::read_to_string(kit::root().join("src/lib.rs")).unwrap();
    let name = |line: &str| Some(line.strip_prefix("pub mod ")?.strip_suffix(';')?.to_owned());
    text.lines().filter_map(name).collect()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect()
}

/// The modules that a text names with `crate::`, alone or as the items of a group; `$crate` in a macro speaks for
/// whoever calls it.
fn used(text: &str) -> Vec<String> {
    let code: String = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::").filter(|(at, _)| !code[..*at].ends_with('$')) {
        let rest = &code[at + "crate::".len()..];
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

#[test]
fn no_module_uses_one_below_it() {
    let modules = modules();
    let position = |name: &str| modules.iter().position(|module| module == name);
    let folder = kit::root().join("src");
    let mut edges = 0;
    for path in sources(&folder) {
        let inside = path.strip_prefix(&folder).unwrap();
        let top = inside.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
        // The binary and `lib.rs` itself stand above no one.
        let Some(here) = position(top) else {
            assert!(["cli", "main", "lib"].contains(&top), "{top} is not in src/lib.rs");
            continue;
        };
        for name in used(&fs::read_to_string(&path).unwrap()) {
            let there = position(&name);
            assert!(there.is_none_or(|there| there <= here), "{} uses {name}, which stands below it", inside.display());
            edges += usize::from(there.is_some());
        }
    }
    assert!(edges > 100, "only {edges} uses were found");
}

#[test]
fn groups_and_paths_are_understood() {
    let text = "use crate::{\n    a::{b, c},\n    d,\n};\n// crate::e\nlet x = crate::f::g(); $crate::h";
    assert_eq!(used(text), ["a", "d", "f"]);
}
