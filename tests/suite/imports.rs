//! The dependencies between the modules of the crate, read from their sources.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// The path of a module in the crate, such as `study`, `plan`; empty for the crate itself.
pub(crate) type Name = Vec<String>;

/// The modules of a crate, by name.
#[derive(Debug, Default)]
pub(crate) struct Modules(BTreeMap<Name, Module>);

/// The names that the source of a module uses.
#[derive(Debug, Default)]
struct Module {
    imports: Vec<Import>,
    /// Other paths in its code.
    paths: Vec<Name>,
}

/// A name that a `use` declaration makes visible.
#[derive(Debug)]
struct Import {
    name: String,
    path: Name,
    /// Whether the name is visible to other modules.
    is_public: bool,
}

impl Modules {
    /// The modules of a folder of sources. Items that are compiled for tests only are included on request.
    pub(crate) fn read(folder: &Path, with_tests: bool) -> Self {
        let mut modules = Self::default();
        modules.0.insert(Name::new(), Module::default());
        modules.add(folder, &Name::new(), with_tests);
        modules
    }

    fn add(&mut self, folder: &Path, name: &Name, with_tests: bool) {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            let stem = path.file_stem().unwrap().to_str().unwrap();
            let inner = joined(name, stem);
            if path.is_dir() {
                self.add(&path, &inner, with_tests);
            } else if path.extension().is_some_and(|extension| extension == "rs") && !["lib", "main"].contains(&stem) {
                let name = if stem == "mod" { name.clone() } else { inner };
                self.0.insert(name, Module::parse(&fs::read_to_string(&path).unwrap(), with_tests));
            }
        }
    }

    /// The modules that each module uses. If a module re-exports a name of a submodule, modules that use the
    /// re-exported name depend on the submodule, and the re-exporting module does not.
    pub(crate) fn uses(&self) -> BTreeMap<Name, BTreeSet<Name>> {
        let of = |(name, module): (&Name, &Module)| {
            let target = |path: &Name| self.resolved(name, path);
            let is_own =
                |import: &&Import| !(import.is_public && target(&import.path).is_some_and(|to| to.starts_with(name)));
            let paths = module.imports.iter().filter(is_own).map(|import| &import.path).chain(&module.paths);
            (name.clone(), paths.filter_map(target).filter(|target| target != name).collect())
        };
        self.0.iter().map(of).collect()
    }

    /// The module that contains the target of a path in a module. None if the target is not in this crate.
    fn resolved(&self, from: &Name, path: &[String]) -> Option<Name> {
        let (mut here, mut rest) = (from.clone(), path);
        match rest.first()?.as_str() {
            "crate" => (here, rest) = (Name::new(), &rest[1..]),
            "self" => rest = &rest[1..],
            "super" => {}
            child if self.0.contains_key(&joined(from, child)) => {}
            _ => return None,
        }
        while let Some(word) = rest.first() {
            let inner = joined(&here, word);
            if word == "super" {
                here.pop()?;
            } else if self.0.contains_key(&inner) {
                here = inner;
            } else {
                // The origin of a name that the module imports.
                let import =
                    self.0.get(&here)?.imports.iter().find(|import| import.name == *word && import.path != rest);
                return import.map_or(Some(here.clone()), |import| self.resolved(&here, &import.path));
            }
            rest = &rest[1..];
        }
        Some(here)
    }
}

fn joined(name: &Name, inner: &str) -> Name {
    [name.as_slice(), &[inner.to_owned()]].concat()
}

impl Module {
    fn parse(text: &str, with_tests: bool) -> Self {
        let all = tokens(text);
        let tokens = if with_tests { all } else { without_tests(&all) };
        let is = |at: usize, token: &str| tokens.get(at).is_some_and(|found| found == token);
        let mut module = Self::default();
        let mut at = 0;
        while at < tokens.len() {
            let first = at;
            if is(at, "use") {
                // Both `pub use` and `pub(crate) use` are public.
                let is_public = at > 0 && (is(at - 1, "pub") || is(at - 1, ")"));
                at = use_tree(&tokens, at + 1, &Name::new(), &mut |name, path| {
                    module.imports.push(Import { name, path, is_public });
                });
            } else if is_word(&tokens[at]) {
                while is(at + 1, "::") && tokens.get(at + 2).is_some_and(|token| is_word(token)) {
                    at += 2;
                }
                // `$crate` in a macro belongs to the module that calls the macro.
                if at > first && !(first > 0 && is(first - 1, "$")) {
                    module.paths.push(tokens[first..=at].iter().step_by(2).cloned().collect());
                }
            }
            at += 1;
        }
        module
    }
}

/// Reads a tree of a `use` declaration, and returns its end.
fn use_tree(tokens: &[String], mut at: usize, before: &Name, found: &mut impl FnMut(String, Name)) -> usize {
    let mut path = before.clone();
    loop {
        match tokens[at].as_str() {
            "{" => {
                at += 1;
                while tokens[at] != "}" {
                    at = use_tree(tokens, at, &path, found);
                    at += usize::from(tokens[at] == ",");
                }
                return at + 1;
            }
            "as" => {
                found(tokens[at + 1].clone(), path);
                return at + 2;
            }
            "," | ";" | "}" => {
                found(path.last().expect("a path has a name").clone(), path);
                return at;
            }
            "::" => {}
            "self" if !path.is_empty() => {}
            word => path.push(word.to_owned()),
        }
        at += 1;
    }
}

/// The words, `::` and other characters of a source, without comments, strings and character literals.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let length = if let Some(length) = comment(rest).or_else(|| literal(rest)) {
            length
        } else if is_word(rest) {
            let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            tokens.push(rest[..length].to_owned());
            length
        } else if rest.starts_with("::") {
            tokens.push("::".to_owned());
            2
        } else {
            if !c.is_whitespace() {
                tokens.push(c.to_string());
            }
            c.len_utf8()
        };
        rest = &rest[length..];
    }
    tokens
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphanumeric() || c == '_')
}

/// The length of the comment at the start of a source.
fn comment(text: &str) -> Option<usize> {
    if text.starts_with("//") {
        return Some(text.find('\n').unwrap_or(text.len()));
    }
    text.starts_with("/*").then(|| text.find("*/").expect("a comment ends") + 2)
}

/// The length of the literal at the start of a source: a string, raw or not, or a character.
fn literal(text: &str) -> Option<usize> {
    let raw = text.strip_prefix("br").or_else(|| text.strip_prefix('r')).unwrap_or_default();
    let hashes = raw.len() - raw.trim_start_matches('#').len();
    if raw[hashes..].starts_with('"') {
        let start = text.len() - raw.len() + hashes + 1;
        let end = format!("\"{}", "#".repeat(hashes));
        return Some(start + text[start..].find(&end).expect("a raw text ends") + end.len());
    }
    if let Some(inside) = text.strip_prefix('"') {
        let mut is_escaped = false;
        let end = inside.find(|c| {
            let is_end = c == '"' && !is_escaped;
            is_escaped = c == '\\' && !is_escaped;
            is_end
        });
        return Some(2 + end.expect("a text ends"));
    }
    let mut letters = text.strip_prefix('\'')?.chars();
    match (letters.next()?, letters.next()?) {
        ('\\', escaped) => {
            let start = 2 + escaped.len_utf8();
            Some(start + text[start..].find('\'')? + 1)
        }
        (c, '\'') => Some(2 + c.len_utf8()),
        // A lifetime.
        _ => None,
    }
}

/// The tokens without items that are compiled for tests only.
fn without_tests(tokens: &[String]) -> Vec<String> {
    const TEST: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept: Vec<String> = Vec::new();
    let mut rest = tokens;
    while let Some(token) = rest.first() {
        if !rest.iter().take(TEST.len()).eq(TEST.iter()) {
            kept.push(token.clone());
            rest = &rest[1..];
            continue;
        }
        // The item ends at a semicolon outside of braces, or at its closing brace.
        let mut depth = 0_i32;
        let end = rest.iter().position(|token| {
            depth += i32::from(token == "{") - i32::from(token == "}");
            depth == 0 && (token == "}" || token == ";")
        });
        rest = &rest[end.expect("an item ends") + 1..];
    }
    kept
}

#[test]
fn uses_are_found_in_paths_groups_and_names_that_are_handed_on() {
    let folder = tempfile::tempdir().unwrap();
    let sources = [
        (
            "a/mod.rs",
            "mod b;\npub use b::{B, inner as other};\nfn f() -> c::C<'static> { let _ = 'x'; c::new(\"crate::e\") }",
        ),
        ("a/b.rs", "// use crate::d;\nuse super::c::{self, C};\n#[cfg(test)]\nmod tests { use crate::d; }"),
        ("a/c.rs", "macro_rules! m { () => { $crate::d::D } }\n/* crate::d */ const T: &str = r#\"\"crate::d\"#;"),
        ("d.rs", "use crate::{a::B as C, e};\nfn g(x: &std::path::Path) -> crate::a::other::D { super::e::E }"),
        ("e.rs", "use crate::a::c;\nuse std::fmt;"),
    ];
    fs::create_dir(folder.path().join("a")).unwrap();
    for (name, text) in sources {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let found = |with_tests| {
        let uses = Modules::read(folder.path(), with_tests).uses();
        let words = |targets: &BTreeSet<Name>| targets.iter().map(|name| name.join("::")).collect::<Vec<_>>().join(" ");
        uses.iter().map(|(name, targets)| format!("{}: {}", name.join("::"), words(targets))).collect::<Vec<_>>()
    };
    assert_eq!(found(false), [": ", "a: a::c", "a::b: a::c", "a::c: ", "d: a::b e", "e: a::c"]);
    assert_eq!(found(true)[2], "a::b: a::c d");
}
