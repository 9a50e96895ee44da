//! What makes lists and draws of the marks that a cull has left, without the cull.

use crate::error::Result;
use crate::headless::Engine;
use crate::instances::Instances;
use crate::output::compact::Compaction;
use crate::output::emit_passes::Emission;
use crate::output::visible::Visible;

/// Records the passes that follow the marking in an ordered cull into `visible`.
/// They make the same lists and draws again from the mask or the planes of the last cull.
///
/// # Errors
/// Those of [`HizContext::record_cull`](crate::HizContext::record_cull).
pub fn record_emission(
    engine: &Engine,
    encoder: &mut wgpu::CommandEncoder,
    instances: &Instances,
    visible: &Visible,
) -> Result<()> {
    let gpu = &engine.context().gpu;
    let compaction = match &visible.lists {
        Some(lists) => Some(Compaction::new(gpu, instances, visible, lists)?),
        None => None,
    };
    let emission = match &visible.bins {
        Some(bins) => Some(Emission::new(gpu, instances, bins)?),
        None => None,
    };
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    if let Some(compaction) = compaction {
        compaction.record(&mut pass, false);
    }
    if let Some(emission) = emission {
        emission.record(&mut pass, false);
    }
    Ok(())
}
