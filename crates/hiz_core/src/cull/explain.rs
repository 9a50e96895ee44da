//! The explanation of a single verdict: the cull's own steps, repeated for one instance.

use crate::cull::groups::group_key;
use crate::cull::inputs::{CullInputs, PreparedView};
use crate::cull::pipelines::{
    CullKey, Decision, DepthStore, TWO_STORAGES, classify_constants, decision_module, layouts,
};
use crate::cull::shadow::check_no_shadow;
use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::input::bounds::BoundsKind;
use crate::instances::batch::GROUP;
use crate::instances::piece::{RECORD_BINDINGS, bind_records};

/// Twin: `shaders/cull/explain.wgsl`, `Explanation`, which documents the fields.
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
    pub(crate) nearest_bits: u32,
    pub(crate) padding: [u32; 3],
}

/// The step at which a test stopped; twin: `shaders/cull/outcome.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub(crate) enum Stage {
    /// The bounds are invalid.
    Validity = 0,
    /// The volume is outside a plane of the frustum.
    Frustum = 1,
    /// The volume crosses the plane of the eye.
    EyePlane = 2,
    /// At the rectangle of pixels.
    Rectangle = 3,
    /// At the comparison with the farthest depth of the footprint.
    Depth = 4,
    /// At the certificate that the texels cover the projection.
    Block = 5,
    /// Within the descent.
    Descent = 6,
    /// No stored level fits the footprint.
    Level = 7,
    /// At the certificate that the texels cover the projection of what is before all of them.
    Front = 8,
}

impl Stage {
    /// All stages, in the order of their codes.
    pub(crate) const ALL: [Self; 9] = [
        Self::Validity,
        Self::Frustum,
        Self::EyePlane,
        Self::Rectangle,
        Self::Depth,
        Self::Block,
        Self::Descent,
        Self::Level,
        Self::Front,
    ];
}

impl ExplanationRecord {
    /// The stage at which the test stopped.
    pub(crate) fn stage(&self) -> Stage {
        Stage::ALL.get(self.stage as usize).copied().unwrap_or(Stage::Validity)
    }
}

/// A texel that was read: its level and flags, column, row, and the bits of its depth.
pub(crate) type Reading = [u32; 4];

/// The bits of a reading's first word that hold the level.
/// The others are flags (`shaders/cull/explain.wgsl`).
pub(crate) const LEVEL_MASK: u32 = 0xFF;
pub(crate) const BEHIND: u32 = 0x100;
pub(crate) const CLEAR: u32 = 0x200;

/// How many readings an explanation holds at most.
/// A descent may read 65,536 texels; those past this number are only counted.
pub(crate) const TEXELS_NOTED: usize = 4096;

/// The shader that explains one instance's verdict.
pub(crate) fn explain_module(store: DepthStore, kind: BoundsKind) -> Source {
    decision_module(store, kind, Decision::Seen.files(), &[wgsl!("cull/explain")])
}

/// The pipeline of the explanation.
fn explain_pipeline(gpu: &Gpu, key: &CullKey) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.explain.pipeline",
        source: explain_module(key.store, key.kind),
        entry_point: "explain",
        layouts: &layouts(gpu, key.store, RECORD_BINDINGS, ("hiz.storage_layout", TWO_STORAGES))?,
        constants: &classify_constants(key),
    })
}

/// Records the explanation of instance `index`, or of the box around it in a tier: 0 is that of its
/// group.
///
/// It goes into two storage buffers: `target`, an `ExplanationRecord`, and `readings`, as many
/// [`Reading`]s as fit.
pub(crate) fn record_explain(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    (index, tier): (u32, Option<usize>),
    [target, readings]: [&wgpu::Buffer; 2],
) -> Result<()> {
    let instances = inputs.instances;
    check_no_shadow(inputs.options, "an explanation")?;
    let piece = instances.pieces.iter().find(|p| p.range.contains(&index)).ok_or_else(|| {
        Error::invalid(
            "index",
            format!("expected an instance below {}, got {index}", instances.len()),
        )
    })?;
    // The test of an instance is explained whether or not it was asked for.
    let mut seen = PreparedView::new(gpu, &CullInputs { among: None, ..*inputs }, None)?;
    let place = piece.order.place((index - piece.range.start) as usize);
    let mut view = seen.bind(gpu, inputs.pyramid, tier.is_some())?;
    let (which, records) = match tier {
        None => (place, &piece.records),
        Some(tier) => {
            seen.key = group_key(seen.key);
            let upper = tier.checked_sub(1).map(|above| &piece.upper[above].records);
            (place / GROUP.pow(tier as u32 + 1), upper.unwrap_or(&piece.group_records))
        }
    };
    let which = gpu.uniform("hiz.explain.which", &[which as u32, 0, 0, 0])?;
    let output = gpu.bind_group(
        "hiz.explain.target",
        &gpu.layout("hiz.storage_layout", TWO_STORAGES)?,
        &[entry(0, target.as_entire_binding()), entry(1, readings.as_entire_binding())],
    )?;
    let (pipeline, records) =
        (explain_pipeline(gpu, &seen.key)?, bind_records(gpu, &which, records)?);
    view.record(encoder, inputs.pyramid);
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some("hiz.explain.pass"),
        timestamp_writes: None,
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, view.groups.as_ref().unwrap_or(&view.instances), &[]);
    pass.set_bind_group(1, &records, &[]);
    pass.set_bind_group(2, &output, &[]);
    pass.dispatch_workgroups(1, 1, 1);
    Ok(())
}
