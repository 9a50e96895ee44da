//! A flat cull of boxes without certificates, recorded in the same pass as the library's own.

use crate::cull::inputs::CullInputs;
use crate::cull::options::{CullOptions, Hierarchy};
use crate::cull::pipelines::{
    CullKey, DepthStore, EmitKey, FramePass, ReportKey, decision_module, flat_files, flat_pipeline,
};
use crate::cull::record::record_cull_by;
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::shader::{Source, wgsl};
use crate::headless::Engine;
use crate::headless::readback::{self, BufferRange};
use crate::input::bounds::BoundsKind;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::output::visible::Visible;
use crate::pyramid::Pyramid;

/// The shader of the flat cull of boxes without certificates.
pub(crate) fn uncertified_module(store: DepthStore) -> Source {
    // The bounds' shader files use the types of the supporting planes, which this cull never tests.
    let classify = [wgsl!("cull/supporting_planes"), wgsl!("yardstick/classify_uncertified")];
    decision_module(
        store,
        BoundsKind::Box,
        &classify,
        &flat_files(EmitKey::NO_LIST, FramePass::Alone),
    )
}

fn uncertified_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    report: &ReportKey,
) -> Result<wgpu::ComputePipeline> {
    flat_pipeline(gpu, "hiz.yardstick.cull", uncertified_module(key.store), key, report)
}

/// Records a cull of `instances`, which must be boxes, that trusts float32.
/// It has no margins, so it hides some instances that can be seen.
/// Of the options, only order and footprint have an effect.
///
/// # Errors
/// Those of [`HizContext::record_cull`](crate::HizContext::record_cull), and [`Error::Invalid`] for
/// other bounds than boxes.
pub fn record_uncertified_cull(
    engine: &Engine,
    encoder: &mut wgpu::CommandEncoder,
    instances: &Instances,
    camera: &Camera,
    pyramid: &Pyramid,
    visible: &Visible,
    options: &CullOptions,
) -> Result<()> {
    if instances.kind() != BoundsKind::Box {
        return Err(Error::invalid(
            "instances",
            format!("expected boxes, got {:?}", instances.kind()),
        ));
    }
    let options =
        &CullOptions { hierarchy: Hierarchy::Never, statistics: false, ..options.clone() };
    let inputs = CullInputs::new(instances, camera, pyramid, options);
    record_cull_by(&engine.context().gpu, encoder, &inputs, visible, uncertified_pipeline)
}

/// Whether each instance is kept, by the mask of the last cull into `visible`.
/// A benchmark counts what a yardstick hides beside its time.
///
/// # Errors
/// - [`Error::Mismatch`] for a cull without a mask.
/// - [`Error::DeviceLost`].
pub fn read_mask(engine: &Engine, visible: &Visible) -> Result<Vec<bool>> {
    if !visible.outputs().mask {
        let got = visible.outputs();
        return Err(Error::mismatch(
            "outputs",
            format!("expected a cull that was asked for mask, got one with {got}"),
        ));
    }
    let planes: Vec<_> = visible
        .pieces
        .iter()
        .zip(visible.counts())
        .map(|(piece, count)| BufferRange::first(&piece.mask, 4 * u64::from(count.div_ceil(32))))
        .collect();
    let planes = readback::read_buffers(engine.device(), engine.queue(), &planes)?;
    let bits = |(plane, count): (Vec<u8>, &u32)| {
        (0..*count as usize).map(move |i| plane[i / 8] >> (i % 8) & 1 == 1).collect::<Vec<_>>()
    };
    Ok(planes.into_iter().zip(visible.counts()).flat_map(bits).collect())
}
