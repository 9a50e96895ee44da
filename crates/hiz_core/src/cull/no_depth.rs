//! What a pass binds that reads no depth: an atlas without a reduction.
//!
//! Mesa 22.3's lavapipe compiles a cull that binds no depth anew at each dispatch, for 60 ms or for
//! 1 ms from its cache on disk.
//! With an atlas it compiles once.

use crate::cull::pipelines::NO_DEPTH;
use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;

/// The number of a reduction, which an empty atlas does not have.
/// So every test ends before it reads depth.
pub(crate) const NO_REDUCTION: u32 = 1;

/// Binds a pyramid's layout and a view, and the empty atlas.
pub(crate) fn bind_view(
    gpu: &Gpu,
    label: &'static str,
    pyramid: &wgpu::Buffer,
    view: &wgpu::Buffer,
) -> Result<wgpu::BindGroup> {
    gpu.bind_group(
        label,
        &NO_DEPTH.layout(gpu)?,
        &[
            entry(2, pyramid.as_entire_binding()),
            entry(3, wgpu::BindingResource::TextureView(gpu.no_atlas()?)),
            entry(6, view.as_entire_binding()),
        ],
    )
}
