//! The bind groups of the depth images that a stage has read last.

use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::kept::KeptBindings;
use crate::gpu::layouts::Binding;
use crate::pyramid::reduce::refused;
use crate::pyramid::source::{KEPT_IMAGES, Part, Subresource};

/// The bind groups of the last [`KEPT_IMAGES`] depth images.
#[derive(Debug)]
pub(super) struct Sources(KeptBindings<(Subresource, SourceKind)>);

/// What a stage binds of a depth image: labels, bindings, and the entries behind the image's.
pub(super) struct Binds<'a> {
    pub(super) label: &'a str,
    pub(super) layout: &'a str,
    pub(super) bindings: &'a [(u32, Binding)],
    pub(super) rest: &'a [wgpu::BindGroupEntry<'a>],
}

impl Sources {
    pub(super) fn new() -> Self {
        Self(KeptBindings::new(KEPT_IMAGES))
    }

    /// The bind group of the image of `part`, whose view is binding 0.
    ///
    /// # Errors
    /// [`refused`] ones, for a texture that was destroyed and for one of another device.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        part: &Part,
        kind: SourceKind,
        binds: &Binds<'_>,
    ) -> Result<wgpu::BindGroup> {
        let key = (part.subresource.clone(), kind);
        if let Some(kept) = self.0.find(&key) {
            // A bind group does not tell that its texture was destroyed since, but a new view does.
            gpu.view(&part.subresource.texture).map_err(refused)?;
            return Ok(kept);
        }
        let view = part.subresource.view(gpu).map_err(refused)?;
        let mut entries = vec![entry(0, wgpu::BindingResource::TextureView(&view))];
        entries.extend_from_slice(binds.rest);
        let layout = gpu.layout(binds.layout, binds.bindings)?;
        let bound = gpu.bind_group(binds.label, &layout, &entries).map_err(refused)?;
        self.0.get(key, || Ok(bound))
    }
}
