//! Says where the shaders lie, and lists them.
//!
//! In the repository they are at its top level.
//! A package holds no file from above its manifest, so it carries them beside `src/`;
//! `scripts/package.sh` puts them there.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// A file that only this crate's shaders have.
const KNOWN: &str = "cull/classify.wgsl";

fn main() {
    let here = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let places = [here.join("../../shaders"), here.join("shaders")];
    let shaders = places.iter().find(|place| place.join(KNOWN).is_file()).unwrap_or_else(|| {
        panic!("no shaders in {} or {}", places[0].display(), places[1].display())
    });
    let mut files = Vec::new();
    list(shaders, String::new(), &mut files);
    files.sort();
    let entries: String = files.iter().map(|path| format!("    wgsl!({path:?}),\n")).collect();
    let text = format!(
        "/// Every file below `shaders/`.\npub(crate) const FILES: &[File] = &[\n{entries}];\n"
    );
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("set by cargo"));
    fs::write(out.join("shader_files.rs"), text).expect("the list of shaders");
    println!("cargo::rustc-env=HIZ_SHADERS={}", shaders.display());
    println!("cargo::rerun-if-changed={}", shaders.display());
}

/// The paths of all WGSL files below `folder`, without their extension.
fn list(folder: &Path, prefix: String, files: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder of shaders") {
        let entry = entry.expect("a folder of shaders");
        let name = entry.file_name().into_string().expect("a name in ASCII");
        if entry.path().is_dir() {
            list(&entry.path(), format!("{prefix}{name}/"), files);
        } else if let Some(stem) = name.strip_suffix(".wgsl") {
            files.push(format!("{prefix}{stem}"));
        }
    }
}
