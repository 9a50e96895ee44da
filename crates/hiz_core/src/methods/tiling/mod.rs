//! Tiling without depths: polygons front to back against a pyramid of coverage bits.
//!
//! Source: Greene, *Hierarchical polygon tiling with coverage masks* (SIGGRAPH 1996): convex
//! polygons are traversed front to back in the order of a BSP tree (Fuchs, Kedem and Naylor 1980),
//! or of an octree of BSP trees where one tree splits too much.
//! What is drawn first is visible, so a bit for each pixel takes the place of a depth.
//!
//! 1. `bsp` makes the tree of static triangles, and splits those that cross its planes.
//! 2. `walk` goes through it front to back, and leaves out what lies behind full squares.
//! 3. `cover` is the pyramid: a bit for each pixel, and a bit for each full square of 8x8 below.
//!
//! A part of a split triangle is the triangle with the lines along which it was cut.
//! Its corners would be rounded to the grid otherwise, and cracks would open.
//! So the parts cover what the triangle covers, each pixel once.
//! The image's coverage is that of the library's rasteriser bit for bit.
//!
//! A far plane cuts nothing here: what lies beyond it covers pixels, too.

mod bsp;
mod cover;
mod depth_tiles;
pub mod fault;
mod walk;

pub use crate::methods::tiling::bsp::{BspOptions, BspTree};
pub use crate::methods::tiling::depth_tiles::DepthTiles;
pub use crate::methods::tiling::walk::Tiled;
