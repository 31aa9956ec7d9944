//! Modules use only the modules above them in `src/lib.rs`, and the modules of a folder do not depend on each other in
//! a circle.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
};

use crate::{
    imports::{Modules, Name},
    kit,
};

/// The modules that a file declares, in order.
fn order(file: &str) -> Vec<String> {
    let text = fs::read_to_string(kit::root().join(file)).unwrap();
    let name = |line: &str| Some(line.trim_start_matches("pub ").strip_prefix("mod ")?.strip_suffix(';')?.to_owned());
    text.lines().filter_map(name).collect()
}

/// Counts the dependencies between the modules of a folder, and fails at a module that depends on a later one. Modules
/// of `outside` may depend on all of them.
fn edges(folder: &[&str], file: &str, outside: &[&str]) -> usize {
    let order = order(file);
    let module = |name: &Name| {
        name.strip_prefix(folder.iter().map(|part| (*part).to_owned()).collect::<Vec<_>>().as_slice())
            .and_then(|rest| rest.first().cloned())
    };
    let position = |name: &Name| module(name).and_then(|name| order.iter().position(|module| *module == name));
    let mut edges = 0;
    for (name, targets) in Modules::read(&kit::root().join("src"), true).uses() {
        let Some(here) = position(&name) else {
            assert!(
                module(&name).is_none_or(|top| outside.contains(&top.as_str())),
                "{} is not in {file}",
                name.join("::")
            );
            continue;
        };
        for target in targets {
            let there = position(&target);
            let (name, target) = (name.join("::"), target.join("::"));
            assert!(there.is_none_or(|there| there <= here), "{name} uses {target}, which stands below it");
            edges += usize::from(there.is_some());
        }
    }
    edges
}

#[test]
fn no_module_uses_one_below_it() {
    let edges = edges(&[], "src/lib.rs", &["cli"]);
    assert!(edges > 100, "only {edges} uses were found");
}

#[test]
fn no_topic_of_validation_uses_one_below_it() {
    let edges = edges(&["validation"], "src/validation/mod.rs", &[]);
    assert!(edges > 30, "only {edges} uses were found");
}

/// Names, each with the names that it uses.
type Graph<N> = BTreeMap<N, BTreeSet<N>>;

/// The names that are part of a cycle.
fn in_circles<N: Clone + Ord>(graph: &Graph<N>) -> Vec<&N> {
    let comes_back = |start: &&N| {
        let mut seen = BTreeSet::new();
        let mut open = vec![*start];
        while let Some(name) = open.pop() {
            open.extend(graph.get(name).into_iter().flatten().filter(|next| seen.insert(*next)));
        }
        seen.contains(start)
    };
    graph.keys().filter(comes_back).collect()
}

/// For each folder, the dependencies between its modules; a module includes the modules in its own folder.
fn folders(uses: &Graph<Name>) -> BTreeMap<Name, Graph<String>> {
    let mut folders: BTreeMap<Name, Graph<String>> = BTreeMap::new();
    for (name, target) in uses.iter().flat_map(|(name, targets)| targets.iter().map(move |target| (name, target))) {
        let shared = name.iter().zip(target).take_while(|(a, b)| a == b).count();
        if let (Some(a), Some(b)) = (name.get(shared), target.get(shared)) {
            let folder = folders.entry(name[..shared].to_vec()).or_default();
            folder.entry(a.clone()).or_default().insert(b.clone());
        }
    }
    folders
}

#[test]
fn no_modules_of_a_folder_use_each_other_in_a_circle() {
    let folders = folders(&Modules::read(&kit::root().join("src"), false).uses());
    let words = |circle: Vec<&String>| circle.into_iter().cloned().collect::<Vec<_>>().join(" ");
    let circles = folders.iter().map(|(folder, graph)| (folder.join("::"), words(in_circles(graph))));
    let found: Vec<_> = circles.filter(|(_, circle)| !circle.is_empty()).collect();
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn folders_that_draw_and_study_are_free_of_circles_with_their_own_file_too() {
    let uses = Modules::read(&kit::root().join("src"), false).uses();
    for top in ["plot", "study"] {
        let within = |name: &Name| name.first().is_some_and(|first| first == top);
        let own = uses.iter().filter(|(name, _)| within(name));
        let graph: Graph<Name> = own
            .map(|(name, targets)| (name.clone(), targets.iter().filter(|target| within(target)).cloned().collect()))
            .collect();
        assert!(graph.len() > 5 && in_circles(&graph).is_empty(), "{top}: {:?}", in_circles(&graph));
    }
}

#[test]
fn circles_are_seen() {
    let graph: Graph<&str> = [("a", vec!["b"]), ("b", vec!["c"]), ("c", vec!["b", "d"]), ("d", vec![])]
        .map(|(a, b)| (a, b.into_iter().collect()))
        .into();
    assert_eq!(in_circles(&graph), [&"b", &"c"]);
}
