//! WGSL files, and the modules that are made of them.
//! A module is its files one after the other: there is no preprocessor.

use std::hash::{Hash, Hasher};

/// A file below `shaders/`.
/// Two of the same path are the same file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct File {
    pub(crate) path: &'static str,
    pub(crate) text: &'static str,
}

impl PartialEq for File {
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path
    }
}

impl Eq for File {}

impl Hash for File {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.path.hash(state);
    }
}

/// The file of a path without its extension; `build.rs` says where `shaders/` lies.
macro_rules! wgsl {
    ($path:literal) => {
        $crate::gpu::shader::File {
            path: $path,
            text: include_str!(concat!(env!("HIZ_SHADERS"), "/", $path, ".wgsl")),
        }
    };
}
pub(crate) use wgsl;

/// A module as the files that it consists of.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Source(Vec<File>);

impl Source {
    /// The files of all `parts`, in their order.
    pub(crate) fn of(parts: &[&[File]]) -> Self {
        Self(parts.concat())
    }

    /// The text.
    pub(crate) fn text(&self) -> String {
        self.0.iter().map(|file| file.text).collect::<Vec<_>>().join("\n")
    }
}

#[cfg(any(test, feature = "testing"))]
include!(concat!(env!("OUT_DIR"), "/shader_files.rs"));
