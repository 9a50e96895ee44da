//! What a pyramid was last built from.

use crate::gpu::depth_source::SourceKind;
use crate::input::camera::Camera;
use crate::input::tolerance::DepthTolerance;

/// What a pyramid was last built from.
#[derive(Debug, Clone)]
pub(crate) struct Built {
    /// The number of the reduction, which stands in the pyramid's header once it has run.
    pub(crate) reduction: u32,
    pub(crate) source: wgpu::TextureView,
    pub(crate) source_kind: SourceKind,
    pub(crate) camera: Camera,
    /// What the image's depths have been rounded by, for every cull to count.
    pub(crate) tolerance: DepthTolerance,
}
