//! The buffers that answers lie in, lent from cull to cull.
//!
//! Making buffers costs a small cull more than its test.
//! So the buffers of an answer that was dropped serve the next cull of the same instances and
//! outputs.
//! An answer that is alive keeps its buffers, and so does one whose buffers the caller has seen.

use std::sync::{Arc, Weak};

use crate::context::HizContext;
use crate::error::Result;
use crate::headless::ranges::{mask_bytes, pixel_ranges};
use crate::host::threads::Locked;
use crate::instances::Instances;
use crate::output::outputs::Outputs;
use crate::output::visible::Visible;

/// The most bytes on the device of all buffers that are kept.
/// They are held until their instances are gone.
const MOST_BYTES: u64 = 1 << 24;

/// Answers whose buffers are kept at most: they are looked through at each cull.
const MOST_KEPT: usize = 64;

/// What the cull's own submit copies to a staging buffer at most: the mask of 8 million instances,
/// or the counts of pixels of 52,000.
const STAGED_BYTES: u64 = 1 << 20;

/// The buffers of one answer.
#[derive(Debug)]
pub(super) struct AnswerBuffers {
    pub(super) visible: Arc<Visible>,
    /// Takes the copy of a mask that was asked for, unless it is large.
    pub(super) staging: Option<wgpu::Buffer>,
    /// Takes the copy of counts of pixels, likewise.
    pub(super) staging_pixels: Option<wgpu::Buffer>,
}

impl AnswerBuffers {
    fn new(context: &HizContext, instances: &Instances, outputs: &Outputs) -> Result<Self> {
        let visible = Arc::new(context.create_visible(instances, outputs)?);
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let staging = |is_asked: bool, bytes: u64| {
            let is_staged = is_asked && (1..=STAGED_BYTES).contains(&bytes);
            is_staged.then(|| context.gpu.empty("hiz.readback.staging", bytes, usage)).transpose()
        };
        let mask = instances.pieces.iter().map(mask_bytes).sum();
        let pixels = pixel_ranges(instances, &visible).iter().map(|range| range.size).sum();
        let staging_pixels = staging(outputs.pixels, pixels)?;
        Ok(Self { staging: staging(outputs.mask, mask)?, staging_pixels, visible })
    }

    /// Lists start as 0xFFFFFFFF, which only new ones do.
    fn may_serve_again(&self) -> bool {
        self.visible.lists.is_none() && self.visible.bins.is_none()
    }

    fn bytes(&self) -> u64 {
        let staging = self.staging.iter().chain(&self.staging_pixels).map(wgpu::Buffer::size);
        self.visible.device_bytes() + staging.sum::<u64>()
    }
}

/// The buffers of the last answers of an engine.
#[derive(Debug, Default)]
pub(super) struct Answers(Locked<Vec<Kept>>);

#[derive(Debug)]
struct Kept {
    instances: Weak<Instances>,
    outputs: Outputs,
    buffers: Arc<AnswerBuffers>,
}

impl Kept {
    /// The buffers if nothing else refers to them: no answer, and no work that one left undone.
    fn if_free(&mut self) -> Option<Arc<AnswerBuffers>> {
        let alone = Arc::get_mut(&mut self.buffers)?;
        Arc::get_mut(&mut alone.visible)?;
        Some(Arc::clone(&self.buffers))
    }
}

impl Answers {
    /// Buffers for a cull, those of a dropped answer if they fit.
    pub(super) fn lend(
        &self,
        context: &HizContext,
        instances: &Arc<Instances>,
        outputs: &Outputs,
    ) -> Result<Arc<AnswerBuffers>> {
        let mut kept = self.0.lock();
        kept.retain(|kept| kept.instances.strong_count() > 0);
        let mut fitting = kept.iter_mut().filter(|kept| {
            kept.outputs == *outputs
                && std::ptr::eq(kept.instances.as_ptr(), Arc::as_ptr(instances))
        });
        if let Some(free) = fitting.find_map(Kept::if_free) {
            return Ok(free);
        }
        drop(kept);
        let buffers = Arc::new(AnswerBuffers::new(context, instances, outputs)?);
        let mut kept = self.0.lock();
        let held: u64 = kept.iter().map(|kept| kept.buffers.bytes()).sum();
        let has_room = kept.len() < MOST_KEPT && held + buffers.bytes() <= MOST_BYTES;
        if buffers.may_serve_again() && has_room {
            kept.push(Kept {
                instances: Arc::downgrade(instances),
                outputs: outputs.clone(),
                buffers: Arc::clone(&buffers),
            });
        }
        Ok(buffers)
    }

    /// Lends these buffers never again: the caller may hold handles of them.
    pub(super) fn keep_apart(&self, buffers: &Arc<AnswerBuffers>) {
        self.0.lock().retain(|kept| !Arc::ptr_eq(&kept.buffers, buffers));
    }

    /// Lends none of the buffers so far again, after an error on the device.
    pub(super) fn forget(&self) {
        self.0.lock().clear();
    }
}
