//! The algorithms of the texts, each as its text has it, to compare with the library's own.
//!
//! Each file opens with its source.
//! Nothing outside this room imports it, so no certified call reaches it; `tests/rooms.rs` checks
//! that.

mod coarse_level;
mod fragment_levels;
pub mod hierarchy;
pub mod occlusion_map;
mod seen;
mod texts;
pub mod tiling;

#[cfg(test)]
pub(crate) use coarse_level::TILE;
#[cfg(feature = "testing")]
pub(crate) use coarse_level::coarse_level_module;
pub use coarse_level::{LevelWay, MethodLevels, SHAPES};
#[cfg(feature = "testing")]
pub(crate) use fragment_levels::fragment_levels_module;
#[cfg(feature = "testing")]
pub(crate) use texts::texts_module;
pub use texts::{Text, TextCamera, TextCull};
#[cfg(test)]
pub(crate) use texts::{TextUniform, WORKGROUP as TEXT_WORKGROUP};
