//! The rooms of `hiz_core`: data goes one way.
//!
//! The imports between the files of `src/` are read from their text.
//! No file may lead back to itself, and no file may import one from a room that `lib.rs` declares
//! later than its own.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules (`pyramid::layout`; `pyramid` is its `mod.rs`) and what each imports.
type Graph = BTreeMap<String, BTreeSet<String>>;

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Every file below `folder`, by its module path.
fn files(folder: &Path, prefix: &str, found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("a folder of sources").path();
        let name = path.file_stem().and_then(|stem| stem.to_str()).expect("a name").to_owned();
        if path.is_dir() {
            files(&path, &format!("{prefix}{name}::"), found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let module = if name == "mod" {
                prefix.trim_end_matches("::").to_owned()
            } else {
                format!("{prefix}{name}")
            };
            found.insert(module, fs::read_to_string(&path).expect("a source"));
        }
    }
}

/// The code of a file: no comments, and nothing from its unit tests on.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// The longest module that a path begins with.
fn module_of(path: &str, modules: &BTreeSet<String>) -> Option<String> {
    let parts: Vec<&str> = path.split("::").collect();
    (1..=parts.len()).rev().map(|n| parts[..n].join("::")).find(|m| modules.contains(m))
}

/// Identifiers and `::` from the start of a text.
fn path_at(text: &str) -> &str {
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
    text[..end.unwrap_or(text.len())].trim_end_matches(':')
}

fn graph(texts: &BTreeMap<String, String>) -> Graph {
    let modules: BTreeSet<String> = texts.keys().cloned().collect();
    let mut graph = Graph::new();
    for (module, text) in texts {
        let code = code(text);
        let mut imports = BTreeSet::new();
        let mut add = |path: &str| {
            if let Some(target) = module_of(path, &modules).filter(|target| target != module) {
                imports.insert(target);
            }
        };
        for (at, _) in code.match_indices("crate::") {
            add(path_at(&code[at + "crate::".len()..]));
            // `crate::{a::b, c}` is not written here: rustfmt keeps one path a line.
            assert!(!code[at..].starts_with("crate::{"), "{module}: one path in each use");
        }
        for (at, _) in code.match_indices("super::") {
            let parent = module.rsplit_once("::").map_or("", |(parent, _)| parent);
            add(&format!("{parent}::{}", path_at(&code[at + "super::".len()..])));
        }
        // `pub use child::Item;` of a `mod.rs`.
        for line in code.lines() {
            let line =
                line.trim_start().trim_start_matches("pub(crate) ").trim_start_matches("pub ");
            if let Some(path) = line.strip_prefix("use ") {
                let path = path_at(path);
                if !path.starts_with("crate") && !path.starts_with("super") {
                    add(&format!("{module}::{path}"));
                }
            }
        }
        graph.insert(module.clone(), imports);
    }
    graph.remove("lib");
    graph
}

/// A way from a module back to itself, if there is one.
fn circle(graph: &Graph) -> Option<Vec<String>> {
    fn walk(
        graph: &Graph,
        path: &mut Vec<String>,
        done: &mut BTreeSet<String>,
    ) -> Option<Vec<String>> {
        let here = path.last().expect("a start").clone();
        if let Some(first) = path[..path.len() - 1].iter().position(|module| *module == here) {
            return Some(path[first..].to_vec());
        }
        if done.contains(&here) {
            return None;
        }
        for next in graph.get(&here).into_iter().flatten() {
            path.push(next.clone());
            let found = walk(graph, path, done);
            if found.is_some() {
                return found;
            }
            path.pop();
        }
        done.insert(here);
        None
    }
    let mut done = BTreeSet::new();
    graph.keys().find_map(|start| walk(graph, &mut vec![start.clone()], &mut done))
}

/// The rooms in the order in which `lib.rs` declares them.
fn rooms(lib: &str) -> Vec<String> {
    let declared = lib.lines().filter_map(|line| {
        let name = line.strip_prefix("pub ").unwrap_or(line).strip_prefix("mod ")?;
        name.strip_suffix(';').map(str::to_owned)
    });
    declared.collect()
}

/// Imports of what is declared later: importer and imported.
fn upward(graph: &Graph, rooms: &[String]) -> Vec<(String, String)> {
    let floor = |module: &str| {
        let room = module.split("::").next().unwrap_or_default();
        rooms.iter().position(|r| r == room).unwrap_or_else(|| panic!("{module}: no such room"))
    };
    let all = graph.iter().flat_map(|(from, to)| to.iter().map(move |to| (from, to)));
    all.filter(|(from, to)| floor(from) < floor(to)).map(|(f, t)| (f.clone(), t.clone())).collect()
}

fn texts() -> BTreeMap<String, String> {
    let mut texts = BTreeMap::new();
    files(&source(), "", &mut texts);
    texts
}

#[test]
fn data_goes_one_way() {
    let texts = texts();
    let (graph, rooms) = (graph(&texts), rooms(&texts["lib"]));
    assert!(rooms.len() <= 14, "rooms and single files of the crate: {rooms:?}");
    assert!(graph.len() > 50 && graph.values().map(BTreeSet::len).sum::<usize>() > 150, "read");
    assert_eq!(circle(&graph), None, "a circle of modules");
    assert_eq!(upward(&graph, &rooms), [], "imports of a room that stands above");
}

/// `gpu/` knows no stage, and `host/` and `input/` no device.
#[test]
fn low_rooms_know_no_stage() {
    for (module, imports) in graph(&texts()) {
        let room = module.split("::").next().unwrap_or_default();
        let allowed: &[&str] = match room {
            "host" => &["error", "host"],
            "input" => &["error", "host", "input"],
            "gpu" => &["error", "host", "input", "gpu"],
            _ => continue,
        };
        for import in imports {
            let theirs = import.split("::").next().unwrap_or_default();
            assert!(allowed.contains(&theirs), "{module} imports {import}");
        }
    }
}

/// The test itself: planted imports are found.
#[test]
fn planted_imports_are_found() {
    let mut texts = texts();
    let lib = rooms(&texts["lib"]);
    let planted = texts["pyramid::layout"].replacen(
        "use crate::",
        "use crate::cull::inputs::CullInputs;\nuse crate::",
        1,
    );
    assert_ne!(planted, texts["pyramid::layout"]);
    texts.insert("pyramid::layout".to_owned(), planted);
    let found = upward(&graph(&texts), &lib);
    assert_eq!(found, [("pyramid::layout".to_owned(), "cull::inputs".to_owned())]);
    assert!(circle(&graph(&texts)).is_some(), "the cull reads the pyramid's layout");
    let inner =
        texts["gpu::checked"].replacen("use crate::", "use super::device::Gpu;\nuse crate::", 1);
    let mut texts = self::texts();
    texts.insert("gpu::checked".to_owned(), inner);
    let found = circle(&graph(&texts)).expect("gpu::device checks what it makes");
    assert!(found.contains(&"gpu::checked".to_owned()), "{found:?}");
}
