//! Culls for several views in one recording, and what any of them keeps.

use crate::cull::among::Among;
use crate::cull::inputs::CullInputs;
use crate::cull::options::CullOptions;
use crate::cull::record::record_cull;
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::views::Joined;
use crate::output::visible::Visible;
use crate::pyramid::Pyramid;
use crate::pyramid::built::Built;

/// One view of [`HizContext::record_cull_views`](crate::HizContext::record_cull_views).
/// Views may differ in size and in depth convention.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// The camera of the pyramid.
    pub camera: &'a Camera,
    /// Built from a depth image of the camera.
    pub pyramid: &'a Pyramid,
}

/// What all views of one recording have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ViewsInputs<'a> {
    pub(crate) instances: &'a Instances,
    pub(crate) views: &'a [View<'a>],
    pub(crate) among: Option<&'a Among>,
    pub(crate) options: &'a CullOptions,
    /// As `CullInputs::idle`.
    pub(crate) idle: bool,
    /// As `CullInputs::built`.
    pub(crate) built: Option<&'a Built>,
}

/// Records the culls of all views, then what joins their masks.
pub(crate) fn record_cull_views(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &ViewsInputs<'_>,
    each: &[&Visible],
    joined: &Joined,
) -> Result<()> {
    let ViewsInputs { instances, views, among, options, idle, built } = *inputs;
    gpu.check_context("visible", joined.any.context)?;
    if views.len() != joined.views {
        return Err(Error::mismatch(
            "views",
            format!("expected {} views, as the buffers are for, got {}", joined.views, views.len()),
        ));
    }
    if !joined.any.counts().iter().copied().eq(instances.pieces.iter().map(Piece::count)) {
        return Err(Error::mismatch(
            "visible",
            "expected buffers that were created for these instances, got others",
        ));
    }
    let join = joined.prepare(gpu, instances, each)?;
    for (View { camera, pyramid }, visible) in views.iter().zip(each) {
        let inputs = CullInputs {
            among,
            idle,
            built,
            ..CullInputs::new(instances, camera, pyramid, options)
        };
        record_cull(gpu, encoder, &inputs, visible)?;
    }
    gpu.recorded(|| {
        join.record(encoder, idle);
        Ok(())
    })
}
