//! The algorithms of the texts, for comparisons; no certified call reaches them.

pub(crate) mod hierarchy;
mod levels;
mod texts;

pub(crate) use levels::MethodLevels;
pub(crate) use texts::TextCull;
