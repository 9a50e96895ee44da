//! For tests: the words that the cull shader reads, so that its arithmetic can be done again on the host.

use crate::bounds::Bounds;
use crate::camera::Camera;
use crate::cull::{CullOptions, ViewUniform};
use crate::error::Result;

/// The view's uniform (`shaders/shared/view.wgsl`, `View`) as 32-bit words. The number of the reduction is 0.
///
/// # Errors
/// As `HizContext::record_cull`, for options and cameras that it refuses.
pub fn view(camera: &Camera, options: &CullOptions) -> Result<Vec<u32>> {
    Ok(bytemuck::cast_slice(&[ViewUniform::new(camera, 0, options)?]).to_vec())
}

/// The records of all instances (`shaders/shared/bounds_*.wgsl`) as 32-bit words.
///
/// # Errors
/// As [`Bounds::len`].
pub fn instances(bounds: &Bounds<'_>) -> Result<Vec<u32>> {
    let mut bytes = Vec::new();
    bounds.pack(0..bounds.len()?, &mut bytes, &mut Vec::new());
    Ok(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}
