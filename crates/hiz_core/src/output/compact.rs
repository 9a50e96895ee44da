//! The ordered compaction: from the mask to an ascending list and the draw's instance count.

use crate::error::{Error, Result};
use crate::gpu::buffers::{entry, made};
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::instances::Instances;
use crate::output::lists::{Copied, Lists};
use crate::output::visible::Visible;

/// Words of the mask that one workgroup of `scatter` turns into indices;
/// `shaders/output/compact.wgsl`.
pub(crate) const SCATTER_WORKGROUP: u32 = 64;

const LAYOUT: &str = "hiz.compact.layout";

/// The bindings of the compaction of a piece.
const BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Uniform),
    (1, Binding::Read),
    (2, Binding::Write),
    (3, Binding::Write),
    (4, Binding::Write),
    (5, Binding::Uniform),
];

/// The bindings of a compaction that copies the caller's records.
const COPY_BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Uniform),
    (1, Binding::Read),
    (2, Binding::Write),
    (3, Binding::Write),
    (4, Binding::Write),
    (5, Binding::Uniform),
    (6, Binding::Read),
];

/// The shader of the ordered compaction.
pub(crate) fn compact_module() -> Source {
    Source::of(&[&[wgsl!("instances/piece"), wgsl!("output/compact")]])
}

/// The shader of the ordered compaction that copies the caller's records.
pub(crate) fn copy_module() -> Source {
    let files = [wgsl!("instances/piece"), wgsl!("output/compact"), wgsl!("output/copy")];
    Source::of(&[&files])
}

fn compact_pipeline(
    gpu: &Gpu,
    entry_point: &'static str,
    copied: Option<&Copied>,
) -> Result<wgpu::ComputePipeline> {
    let (label, constants) = ("hiz.compact.pipeline", &[][..]);
    let Some(copied) = copied else {
        let layouts = &[gpu.layout(LAYOUT, BINDINGS)?];
        let source = compact_module();
        return gpu.compute_pipeline(&Compute { label, source, entry_point, layouts, constants });
    };
    let constants = &[("RECORD_WORDS", f64::from(copied.stride / 4))];
    let layouts = &[gpu.layout(LAYOUT, COPY_BINDINGS)?];
    gpu.compute_pipeline(&Compute { label, source: copy_module(), entry_point, layouts, constants })
}

/// The pipelines and bindings of the compaction of all pieces that have instances.
pub(crate) struct Compaction {
    scan: wgpu::ComputePipeline,
    scatter: wgpu::ComputePipeline,
    /// Per piece: its bindings and, if it has a list, how many workgroups scatter its indices.
    pieces: Vec<(wgpu::BindGroup, Option<u32>)>,
}

impl Compaction {
    pub(crate) fn new(
        gpu: &Gpu,
        instances: &Instances,
        visible: &Visible,
        lists: &Lists,
    ) -> Result<Self> {
        let of_pieces = instances.pieces.iter().zip(&visible.pieces).zip(&lists.pieces);
        let pieces =
            of_pieces.filter(|((piece, _), _)| piece.count() > 0).map(|((piece, output), list)| {
                let bind = || {
                    let mut entries = vec![
                        entry(0, piece.uniform.as_entire_binding()),
                        entry(1, output.mask.as_entire_binding()),
                        entry(2, list.bound().as_entire_binding()),
                        entry(3, lists.draws.as_entire_binding()),
                        entry(4, list.before.as_entire_binding()),
                        entry(5, lists.capacity_uniform.as_entire_binding()),
                    ];
                    let Some(copied) = &lists.copied else {
                        let layout = gpu.layout(LAYOUT, BINDINGS)?;
                        return gpu.bind_group("hiz.compact.piece", &layout, &entries);
                    };
                    entries.push(entry(6, copied.of_piece(piece)));
                    let layout = gpu.layout(LAYOUT, COPY_BINDINGS)?;
                    gpu.bind_group("hiz.compact.piece", &layout, &entries).map_err(|error| {
                        let message = format!("expected a buffer of this device, but {error}");
                        Error::mismatch("records", message)
                    })
                };
                Ok((
                    made(&list.bindings, bind)?.clone(),
                    list.indices.as_ref().map(|_| piece.words().div_ceil(SCATTER_WORKGROUP)),
                ))
            });
        let copied = lists.copied.as_ref();
        let scatter = if copied.is_some() { "copy_records" } else { "scatter" };
        Ok(Self {
            scan: compact_pipeline(gpu, "scan", copied)?,
            scatter: compact_pipeline(gpu, scatter, copied)?,
            pieces: pieces.collect::<Result<_>>()?,
        })
    }

    /// Records the compaction of every piece.
    ///
    /// The pieces go in order, because each needs the capacity that earlier pieces have left.
    /// `idle`: as `CullInputs::idle`.
    pub(crate) fn record(&self, pass: &mut wgpu::ComputePass<'_>, idle: bool) {
        let workgroups = |count: u32| if idle { 0 } else { count };
        for (bind_group, scattering) in &self.pieces {
            pass.set_bind_group(0, bind_group, &[]);
            pass.set_pipeline(&self.scan);
            pass.dispatch_workgroups(workgroups(1), 1, 1);
            if let Some(count) = scattering {
                pass.set_pipeline(&self.scatter);
                pass.dispatch_workgroups(workgroups(*count), 1, 1);
            }
        }
    }
}
