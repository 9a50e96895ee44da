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
//! (`shaders/shared/certificate.wgsl`); whatever is uncertain stays visible.
//!
//! Everything up to here records into the caller's encoder on the caller's device: nothing submits,
//! polls or maps.
//! The [`headless`] module owns a device, submits and reads back.

pub mod headless;

mod atlas;
mod bounds;
mod camera;
mod compact;
mod context;
mod count;
mod cull;
mod depth;
mod error;
mod extent;
mod gpu;
mod groups;
mod host;
mod instances;
mod inverse;
mod layout;
mod lists;
mod morton;
mod occluder_surface;
mod occluders;
mod pyramid;
mod readback;
mod records;
mod shader;
mod threads;
mod tolerance;
mod update;
mod view;
mod visible;
mod watch;
#[doc(hidden)]
pub mod words;
#[doc(hidden)]
pub mod yardstick;

pub use wgpu;

pub use atlas::AtlasUse;
pub use bounds::{Bounds, BoundsKind, Floats};
pub use camera::{
    Camera, DepthConvention, ImageSize, MAX_IMAGE_SIDE, Mat3, Mat4, Pose, Projection, Vec3,
};
pub use context::HizContext;
pub use cull::{Coverage, CullOptions, Fit, Footprint, Hierarchy, Order};
pub use depth::{DepthKind, ndc_from_kind, ndc_from_kind_within};
pub use error::{Error, Result};
pub use instances::{InstanceOptions, Instances, StoredOrder};
pub use layout::{MAX_LEVELS, StoredLevels};
pub use lists::{CANARY_WORDS, DrawIndexedIndirect, DrawTemplate};
#[doc(hidden)]
pub use occluder_surface::PlantedFault;
pub use occluder_surface::{ConservativeDepthOptions, OccluderSurface};
pub use occluders::{FaceCull, MeshData, OCCLUDER_DEPTH_FORMAT, OccluderOptions, Occluders};
pub use pyramid::{Pyramid, PyramidOptions};
pub use tolerance::DepthTolerance;
pub use view::ERROR_ULPS;
pub use visible::{Outputs, Visible, VisibleOptions};

/// The README's program is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
mod readme {}
