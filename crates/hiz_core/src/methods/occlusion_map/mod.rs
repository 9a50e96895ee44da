//! Hierarchical occlusion maps, whole, as their text has them.
//!
//! Source: Zhang, Manocha, Hudson and Hoff, *Visibility culling using hierarchical occlusion maps*
//! (SIGGRAPH 1997), as Moller and Haines, *Real-Time Rendering* (1999), section 9.5, retell it.
//!
//! 1. `select` chooses the occluders of a view from a database, by size and distance.
//! 2. They are drawn in white on black, without a Z-buffer; `levels` averages the image down.
//! 3. `estimate` keeps one depth for each of 64x64 regions: the farthest vertex of the boxes of the
//!    occluders there.
//! 4. `cull` projects the bounds of an instance.
//!    It asks the maps whether the rectangle is covered, and the regions whether it lies behind.
//!
//! `options` says how maps are made, and `map` holds them.
//!
//! Averages are kept as whole numbers of covered pixels, so no byte rounds them.
//!
//! **What it cannot promise.**
//! With a negligible hole of 0 pixels, an instance is culled only under two conditions.
//! Every pixel of its rectangle is covered, and it lies behind the boxes of all occluders there.
//! So none of the image's pixel centres shows it.
//! A larger image may show it beside an occluder that covers a centre alone.
//! With a larger hole it may also show through that hole.

mod cull;
mod estimate;
pub mod fault;
mod levels;
mod map;
mod options;
mod select;

pub use crate::methods::occlusion_map::cull::{MapCull, MapSeen};
pub use crate::methods::occlusion_map::map::OcclusionMap;
pub use crate::methods::occlusion_map::options::MapOptions;
