//! Certified hierarchical-Z occlusion culling on wgpu.
//!
//! The data flows one way, and the steps in this crate are folders of the same names:
//!
//! 1. **Input** (`input`).
//!    A [`Camera`] describes in float64 what is seen.
//!    A [`DepthKind`] says what the numbers of a depth image mean, and [`Bounds`] say where the
//!    instances are.
//! 2. **Occluders** (`occluders`).
//!    [`Occluders`] are drawn into a depth texture, or the caller brings a depth texture.
//!    Their [`OccluderSurface`] makes a small depth image that also holds for larger images.
//! 3. **Pyramid** (`pyramid`).
//!    [`HizContext::record_reduce`] builds the [`Pyramid`]: for each level, the farthest depth of
//!    every block of pixels.
//! 4. **Instances** (`instances`).
//!    [`HizContext::record_instances`] uploads the bounds as [`Instances`], in groups of 64
//!    neighbours.
//! 5. **Output** (`output`).
//!    [`HizContext::create_visible`] makes the buffers of a [`Visible`], which take what a cull
//!    finds.
//! 6. **Cull** (`cull`).
//!    [`HizContext::record_cull`] tests the instances against the pyramid; if there are many, it
//!    tests whole groups first.
//!    The list of kept instances goes to [`Visible`].
//!    Its length is the `instance_count` of a [`DrawIndexedIndirect`] record on the device.
//! 7. **Draw**.
//!    The caller draws with [`Visible::draw_arguments`], and no number visits the CPU.
//!
//! [`HizContext`] in `context` is the face of these steps, and a Rust renderer starts there.
//! It only records into the caller's encoder on the caller's device: it never submits, polls or
//! maps.
//! [`headless`] is for programs without a renderer: it owns a device, submits, waits and reads
//! back.
//!
//! Two folders serve the others: `host` has arithmetic, memory and threads, and `gpu` makes objects
//! on the device.
//!
//! # The promise
//!
//! An instance is culled only if every pixel that its bounds can touch holds a depth nearer than
//! all of the bounds.
//! This holds for the exact real numbers that the inputs denote.
//! The cull proves it with *certificates*: float32 comparisons whose margins cover every rounding
//! (`shaders/cull/certificate.wgsl`).
//! Whatever they cannot prove stays visible.

// Some items serve only a readback, so a build without `headless` never uses them.
#![cfg_attr(not(feature = "headless"), allow(dead_code))]

// The rooms, in the order of the data: each imports only what stands above it here
// (`tests/rooms.rs`). Empty lines keep rustfmt from sorting them.
mod error;

mod host;

mod input;

mod gpu;

mod occluders;

mod pyramid;

mod instances;

mod output;

mod cull;

mod context;

#[cfg(feature = "headless")]
pub mod headless;

#[cfg(feature = "yardstick")]
pub mod yardstick;

#[cfg(feature = "testing")]
pub mod testing;

pub use wgpu;

pub use context::HizContext;
pub use cull::options::{Coverage, CullOptions, Fit, Footprint, Hierarchy, Order};
pub use error::{Error, Result};
pub use host::linear::{Mat3, Mat4, Vec3};
pub use input::bounds::{Bounds, BoundsKind, Floats};
pub use input::camera::Camera;
pub use input::depth::{DepthKind, ndc_from_kind, ndc_from_kind_within};
pub use input::image::{DepthConvention, ImageSize, MAX_IMAGE_SIDE};
pub use input::mesh::{FaceCull, MeshData};
pub use input::projection::{Pose, Projection};
pub use input::tolerance::DepthTolerance;
pub use input::view::ERROR_ULPS;
pub use instances::order::StoredOrder;
pub use instances::{InstanceOptions, Instances};
pub use occluders::raster::OCCLUDER_DEPTH_FORMAT;
pub use occluders::surface::{ConservativeDepthOptions, OccluderSurface};
pub use occluders::{OccluderOptions, Occluders};
pub use output::draw::{DrawIndexedIndirect, DrawTemplate};
pub use output::outputs::Outputs;
pub use output::verdict::Verdict;
pub use output::visible::Visible;
pub use pyramid::atlas::AtlasUse;
pub use pyramid::levels::{MAX_LEVELS, StoredLevels};
pub use pyramid::{Pyramid, PyramidOptions};

/// Compiles and runs the program in the README with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
mod readme {}

/// Compiles and runs the programs in the page for Rust with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/rust.md")]
mod rust_page {}
