//! What a pyramid was last built from.
//!
//! It is a file of its own because both the reduction and the atlas need it.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::pyramid::host_levels::{HostLevels, InPlace};
use crate::pyramid::source::Part;

/// What a depth image was drawn with: while it is alive, the image is not drawn again.
pub(crate) trait Owner: std::fmt::Debug + Send + Sync {
    /// Held by those who submit commands that read or write the image, while they record them.
    fn submitting(&self) -> &Locked<()>;

    /// What the host has made with the image.
    fn levels(&self) -> Option<&HostLevels>;
}

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
    /// Where culls may read in place of pyramid and image, if the host has made both.
    pub(crate) in_place: Option<InPlace>,
    /// Keeps the image as it is for those who read it later.
    pub(crate) owner: Option<Arc<dyn Owner>>,
}

impl Built {
    /// The same for those who read many pixels: a texture gives four of them at once.
    pub(crate) fn by_texture(self) -> Self {
        let is_there = |all: &InPlace| all.is_in_texture.load(Ordering::Acquire);
        let in_place = self.in_place.filter(|all| !is_there(all));
        Self { in_place, ..self }
    }
}
