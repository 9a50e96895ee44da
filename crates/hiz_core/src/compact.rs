//! The ordered compaction: from the mask to an ascending list and the draw's instance count.

use crate::error::Result;
use crate::gpu::Gpu;
use crate::instances::Instances;
use crate::lists::Lists;
use crate::pyramid::entry;
use crate::visible::Visible;

/// Words that one workgroup of `scatter` turns into indices; `shaders/compact.wgsl`.
const SCATTER_WORKGROUP: u32 = 64;

/// What the compaction of the pieces that have instances binds and runs.
pub(crate) struct Compaction {
    scan: wgpu::ComputePipeline,
    scatter: wgpu::ComputePipeline,
    /// Of each piece: the bindings, and how many workgroups scatter its indices, if it has a list.
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
                let bind_group = gpu.bind_group(
                    "hiz.compact.piece",
                    &gpu.layouts().compact,
                    &[
                        entry(0, piece.uniform.as_entire_binding()),
                        entry(1, output.mask.as_entire_binding()),
                        entry(2, list.bound().as_entire_binding()),
                        entry(3, lists.draws.as_entire_binding()),
                        entry(4, list.before.as_entire_binding()),
                        entry(5, lists.capacity_uniform.as_entire_binding()),
                    ],
                )?;
                Ok((
                    bind_group,
                    list.indices.as_ref().map(|_| piece.words().div_ceil(SCATTER_WORKGROUP)),
                ))
            });
        Ok(Self {
            scan: gpu.compact_pipeline("scan")?,
            scatter: gpu.compact_pipeline("scatter")?,
            pieces: pieces.collect::<Result<_>>()?,
        })
    }

    /// Records the compaction of every piece, in order: a later one needs to know what earlier ones
    /// left of the capacity.
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
