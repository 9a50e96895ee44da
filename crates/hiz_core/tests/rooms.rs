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
    &text[..end.unwrap_or(text.len())]
}

/// The paths that start here: one, or those of the branches where it ends in `{a, b::{c, d}}`.
fn paths_at(text: &str) -> Vec<String> {
    let path = path_at(text);
    let Some(group) = text[path.len()..].strip_prefix('{').filter(|_| path.ends_with("::")) else {
        return vec![path.trim_end_matches("::").to_owned()];
    };
    let (mut depth, mut start, mut branches) = (0, 0, Vec::new());
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            ',' | '}' if depth == 0 => {
                branches.push(group[start..at].trim());
                start = at + 1;
                if c == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    let inner = branches.into_iter().filter(|branch| !branch.is_empty()).flat_map(paths_at);
    inner.map(|inner| format!("{path}{inner}")).collect()
}

/// The path from the crate's root that `path` is within `module`, if it starts with `crate`,
/// `super`, `self` or one of the module's children.
fn absolute(path: &str, module: &str, modules: &BTreeSet<String>) -> Option<String> {
    let mut base: Vec<&str> = module.split("::").collect();
    let mut parts = path.split("::").peekable();
    match *parts.peek()? {
        "crate" => base.clear(),
        "super" | "self" => {}
        child if modules.contains(&format!("{module}::{child}")) => {}
        _ => return None,
    }
    while let Some(step) = parts.next_if(|part| ["crate", "super", "self"].contains(part)) {
        if step == "super" {
            base.pop();
        }
    }
    Some(base.into_iter().chain(parts).collect::<Vec<_>>().join("::"))
}

fn graph(texts: &BTreeMap<String, String>) -> Graph {
    let modules: BTreeSet<String> = texts.keys().cloned().collect();
    let mut graph = Graph::new();
    for (module, text) in texts.iter().filter(|(module, _)| *module != "lib") {
        let code = code(text);
        let mut imports = BTreeSet::new();
        // Every path of the text, in `use` and elsewhere, begins after another character.
        let inside = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
        let begins = code.char_indices().zip(std::iter::once(' ').chain(code.chars()));
        for ((at, c), before) in begins {
            if !inside(c) || inside(before) || !path_at(&code[at..]).contains("::") {
                continue;
            }
            for path in paths_at(&code[at..]) {
                let Some(path) = absolute(&path, module, &modules) else { continue };
                // What `lib.rs` exports comes from any room.
                let target = module_of(&path, &modules)
                    .unwrap_or_else(|| panic!("{module} imports {path:?} from the crate's face"));
                if target != *module {
                    imports.insert(target);
                }
            }
        }
        graph.insert(module.clone(), imports);
    }
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

/// `host/` and `input/` touch no device: all that they know of wgpu is the formats of textures.
#[test]
fn low_rooms_touch_no_device() {
    for (module, text) in texts() {
        if ["host", "input"].contains(&module.split("::").next().unwrap_or_default()) {
            let code = code(&text);
            let named = code.matches("wgpu").count();
            assert_eq!(code.matches("wgpu::TextureFormat").count(), named, "{module} names wgpu");
        }
    }
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

/// The modules outside of `methods/` that import it, and the sources that name its shaders.
/// The lists of `testing/` name everything.
fn uses_of_methods(texts: &BTreeMap<String, String>) -> Vec<String> {
    let room = |module: &str| module.split("::").next().unwrap_or_default().to_owned();
    let is_outside = |module: &str| !["methods", "testing"].contains(&room(module).as_str());
    let imports = graph(texts)
        .into_iter()
        .filter(|(from, to)| is_outside(from) && to.iter().any(|to| room(to) == "methods"));
    let mut found: Vec<String> = imports.map(|(from, _)| from).collect();
    // `lib.rs` declares the room and exports nothing of it; its shaders have a folder of their own.
    let named = |module: &str, code: &str| {
        (module == "lib" && code.contains("methods::")) || code.contains("\"methods/")
    };
    found.extend(
        texts
            .iter()
            .filter(|(module, text)| is_outside(module) && named(module, &code(text)))
            .map(|(module, _)| module.clone()),
    );
    found
}

/// The texts' algorithms are beside the certified path, and nothing of it reaches them.
#[test]
fn nothing_uses_the_methods() {
    let texts = texts();
    assert!(texts.contains_key("methods"), "the room");
    assert!(rooms(&texts["lib"]).ends_with(&["methods".to_owned(), "testing".to_owned()]));
    assert_eq!(uses_of_methods(&texts), [""; 0]);
    for (module, line) in [
        ("cull::inputs", "use crate::methods;"),
        ("headless::engine", "use crate::methods::Anything;"),
        ("yardstick", "pub use crate::methods::Anything;"),
        ("cull::pipelines", "const MAPS: File = wgsl!(\"methods/maps\");"),
    ] {
        assert_eq!(uses_of_methods(&with_line(module, line)), [module], "{line}");
    }
    let mut exported = texts;
    exported.get_mut("lib").expect("the face").push_str("pub use methods::Anything;\n");
    assert_eq!(uses_of_methods(&exported), ["lib"]);
}

/// A module with one more line among its imports.
fn with_line(module: &str, line: &str) -> BTreeMap<String, String> {
    let mut texts = texts();
    let text = texts.get_mut(module).expect("a module");
    let planted = text.replacen("use crate::", &format!("{line}\nuse crate::"), 1);
    assert_ne!(planted, *text);
    *text = planted;
    texts
}

/// The test itself: planted imports are found, whatever their form.
#[test]
fn planted_imports_are_found() {
    let lib = rooms(&texts()["lib"]);
    for line in [
        "use crate::cull::inputs::CullInputs;",
        "pub use crate::cull::inputs::CullInputs as Seen;",
        "use crate::{cull::inputs::CullInputs, error::Result};",
        "use crate::cull::{inputs::{self, CullInputs}};",
        "use super::super::cull::inputs::CullInputs;",
        "type Seen<'a> = crate::cull::inputs::CullInputs<'a>;",
        "macro_rules! seen { () => { $crate::cull::inputs::CullInputs } }",
    ] {
        let graph = graph(&with_line("pyramid::layout", line));
        let found = upward(&graph, &lib);
        assert_eq!(found, [("pyramid::layout".to_owned(), "cull::inputs".to_owned())], "{line}");
        assert!(circle(&graph).is_some(), "the cull reads the pyramid's layout");
    }
    for line in [
        "use crate::gpu::device::Gpu;",
        "use crate::gpu::{device::Gpu};",
        "use super::device::Gpu;",
        "use super::{device::Gpu};",
    ] {
        let found = circle(&graph(&with_line("gpu::checked", line)));
        let found = found.unwrap_or_else(|| panic!("{line}: gpu::device checks what it makes"));
        assert!(found.contains(&"gpu::checked".to_owned()), "{found:?}");
    }
    let from_root = graph(&with_line("pyramid", "use super::cull::inputs::CullInputs;"));
    assert_eq!(upward(&from_root, &lib), [("pyramid".to_owned(), "cull::inputs".to_owned())]);
}

/// What `lib.rs` exports may come from any room, so no module takes it from there.
#[test]
#[should_panic(expected = "pyramid::layout imports \"CullOptions\" from the crate's face")]
fn imports_from_the_face_are_found() {
    graph(&with_line("pyramid::layout", "use crate::CullOptions;"));
}
