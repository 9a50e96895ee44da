//! The algorithms of the texts, each as its text has it, to compare with the library's own.
//!
//! Each file opens with its source.
//! Nothing outside this room imports it, so no certified call reaches it; `tests/rooms.rs` checks
//! that.

pub mod occlusion_map;
mod seen;
pub mod tiling;
