//! WGSL files, and the shader modules that consist of them.
//!
//! A module is the concatenation of its files; there is no preprocessor.

use std::hash::{Hash, Hasher};

/// A file in `shaders/`.
///
/// Files with the same path are equal.
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

/// The file with this path below `shaders/`, given without its extension.
///
/// `build.rs` sets `HIZ_SHADERS` to that folder.
macro_rules! wgsl {
    ($path:literal) => {
        $crate::gpu::shader::File {
            path: $path,
            text: include_str!(concat!(env!("HIZ_SHADERS"), "/", $path, ".wgsl")),
        }
    };
}
pub(crate) use wgsl;

/// A shader module as a list of files.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Source(Vec<File>);

impl Source {
    /// The module that consists of the files of all `parts`, in their order.
    pub(crate) fn of(parts: &[&[File]]) -> Self {
        Self(parts.concat())
    }

    #[cfg(test)]
    pub(crate) fn files(&self) -> &[File] {
        &self.0
    }

    /// The WGSL text of the module.
    pub(crate) fn text(&self) -> String {
        self.0.iter().map(|file| file.text).collect::<Vec<_>>().join("\n")
    }
}

#[cfg(any(test, feature = "testing"))]
include!(concat!(env!("OUT_DIR"), "/shader_files.rs"));
