//! Certified hierarchical-Z occlusion culling on wgpu.
//!
//! Data flows one way:
//!
//! 1. [`Camera`] says, in float64, what is seen; [`DepthKind`] what a depth image's numbers mean;
//!    [`Bounds`] where the instances are.
//! 2. [`Occluders`] are drawn into a depth texture, or the caller brings one; their
//!    [`OccluderSurface`] gives a small depth image that holds for larger ones.
//! 3. [`HizContext::record_reduce`] builds the [`Pyramid`]: the farthest depth of every block of
//!    pixels.
//! 4. [`HizContext::record_cull`] decides for each of the [`Instances`], whole groups first where
//!    they are many, and lists the kept ones in [`Visible`]; the list's length is the
//!    `instance_count` of a [`DrawIndexedIndirect`] record on the device.
//! 5. The caller draws with [`Visible::draw_arguments`]; nothing visits the CPU.
//!
//! The promise: an instance is culled only if, for the exact real numbers that the inputs denote,
//! every pixel that its bounds can touch holds a depth nearer than all of the bounds.
//! It is kept by *certificates* computed in float32 with margins that cover every rounding
//! (`shaders/cull/certificate.wgsl`); whatever is uncertain stays visible.
//!
//! Everything up to here records into the caller's encoder on the caller's device: nothing submits,
//! polls or maps.
//! The [`headless`] module owns a device, submits and reads back.

// What only a readback asks for is idle in an embedder's build.
#![cfg_attr(not(feature = "headless"), allow(dead_code))]

// The rooms, in the order of the data: each imports only what stands above it here
// (`tests/rooms.rs`). Empty lines keep rustfmt from sorting them.
mod error;

mod host;

mod input;

mod gpu;

mod pyramid;

mod occluders;

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

/// The README's program is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
mod readme {}

/// And so are those of the page for Rust.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/rust.md")]
mod rust_page {}
