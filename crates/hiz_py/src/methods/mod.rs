//! The algorithms of the texts, for comparisons; no certified call reaches them.

pub(crate) mod hierarchy;
mod levels;
pub(crate) mod maps;
mod texts;
pub(crate) mod tiling;

pub(crate) use levels::MethodLevels;
pub(crate) use texts::TextCull;
