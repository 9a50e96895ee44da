//! The explanation of a single verdict: the cull's own steps for one instance.

use super::{CullInputs, Seen, group_key};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::groups::GROUP;
use crate::instances::bind_records;
use crate::pyramid::entry;

/// `shaders/explain.wgsl`, `Explanation`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ExplanationRecord {
    pub(crate) verdict: u32,
    pub(crate) stage: u32,
    pub(crate) level: u32,
    pub(crate) farthest_bits: u32,
    pub(crate) pixels: [i32; 4],
    pub(crate) depths: [f32; 4],
    pub(crate) last: Reading,
    pub(crate) texels_read: u32,
    pub(crate) of_footprint: u32,
    pub(crate) farthest_before: u32,
    pub(crate) any_before: u32,
}

/// A texel that was read: its level and flags, column, row, and the bits of its depth.
pub(crate) type Reading = [u32; 4];

/// Of a reading's first word, what is the level; and its flags (`shaders/explain.wgsl`).
pub(crate) const LEVEL_MASK: u32 = 0xFF;
pub(crate) const BEHIND: u32 = 0x100;
pub(crate) const CLEAR: u32 = 0x200;

/// How many readings an explanation tells at most.
/// A descent may read 65,536 texels; what comes after these is counted.
pub(crate) const TEXELS_TOLD: usize = 4096;

/// Records the explanation of instance `index`, or of the box around its group, into `target`, an
/// `ExplanationRecord`, and `readings`, as many [`Reading`]s as there is room for: both storage.
pub(crate) fn record_explain(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    (index, whole_group): (u32, bool),
    [target, readings]: [&wgpu::Buffer; 2],
) -> Result<()> {
    let instances = inputs.instances;
    let piece = instances.pieces.iter().find(|p| p.range.contains(&index)).ok_or_else(|| {
        Error::invalid(
            "index",
            format!("expected an instance below {}, got {index}", instances.len()),
        )
    })?;
    let mut seen = Seen::new(gpu, inputs, None)?;
    let place = piece.order.place((index - piece.range.start) as usize);
    let (which, records, view) = if whole_group {
        seen.key = group_key(seen.key);
        let view = seen.bind_for_groups(gpu, inputs.pyramid)?;
        (place / GROUP, &piece.group_records, view)
    } else {
        (place, &piece.records, seen.bind(gpu, inputs.pyramid)?)
    };
    let which = gpu.uniform("hiz.explain.which", &[which as u32, 0, 0, 0])?;
    let output = gpu.bind_group(
        "hiz.explain.target",
        &gpu.layouts().two_storages,
        &[entry(0, target.as_entire_binding()), entry(1, readings.as_entire_binding())],
    )?;
    let (pipeline, records) =
        (gpu.explain_pipeline(seen.key)?, bind_records(gpu, &which, records)?);
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some("hiz.explain.pass"),
        timestamp_writes: None,
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &view, &[]);
    pass.set_bind_group(1, &records, &[]);
    pass.set_bind_group(2, &output, &[]);
    pass.dispatch_workgroups(1, 1, 1);
    Ok(())
}
