//! Masks that begin full: where few groups are hidden, all bits are set at first, and those of what
//! is culled are cleared.
//!
//! `shaders/cull/begin_mask.wgsl` says why.

use crate::cull::pipelines::{
    CullKey, MEMBER_BINDINGS, ReportKey, classify_constants, report_constants, settle_groups_module,
};
use crate::error::Result;
use crate::gpu::buffers::{entry, made};
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{Source, wgsl};
use crate::instances::piece::RECORD_BINDINGS;
use crate::output::survivors::GroupOutput;

/// Invocations of a workgroup; `shaders/cull/begin_mask.wgsl`.
pub(crate) const WORKGROUP: u32 = 64;

/// Words of the mask that an invocation sets; `shaders/cull/begin_mask.wgsl`.
pub(crate) const WORDS_OF_INVOCATION: u32 = 8;

const BEGIN_BINDINGS: &[(u32, Binding)] = &[(0, Binding::Write)];
const SETTLE_BINDINGS: &[(u32, Binding)] = &[(1, Binding::Read)];

/// The shader that chooses how a mask begins.
pub(crate) fn begin_mask_module() -> Source {
    Source::of(&[&[
        wgsl!("instances/piece"),
        wgsl!("instances/groups"),
        wgsl!("cull/parents"),
        wgsl!("cull/begin_mask"),
    ]])
}

/// The pipelines of the passes around the test of members.
#[derive(Debug, Clone)]
pub(super) struct FullMaskPipelines {
    begin: wgpu::ComputePipeline,
    settle: wgpu::ComputePipeline,
}

impl FullMaskPipelines {
    pub(super) fn new(gpu: &Gpu, key: &CullKey, report: &ReportKey) -> Result<Self> {
        let begin_layout = gpu.layout("hiz.begin_mask.layout", BEGIN_BINDINGS)?;
        let settle_layout = gpu.layout("hiz.settle_groups.layout", SETTLE_BINDINGS)?;
        let records = gpu.layout("hiz.cull.instances_layout", RECORD_BINDINGS)?;
        let written = gpu.layout("hiz.cull.visible_layout", report.pass.member_bindings())?;
        let looks = report.absent || key.among || report.verdicts;
        let begin = gpu.compute_pipeline(&Compute {
            label: "hiz.begin_mask.pipeline",
            source: begin_mask_module(),
            entry_point: "begin_mask",
            layouts: &[begin_layout, records.clone(), written.clone()],
            constants: &[("LOOKS_AT_ACCEPTED", flag(looks))],
        })?;
        let members = gpu.layout("hiz.cull_members.layout", MEMBER_BINDINGS)?;
        let absent = ("ABSENT", flag(report.absent));
        let settle = gpu.compute_pipeline(&Compute {
            label: "hiz.settle_groups.pipeline",
            source: settle_groups_module(key.store, key.kind, report.emit),
            entry_point: "settle_groups",
            layouts: &[settle_layout, records, written, members],
            constants: &[&classify_constants(key)[..], &report_constants(report), &[absent]]
                .concat(),
        })?;
        Ok(Self { begin, settle })
    }
}

/// The passes around the test of a piece's members.
pub(super) struct FullMask {
    pipelines: FullMaskPipelines,
    survivors: wgpu::BindGroup,
    verdicts: wgpu::BindGroup,
}

impl FullMask {
    pub(super) fn new(
        gpu: &Gpu,
        pipelines: FullMaskPipelines,
        output: &GroupOutput,
    ) -> Result<Self> {
        let survivors = made(&output.begin_bindings, || {
            let layout = gpu.layout("hiz.begin_mask.layout", BEGIN_BINDINGS)?;
            let survivors = output.tiers[0].survivors.as_entire_binding();
            gpu.bind_group("hiz.begin_mask.survivors", &layout, &[entry(0, survivors)])
        })?;
        let verdicts = made(&output.settle_bindings, || {
            let layout = gpu.layout("hiz.settle_groups.layout", SETTLE_BINDINGS)?;
            let verdicts = output.verdicts.as_entire_binding();
            gpu.bind_group("hiz.settle_groups.verdicts", &layout, &[entry(1, verdicts)])
        })?;
        Ok(Self { pipelines, survivors: survivors.clone(), verdicts: verdicts.clone() })
    }

    /// Records the choice, between the tests of groups and of members.
    ///
    /// The piece's records and outputs are bound.
    /// `words`: those of the mask, or 0 if nothing is to run.
    pub(super) fn record_begin(&self, pass: &mut wgpu::ComputePass<'_>, words: u32) {
        pass.set_pipeline(&self.pipelines.begin);
        pass.set_bind_group(0, &self.survivors, &[]);
        pass.dispatch_workgroups(words.div_ceil(WORKGROUP * WORDS_OF_INVOCATION), 1, 1);
    }

    /// Sets what settles the members of whole groups; the dispatch is indirect.
    pub(super) fn set_settle(&self, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_pipeline(&self.pipelines.settle);
        pass.set_bind_group(0, &self.verdicts, &[]);
    }
}
