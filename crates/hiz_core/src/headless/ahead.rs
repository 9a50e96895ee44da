//! What a cull copies to the host by its own submission, ahead of any read.

use std::sync::Arc;

use crate::cull::count::record_count;
use crate::cull::options::CullOptions;
use crate::error::Result;
use crate::gpu::buffers::STORAGE;
use crate::gpu::copies::{BufferRange, Copies};
use crate::headless::engine::Engine;
use crate::headless::ranges::{
    bin_ranges, count_ranges, mask_ranges, pixel_ranges, verdict_ranges,
};
use crate::instances::Instances;
use crate::output::counters::CounterRecord;
use crate::output::visible::Visible;

/// What a cull that was submitted ahead of its reads has beside other culls.
#[derive(Debug)]
pub(super) struct Ahead {
    pub(super) copies: Copies,
    /// `None` without verdicts.
    pub(super) counters: Option<wgpu::Buffer>,
    /// Held for its drop, which frees the slot.
    pub(super) slot: Arc<()>,
}

impl Ahead {
    /// Records the count of verdicts, and the copies of all that was asked for.
    /// Every place must have a verdict by then.
    pub(super) fn record(
        engine: &Engine,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        visible: &Visible,
        options: &CullOptions,
    ) -> Result<Self> {
        let gpu = &engine.context().gpu;
        let outputs = visible.outputs();
        let counters = if outputs.verdicts {
            let size = size_of::<CounterRecord>() as u64;
            let counters = gpu.empty("hiz.count.counters", size, STORAGE)?;
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            record_count(gpu, &mut pass, instances, visible, &counters)?;
            Some(counters)
        } else {
            None
        };
        let mut ranges = Vec::new();
        if outputs.mask {
            ranges.extend(mask_ranges(instances, visible));
        }
        if let Some(counters) = &counters {
            ranges.extend(verdict_ranges(instances, visible));
            ranges.extend(count_ranges(instances, visible, options, counters));
        }
        if let Some(lists) = &visible.lists {
            ranges.push(BufferRange::first(&lists.draws, lists.draws.size()));
            let filled = lists.pieces.iter().filter(|list| list.indices.is_some());
            ranges.extend(
                filled.map(|list| BufferRange::first(list.bound(), 4 * u64::from(list.capacity))),
            );
        }
        ranges.extend(bin_ranges(instances, visible));
        ranges.extend(pixel_ranges(instances, visible));
        let copies = Copies::record(gpu, encoder, engine.staging(), &ranges)?;
        Ok(Self { copies, counters, slot: Arc::new(()) })
    }

    /// The bytes of all these ranges, if all were copied.
    pub(super) fn read(&self, ranges: &[BufferRange<'_>]) -> Result<Option<Vec<Vec<u8>>>> {
        ranges.iter().map(|range| self.copies.read(range)).collect()
    }
}
