//! The algorithms of the texts: conversions only.

pub(crate) mod hierarchy;
