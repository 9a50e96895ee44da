//! What a pyramid was last built from.
//!
//! It is a file of its own because both the reduction and the atlas need it.

use std::sync::Arc;

use crate::input::camera::Camera;
use crate::pyramid::source::Part;

/// Whatever keeps a depth image from being drawn again while it is alive.
pub(crate) trait Owner: std::fmt::Debug + Send + Sync {}
impl<T: std::fmt::Debug + Send + Sync> Owner for T {}

/// The depth image of a reduction, and what a cull has to know about it.
#[derive(Debug, Clone)]
pub(crate) struct Built {
    /// The number of the reduction, or of the drawing whose levels were copied.
    ///
    /// Once that has run, the pyramid's header holds it.
    pub(crate) reduction: u32,
    pub(crate) source: wgpu::TextureView,
    /// The image of the nearest samples, where `source` has the farthest of several.
    pub(crate) nearest: Option<wgpu::TextureView>,
    /// Where the image lies in its texture, and what was rounded in it: every cull counts that.
    pub(crate) part: Part,
    pub(crate) camera: Camera,
    /// Keeps the image as it is for those who read it later.
    pub(crate) owner: Option<Arc<dyn Owner>>,
}
