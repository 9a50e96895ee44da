//! A cull that was submitted, and what can be read of it.

use std::sync::{Arc, Mutex, OnceLock};
use std::time::Instant;

use super::{Engine, locked, milliseconds, to_u32};
use crate::camera::Camera;
use crate::compact::Compaction;
use crate::count;
use crate::cull::{CullInputs, CullOptions, ExplanationRecord, is_grouped, record_explain};
use crate::error::{Error, Result};
use crate::groups::GROUP;
use crate::host;
use crate::instances::{Instances, Piece};
use crate::lists::{DrawIndexedIndirect, Lists};
use crate::pyramid::Pyramid;
use crate::readback::{self, BufferRange, Staged};
use crate::visible::{
    CounterRecord, GroupOutput, PieceOutput, STORAGE, StatisticsRecord, SurvivorsRecord, Visible, VisibleOptions,
    verdicts_offset,
};

/// Up to this size, of 131,072 instances, a mask is copied to where it can be read by the submit of its cull.
const STAGED_MASK_BYTES: u64 = 1 << 14;

/// The verdicts of `shaders/shared/verdict.wgsl` that are told from others here.
const VISIBLE: u8 = 2;
const INVALID: u8 = 3;

/// How many instances met which end.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// All instances.
    pub tested: u64,
    /// Outside the frustum.
    pub outside: u64,
    /// Hidden by the depth image.
    pub occluded: u64,
    /// Possibly visible.
    pub visible: u64,
    /// Bad bounds, kept.
    pub invalid: u64,
    /// Visible and invalid: what the lists would hold without a capacity.
    pub demand: u64,
    /// What they hold.
    pub written: u64,
    /// Groups that were tested as a whole.
    pub tested_groups: u64,
    /// Instances that were tested by themselves: all, or those of the groups that were left.
    pub tested_instances: u64,
    /// Depth tests at each level (with [`CullOptions::statistics`]).
    pub levels: [u64; 16],
    /// Texels read (with [`CullOptions::statistics`]).
    pub texels_read: u64,
}

/// Wall times of one cull.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Timings {
    /// Making buffers and recording.
    pub record_ms: f64,
    /// From the submit to the end of the first wait for it.
    pub gpu_ms: f64,
    /// Copies to the host after that, so far.
    pub readback_ms: f64,
}

/// Why an instance got its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// 0 outside, 1 occluded, 2 visible, 3 invalid (kept).
    pub verdict: u8,
    /// First and last pixel column and row that the projection may touch, inclusive: x0, y0, x1, y1.
    pub rectangle: Option<[i32; 4]>,
    /// The level that was read.
    pub level: Option<u32>,
    /// The texels (x, y) of that level that were read.
    pub texels: Vec<[u32; 2]>,
    /// Their depths.
    pub texel_depths: Vec<f32>,
    /// The farthest of them.
    pub farthest: Option<f32>,
    /// The NDC depth of the bounds' nearest point, an estimate.
    pub nearest: Option<f64>,
    /// In words.
    pub reason: &'static str,
}

/// A cull that was submitted. Reading waits for it.
#[derive(Debug)]
pub struct Culling {
    pub(super) engine: Engine,
    pub(super) instances: Arc<Instances>,
    pub(super) pyramid: Arc<Pyramid>,
    pub(super) camera: Camera,
    pub(super) options: CullOptions,
    pub(super) output: VisibleOptions,
    pub(super) visible: Visible,
    /// A small mask, copied by the cull's own submit.
    pub(super) staged_mask: Mutex<Option<Staged>>,
    pub(super) later: OnceLock<Lists>,
    pub(super) submission: wgpu::SubmissionIndex,
    pub(super) submitted: Instant,
    pub(super) timings: Mutex<Timings>,
}

impl Culling {
    /// The buffers on the device.
    pub fn visible(&self) -> &Visible {
        &self.visible
    }

    /// The instances that were culled.
    pub fn instances(&self) -> &Instances {
        &self.instances
    }

    /// Waits until the device is done.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn wait(&self) -> Result<()> {
        self.engine.scoped(|| readback::wait(self.engine.device(), Some(self.submission.clone())))?;
        let mut timings = locked(&self.timings);
        if timings.gpu_ms == 0.0 {
            timings.gpu_ms = milliseconds(self.submitted, Instant::now());
        }
        Ok(())
    }

    /// Wall times so far.
    pub fn timings(&self) -> Timings {
        *locked(&self.timings)
    }

    /// Records the copy of a mask that is asked for and so small that a submit of its own would cost more.
    pub(super) fn stage_mask(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        visible: &Visible,
    ) -> Option<Staged> {
        let bytes: u64 = instances.pieces.iter().map(|piece| 4 * u64::from(piece.words())).sum();
        let is_small = visible.outputs().mask && (1..=STAGED_MASK_BYTES).contains(&bytes);
        is_small.then(|| Staged::record(device, encoder, &mask_ranges(instances, visible)))
    }

    /// The words of the masks of all pieces.
    fn mask_words(&self) -> Result<Vec<Vec<u8>>> {
        self.engine.check_process()?;
        // Whoever comes first takes it; a second reader copies again.
        let Some(staged) = locked(&self.staged_mask).take() else {
            return self.read(&mask_ranges(&self.instances, &self.visible));
        };
        self.wait()?;
        let start = Instant::now();
        let bytes = self.engine.scoped(|| staged.read(self.engine.device(), self.submission.clone()))?;
        locked(&self.timings).readback_ms += milliseconds(start, Instant::now());
        Ok(bytes)
    }

    fn read(&self, ranges: &[BufferRange<'_>]) -> Result<Vec<Vec<u8>>> {
        self.wait()?;
        let start = Instant::now();
        let bytes = self.engine.scoped(|| readback::read_buffers(self.engine.device(), self.engine.queue(), ranges))?;
        locked(&self.timings).readback_ms += milliseconds(start, Instant::now());
        Ok(bytes)
    }

    /// Whether each instance is kept.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a cull without [`Outputs::mask`](crate::Outputs::mask), [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn mask(&self) -> Result<Vec<bool>> {
        self.require("mask", self.visible.outputs().mask)?;
        let planes = self.mask_words()?;
        let mut mask = host::list(self.instances.len() as usize, "mask")?;
        for (piece, plane) in self.instances.pieces.iter().zip(planes) {
            let words = host::collected(to_u32(&plane), "mask")?;
            mask.extend((0..piece.count() as usize).map(|i| words[i / 32] >> (i % 32) & 1 == 1));
        }
        Ok(mask)
    }

    /// Each instance's verdict: 0 outside, 1 occluded, 2 visible, 3 invalid (kept).
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a cull without [`Outputs::verdicts`](crate::Outputs::verdicts), [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn verdicts(&self) -> Result<Vec<u8>> {
        self.require("verdicts", self.visible.outputs().verdicts)?;
        let of_members = self.read(&self.ranges(|piece, output| BufferRange {
            buffer: &output.mask,
            offset: verdicts_offset(piece),
            size: 4 * u64::from(piece.count()),
        }))?;
        let of_groups = self.read(&self.ranges(|piece, output| match self.groups(piece, output) {
            Some(groups) => BufferRange::first(&groups.verdicts, 4 * u64::from(piece.groups())),
            None => BufferRange::first(&output.mask, 0),
        }))?;
        let mut verdicts = host::list(self.instances.len() as usize, "verdicts")?;
        verdicts.resize(self.instances.len() as usize, 0);
        for ((piece, members), groups) in self.instances.pieces.iter().zip(of_members).zip(of_groups) {
            let first = piece.range.start as usize;
            let word = |bytes: &[u8], i: usize| bytes.get(4 * i).copied();
            for place in 0..piece.count() as usize {
                // A group that was not culled leaves the verdict to its members.
                let of_group = word(&groups, place / GROUP).filter(|verdict| *verdict < VISIBLE);
                verdicts[first + piece.order.index(place)] = of_group.or(word(&members, place)).unwrap_or(INVALID);
            }
        }
        Ok(verdicts)
    }

    /// The draw arguments, one record a piece. Where the cull left none they are made from its mask.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a cull without draws, indices and mask, [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn draws(&self) -> Result<Vec<DrawIndexedIndirect>> {
        let draws = match &self.visible.lists {
            Some(lists) => &lists.draws,
            None => &self.later_lists("draws")?.draws,
        };
        let bytes = self.read(&[BufferRange::first(draws, draws.size())])?;
        Ok(bytemuck::pod_collect_to_vec(&bytes[0]))
    }

    /// The packed list, the pieces joined. Where the cull left none it is made from its mask, ascending.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a cull without indices and mask, [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn indices(&self) -> Result<Vec<u32>> {
        let lists = match &self.visible.lists {
            Some(lists) if self.visible.outputs().indices => lists,
            _ => self.later_lists("indices")?,
        };
        let bytes = self.read(&[BufferRange::first(&lists.draws, lists.draws.size())])?;
        let draws: Vec<DrawIndexedIndirect> = bytemuck::pod_collect_to_vec(&bytes[0]);
        let ranges: Vec<_> = draws
            .iter()
            .zip(&lists.pieces)
            .map(|(draw, list)| BufferRange::first(list.bound(), 4 * u64::from(draw.instance_count.min(list.capacity))))
            .collect();
        let parts = self.read(&ranges)?;
        let mut indices = host::list(parts.iter().map(|bytes| bytes.len() / 4).sum(), "indices")?;
        indices.extend(parts.iter().flat_map(|bytes| to_u32(bytes)));
        Ok(indices)
    }

    /// How many instances met which end.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a cull without [`Outputs::verdicts`](crate::Outputs::verdicts), [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn counts(&self) -> Result<Counts> {
        self.require("verdicts", self.visible.outputs().verdicts)?;
        let engine = &self.engine;
        let gpu = &engine.context().gpu;
        let size = size_of::<CounterRecord>() as u64;
        let counters = engine.scoped(|| {
            let counters = gpu.empty("hiz.count.counters", size, STORAGE)?;
            let mut encoder = engine.encoder("hiz.count.encoder");
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            count::record(gpu, &mut pass, &self.instances, &self.visible, &self.options, &counters)?;
            drop(pass);
            engine.queue().submit([encoder.finish()]);
            Ok(counters)
        })?;
        let mut ranges = vec![BufferRange::first(&counters, size)];
        ranges.extend(self.ranges(|piece, output| match self.groups(piece, output) {
            Some(groups) => BufferRange::first(&groups.survivors, groups.survivors.size()),
            None => BufferRange::first(&output.mask, 0),
        }));
        // The last group may have fewer members.
        ranges.extend(self.ranges(|piece, output| match self.groups(piece, output) {
            Some(groups) => BufferRange { buffer: &groups.verdicts, offset: groups.verdicts.size() - 4, size: 4 },
            None => BufferRange::first(&output.mask, 0),
        }));
        let statistics = self.visible.statistics().filter(|_| self.options.statistics);
        ranges.extend(statistics.map(|buffer| BufferRange::first(buffer, buffer.size())));
        let bytes = self.read(&ranges)?;
        let record: CounterRecord = bytemuck::pod_read_unaligned(&bytes[0]);
        let (survivors, rest) = bytes[1..].split_at(self.instances.num_pieces());
        let (last_verdicts, statistics) = rest.split_at(self.instances.num_pieces());
        let statistics: StatisticsRecord =
            statistics.first().map_or_else(StatisticsRecord::default, |bytes| bytemuck::pod_read_unaligned(bytes));
        let (mut tested_groups, mut tested_instances) = (0, 0);
        for ((piece, survivors), last) in self.instances.pieces.iter().zip(survivors).zip(last_verdicts) {
            let count = u64::from(piece.count());
            if survivors.is_empty() {
                tested_instances += count;
                continue;
            }
            let survivors: SurvivorsRecord = bytemuck::pod_read_unaligned(survivors);
            tested_groups += u64::from(piece.groups());
            tested_instances += u64::from(survivors.count) * GROUP as u64;
            if last.first().is_some_and(|verdict| *verdict >= VISIBLE) {
                tested_instances -= u64::from(piece.groups()) * GROUP as u64 - count;
            }
        }
        let demand = u64::from(record.visible) + u64::from(record.invalid);
        Ok(Counts {
            tested: u64::from(self.instances.len()),
            outside: record.outside.into(),
            occluded: record.occluded.into(),
            visible: record.visible.into(),
            invalid: record.invalid.into(),
            demand,
            written: demand.min(u64::from(self.visible.capacity())),
            tested_groups,
            tested_instances,
            levels: statistics.levels.map(u64::from),
            texels_read: u64::from(statistics.texels_high) << 32 | u64::from(statistics.texels_low),
        })
    }

    /// How many instances are kept, and how many of them the lists hold. The first is unknown to a cull that was asked for full lists
    /// alone.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a cull that left nothing that tells, [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn demand_and_written(&self) -> Result<(Option<u64>, u64)> {
        let capacity = u64::from(self.visible.capacity());
        let outputs = self.visible.outputs();
        if outputs.mask {
            let words = self.mask_words()?;
            let demand = words.iter().flat_map(|bytes| to_u32(bytes)).map(|word| u64::from(word.count_ones())).sum();
            return Ok((Some(demand), capacity.min(demand)));
        }
        if outputs.verdicts {
            let counts = self.counts()?;
            return Ok((Some(counts.demand), counts.written));
        }
        let written = self.draws()?.iter().map(|draw| u64::from(draw.instance_count)).sum();
        // Where there was room for all, the lists' lengths tell.
        Ok(((written < capacity || !self.visible.is_capped()).then_some(written), written))
    }

    /// Lists that the cull did not leave, made from its mask when they are first asked for.
    fn later_lists(&self, what: &str) -> Result<&Lists> {
        self.require(what, self.visible.outputs().mask)?;
        if let Some(lists) = self.later.get() {
            return Ok(lists);
        }
        let engine = &self.engine;
        let gpu = &engine.context().gpu;
        let lists = engine.scoped(|| {
            let VisibleOptions { capacity, draw, .. } = self.output;
            let lists = Lists::new(gpu, &self.instances, true, capacity, draw)?;
            let compaction = Compaction::new(gpu, &self.instances, &self.visible, &lists)?;
            let mut encoder = engine.encoder("hiz.compact.encoder");
            lists.record_clear(&mut encoder);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            compaction.record(&mut pass);
            drop(pass);
            engine.queue().submit([encoder.finish()]);
            Ok(lists)
        })?;
        Ok(self.later.get_or_init(|| lists))
    }

    fn require(&self, output: &str, is_there: bool) -> Result<()> {
        if is_there {
            return Ok(());
        }
        let got = self.visible.outputs();
        Err(Error::mismatch("outputs", format!("expected a cull that was asked for {output}, got one with {got}")))
    }

    /// What this cull left of a piece's groups, if it tested them.
    fn groups<'a>(&self, piece: &Piece, output: &'a PieceOutput) -> Option<&'a GroupOutput> {
        output.groups().filter(|_| is_grouped(piece, &self.options))
    }

    fn ranges<'a>(&'a self, of: impl Fn(&Piece, &'a PieceOutput) -> BufferRange<'a>) -> Vec<BufferRange<'a>> {
        self.instances.pieces.iter().zip(&self.visible.pieces).map(|(piece, output)| of(piece, output)).collect()
    }

    /// Why instance `index` got its verdict: the cull's own steps, run for it once more.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for an index past the end.
    pub fn explain(&self, index: u64) -> Result<Explanation> {
        let engine = &self.engine;
        let index = u32::try_from(index).unwrap_or(u32::MAX);
        let whole_group = self.is_hidden_with_its_group(index)?;
        let bytes = engine.scoped(|| {
            let target = engine.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("hiz.explain.target"),
                size: size_of::<ExplanationRecord>() as u64,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let mut encoder = engine.encoder("hiz.explain.encoder");
            let inputs = CullInputs {
                instances: &self.instances,
                camera: &self.camera,
                pyramid: &self.pyramid,
                options: &self.options,
                certified: true,
            };
            record_explain(&engine.context().gpu, &mut encoder, &inputs, (index, whole_group), &target)?;
            engine.queue().submit([encoder.finish()]);
            readback::read_buffers(engine.device(), engine.queue(), &[BufferRange::first(&target, target.size())])
        })?;
        let mut told = explanation(&bytemuck::pod_read_unaligned(&bytes[0]), &self.camera);
        if whole_group {
            told.reason = "its group of 64 is hidden as a whole: the box around it is told of here";
        }
        Ok(told)
    }

    /// Whether this cull tested groups, and hid that of an instance.
    fn is_hidden_with_its_group(&self, index: u32) -> Result<bool> {
        let pieces = self.instances.pieces.iter().zip(&self.visible.pieces);
        let Some((piece, output)) = pieces.into_iter().find(|(piece, _)| piece.range.contains(&index)) else {
            return Ok(false);
        };
        let Some(groups) = self.groups(piece, output) else { return Ok(false) };
        let group = piece.order.place((index - piece.range.start) as usize) / GROUP;
        let verdict = self.read(&[BufferRange { buffer: &groups.verdicts, offset: 4 * group as u64, size: 4 }])?;
        Ok(verdict[0].first().is_some_and(|verdict| *verdict < VISIBLE))
    }
}

/// The masks of all pieces.
fn mask_ranges<'a>(instances: &Instances, visible: &'a Visible) -> Vec<BufferRange<'a>> {
    let words = instances.pieces.iter().map(Piece::words);
    visible
        .pieces
        .iter()
        .zip(words)
        .map(|(output, words)| BufferRange::first(&output.mask, 4 * u64::from(words)))
        .collect()
}

/// The stages of `shaders/shared/classify.wgsl`.
fn explanation(record: &ExplanationRecord, camera: &Camera) -> Explanation {
    let reached_depth = record.stage >= 4;
    let reason = match (record.stage, record.verdict) {
        (0, _) => "the bounds are not finite, negative, or too large for this camera: kept",
        (1, _) => "outside one plane of the frustum",
        (2, _) => "crosses the plane of the eye: kept",
        (3, 0) => "between the pixel centres",
        (3, _) => "touches no pixel for sure, but no plane of the frustum separates it: kept",
        (4, _) => "not surely behind the farthest depth of the texels: kept",
        (6, 1) => "behind the farthest depth of every pixel that it can touch",
        (7, _) => "spans more texels of the coarsest stored level than the footprint has: kept",
        (6, _) => "not surely behind every pixel that it can touch, or the budget ended: kept",
        (_, 1) => "behind the farthest depth of all texels that it can touch",
        _ => "behind the texels, but not surely inside their block: kept",
    };
    let [x0, y0, x1, y1] = record.texels;
    let corners = [[x0, y0], [x1, y0], [x0, y1], [x1, y1]];
    let (mut texels, mut texel_depths) = (Vec::new(), Vec::new());
    let read_any = reached_depth && record.stage != 7;
    if read_any {
        for (texel, bits) in corners.iter().zip(record.texel_bits) {
            if !texels.contains(texel) {
                texels.push(*texel);
                texel_depths.push(f32::from_bits(bits));
            }
        }
    }
    let [least, greatest] = record.depths.map(f64::from);
    let nearest = if camera.convention().is_reversed() { greatest } else { least };
    Explanation {
        verdict: record.verdict as u8,
        rectangle: reached_depth.then_some(record.pixels),
        level: reached_depth.then_some(record.level),
        texels,
        texel_depths,
        farthest: read_any.then(|| f32::from_bits(record.farthest_bits)),
        nearest: (record.stage >= 3).then_some(nearest),
        reason,
    }
}
