//! Forms the boxes of upper tiers: all of a piece's, or those around some groups.

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::host::memory;
use crate::instances::batch::GROUP;
use crate::instances::piece::Piece;
use crate::instances::tiers::{WORKGROUP, bind_form, form_pipeline};

/// The dispatches that form boxes of a piece's upper tiers, the lowest tier first.
#[derive(Debug)]
pub(crate) struct Forming {
    pipeline: wgpu::ComputePipeline,
    steps: Vec<(wgpu::BindGroup, u32)>,
}

impl Forming {
    /// All boxes; `None` if the piece has no upper tier.
    pub(super) fn all(gpu: &Gpu, piece: &Piece) -> Result<Option<Self>> {
        if piece.upper.is_empty() {
            return Ok(None);
        }
        let steps = piece.upper.iter().map(|tier| (tier.form.clone(), tier.count)).collect();
        Ok(Some(Self { pipeline: form_pipeline(gpu, false)?, steps }))
    }

    /// The boxes around some groups, whose numbers ascend; `None` if the piece has no upper tier.
    pub(super) fn around(gpu: &Gpu, piece: &Piece, groups: &[u32]) -> Result<Option<Self>> {
        if piece.upper.is_empty() {
            return Ok(None);
        }
        let mut steps = memory::list(piece.upper.len(), "update")?;
        let mut chosen: Vec<u32> = memory::list(groups.len(), "update")?;
        chosen.extend(groups);
        let mut from = &piece.group_records;
        for tier in &piece.upper {
            chosen.iter_mut().for_each(|below| *below /= GROUP as u32);
            chosen.dedup();
            let list = gpu.filled(
                "hiz.tiers.chosen",
                bytemuck::cast_slice(&chosen),
                wgpu::BufferUsages::STORAGE,
            )?;
            let count = chosen.len() as u32;
            let bindings = bind_form(gpu, (count, tier.below), &list, [from, &tier.records])?;
            steps.push((bindings, count));
            from = &tier.records;
        }
        Ok(Some(Self { pipeline: form_pipeline(gpu, true)?, steps }))
    }

    /// The dispatches of [`Forming::around`] without workgroups.
    pub(super) fn idle(gpu: &Gpu, piece: &Piece) -> Result<Option<Self>> {
        let forming = Self::all(gpu, piece)?;
        forming
            .map(|all| {
                let steps = all.steps.into_iter().map(|(bindings, _)| (bindings, 0)).collect();
                Ok(Self { pipeline: form_pipeline(gpu, true)?, steps })
            })
            .transpose()
    }

    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_pipeline(&self.pipeline);
        for (bindings, count) in &self.steps {
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(count.div_ceil(WORKGROUP), 1, 1);
        }
    }

    /// Records a pass of its own.
    pub(super) fn record_pass(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("hiz.tiers.pass"),
            timestamp_writes: None,
        });
        self.record(&mut pass);
    }
}
