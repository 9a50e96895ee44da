//! What a single call leaves for the next one.

use crate::pyramid::Pyramid;

/// The image and the pyramid of the last call, for the next one of the same size.
#[derive(Debug)]
pub(super) struct KeptDepth {
    pub(super) texture: wgpu::Texture,
    pub(super) view: wgpu::TextureView,
    pub(super) pyramid: Pyramid,
    pub(super) has_atlas: bool,
}
