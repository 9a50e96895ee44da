//! What a pyramid was last built from.
//!
//! It is a file of its own because both the reduction and the atlas need it.

use std::sync::Arc;

use crate::gpu::depth_source::SourceKind;
use crate::input::camera::Camera;
use crate::input::tolerance::DepthTolerance;

/// Whatever keeps a depth image from being drawn again while it is alive.
pub(crate) trait Owner: std::fmt::Debug + Send + Sync {}
impl<T: std::fmt::Debug + Send + Sync> Owner for T {}

/// The depth image of a reduction, and what a cull has to know about it.
#[derive(Debug, Clone)]
pub(crate) struct Built {
    /// The number of the reduction; once that has run, the pyramid's header holds it.
    pub(crate) reduction: u32,
    pub(crate) source: wgpu::TextureView,
    pub(crate) source_kind: SourceKind,
    pub(crate) camera: Camera,
    /// The rounding of the image's depths, which every cull takes into account.
    pub(crate) tolerance: DepthTolerance,
    /// Keeps the image as it is for those who read it later.
    pub(crate) owner: Option<Arc<dyn Owner>>,
}
