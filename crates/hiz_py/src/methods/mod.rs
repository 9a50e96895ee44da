//! The texts' own methods.

pub(crate) mod maps;
pub(crate) mod tiling;
