//! The flat cull of boxes without certificates, in the same frame.

use crate::bounds::BoundsKind;
use crate::camera::Camera;
use crate::cull::{self, CullInputs, CullOptions, Hierarchy};
use crate::error::{Error, Result};
use crate::headless::Engine;
use crate::instances::Instances;
use crate::pyramid::Pyramid;
use crate::readback::{self, BufferRange};
use crate::visible::Visible;

/// Records the cull of `instances`, boxes, as one would write it who trusts float32: it hides what
/// can be seen.
/// Of the options order and footprint count.
///
/// # Errors
/// As [`HizContext::record_cull`](crate::HizContext::record_cull), and [`Error::Invalid`] for other
/// volumes.
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
    let inputs = CullInputs { instances, camera, pyramid, options, certified: false, idle: false };
    cull::record(&engine.context().gpu, encoder, &inputs, visible)
}

/// Whether each instance is kept, by the mask of the last cull into `visible`: what a yardstick
/// hides is counted beside its time.
///
/// # Errors
/// [`Error::Mismatch`] where there is no mask, [`Error::DeviceLost`].
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
