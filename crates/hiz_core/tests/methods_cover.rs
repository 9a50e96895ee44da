//! The texts' methods that work with coverage: occlusion maps, and tiling in BSP order.
//!
//! No device is needed.

mod common;
#[path = "methods_cover/occlusion_map.rs"]
mod occlusion_map;
#[path = "methods_cover/tiling.rs"]
mod tiling;
