//! A submitted cull, and everything that can be read from it.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use crate::cull::among::Among;
use crate::cull::count::record_count;
use crate::cull::groups::tiers_of;
use crate::cull::options::CullOptions;
use crate::error::{Error, Result};
use crate::gpu::buffers::STORAGE;
use crate::headless::ahead::Ahead;
use crate::headless::answers::AnswerBuffers;
use crate::headless::clock::Timed;
use crate::headless::counts::{Counts, Timings, milliseconds};
use crate::headless::engine::Engine;
use crate::headless::ranges::{count_ranges, groups_of, mask_ranges, verdict_ranges};
use crate::headless::readback::{self, BufferRange, Staged, to_u32};
use crate::host::memory;
use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::instances::tiers::TIERS;
use crate::instances::watch::Watch;
use crate::output::compact::Compaction;
use crate::output::counters::{CounterRecord, StatisticsRecord};
use crate::output::draw::DrawIndexedIndirect;
use crate::output::emit::Emit;
use crate::output::lists::Lists;
use crate::output::outputs::Outputs;
use crate::output::survivors::{GroupOutput, SurvivorsRecord};
use crate::output::verdict::Verdict;
use crate::output::visible::{PieceOutput, Visible};
use crate::pyramid::Pyramid;

/// The most instances of a cull whose end is asked for again and again before a thread sleeps.
/// It is over before a sleeping thread would have woken up (`docs/performance.md`).
const ASKED_FOR: u32 = 1 << 14;

/// The same of a cull with counts of pixels, which take ten times as long.
const ASKED_FOR_PIXELS: u32 = 1 << 10;

/// How long it is asked for.
const ASKING: Duration = Duration::from_micros(200);

/// A cull that was submitted.
/// Every read waits for it.
///
/// # Examples
/// A wall 10 m away, and spheres in front of it, behind it and behind the camera:
///
/// ```
/// # use hiz_core::headless::Engine;
/// # use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
/// # use hiz_core::{InstanceOptions, Outputs, Pose, Projection};
/// use hiz_core::Verdict::{Occluded, Outside, Visible};
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let pyramid = engine.pyramid(&engine.upload_depth(&[0.01; 64 * 64], &camera)?)?;
/// # let centers = [0.0, 0.0, -5.0, 0.0, 0.0, -20.0, 0.0, 0.0, 5.0];
/// # let (centers, radii) = (Floats::F32(&centers), Floats::F32(&[0.5; 3]));
/// # let bounds = Bounds::Spheres { centers, radii };
/// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
/// # let (options, outputs) = (CullOptions::default(), Outputs::default());
/// let culling = engine.cull(&instances, &camera, &pyramid, &options, &outputs)?;
/// assert_eq!(culling.mask()?, [true, false, false]);
/// assert_eq!(culling.verdicts()?, [Visible, Occluded, Outside]);
/// assert_eq!(culling.indices()?, [0]);
/// assert_eq!(culling.draws()?[0].instance_count, 1);
///
/// let counts = culling.counts()?;
/// assert_eq!((counts.visible, counts.occluded, counts.outside), (1, 1, 1));
/// println!("{}", culling.explain(1)?.reason);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct Culling {
    pub(super) engine: Engine,
    pub(super) instances: Arc<Instances>,
    pub(super) pyramid: Arc<Pyramid>,
    pub(super) camera: Camera,
    pub(super) options: CullOptions,
    pub(super) among: Option<Arc<Among>>,
    /// Lent by [`Engine::answers`] until this is dropped.
    pub(super) buffers: Arc<AnswerBuffers>,
    pub(super) visible: Arc<Visible>,
    /// The copy of a mask that is not large, made by the cull's own submit.
    pub(super) staged_mask: Locked<Option<Staged>>,
    /// That of counts of pixels.
    pub(super) staged_pixels: Locked<Option<Staged>>,
    /// What the cull's own submit copied, for [`Engine::cull_ahead`](Engine::cull_ahead).
    pub(super) ahead: Option<Ahead>,
    pub(super) later: OnceLock<Lists>,
    /// Where updates note what they changed, and find the refinement that must run before them.
    pub(super) watch: Arc<Watch>,
    pub(super) submission: wgpu::SubmissionIndex,
    pub(super) submitted: Instant,
    /// When the device was first seen to be done.
    pub(super) done: Arc<OnceLock<Instant>>,
    pub(super) timings: Locked<Timings>,
    pub(super) times: Option<Timed>,
}

impl Culling {
    /// The buffers on the device that the cull fills.
    pub fn visible(&self) -> &Visible {
        self.engine.answers().keep_apart(&self.buffers);
        &self.visible
    }

    /// The instances that were culled.
    pub fn instances(&self) -> &Instances {
        &self.instances
    }

    /// Waits until the device has run the cull, and until what it copied ahead has arrived.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn wait(&self) -> Result<()> {
        let device = self.engine.device();
        self.engine.scoped(|| {
            let start = Instant::now();
            let asked_for =
                if self.visible.outputs().pixels { ASKED_FOR_PIXELS } else { ASKED_FOR };
            while self.instances.len() <= asked_for && start.elapsed() < ASKING {
                if self.done.get().is_some() {
                    return Ok(());
                }
                readback::look(device)?;
                std::thread::yield_now();
            }
            readback::wait(device, Some(self.submission.clone()))
        })?;
        // The wait itself has called back, unless another thread is about to.
        self.done.get_or_init(Instant::now);
        self.arrived().map(drop)
    }

    /// The times of this cull so far.
    pub fn timings(&self) -> Timings {
        let wall_ms = self.done.get().map_or(0.0, |done| milliseconds(self.submitted, *done));
        Timings { wall_ms, ..*self.timings.lock() }
    }

    /// Records the copy of the mask into `buffers` if they have room for it.
    /// A submit of its own would cost more than the copy.
    pub(super) fn stage_mask(
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        buffers: &AnswerBuffers,
    ) -> Option<Staged> {
        let staging = buffers.staging.clone()?;
        Some(Staged::record(encoder, staging, &mask_ranges(instances, &buffers.visible)))
    }

    /// Calls `use_bytes` with the words of the masks of all pieces.
    fn with_mask<T>(&self, use_bytes: impl FnOnce(&[&[u8]]) -> T) -> Result<T> {
        let ranges = || mask_ranges(&self.instances, &self.visible);
        self.with_staged(&self.staged_mask, ranges, use_bytes)
    }

    /// Calls `use_bytes` with the bytes of `ranges`, of which `staged` has a copy at first.
    pub(super) fn with_staged<'a, T>(
        &'a self,
        staged: &Locked<Option<Staged>>,
        ranges: impl FnOnce() -> Vec<BufferRange<'a>>,
        use_bytes: impl FnOnce(&[&[u8]]) -> T,
    ) -> Result<T> {
        self.engine.check_process()?;
        // The first reader takes the staged copy, and later readers copy again.
        let Some(staged) = staged.lock().take() else {
            let parts = self.read(&ranges())?;
            return Ok(use_bytes(&parts.iter().map(Vec::as_slice).collect::<Vec<_>>()));
        };
        self.wait()?;
        let start = Instant::now();
        let read = self
            .engine
            .scoped(|| staged.read(self.engine.device(), self.submission.clone(), use_bytes));
        if read.is_err() {
            self.engine.answers().forget();
        }
        self.timings.lock().readback_ms += milliseconds(start, Instant::now());
        read
    }

    pub(super) fn read(&self, ranges: &[BufferRange<'_>]) -> Result<Vec<Vec<u8>>> {
        self.wait()?;
        let start = Instant::now();
        let ahead = self.arrived()?.map(|ahead| ahead.read(ranges)).transpose()?.flatten();
        if let Some(bytes) = ahead {
            self.timings.lock().readback_ms += milliseconds(start, Instant::now());
            return Ok(bytes);
        }
        let bytes = self
            .engine
            .scoped(|| readback::read_buffers(self.engine.device(), self.engine.queue(), ranges))?;
        self.timings.lock().readback_ms += milliseconds(start, Instant::now());
        Ok(bytes)
    }

    /// Whether each instance is kept, by its index.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without [`Outputs::mask`](crate::Outputs::mask).
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn mask(&self) -> Result<Vec<bool>> {
        self.require("mask", self.visible.outputs().mask)?;
        let mut mask = memory::list(self.instances.len() as usize, "mask")?;
        mask.resize(self.instances.len() as usize, false);
        self.with_mask(|planes| {
            let mut rest = &mut mask[..];
            for (piece, plane) in self.instances.pieces.iter().zip(planes) {
                let (part, behind) = rest.split_at_mut(piece.count() as usize);
                spread_bits(plane, part);
                rest = behind;
            }
        })?;
        Ok(mask)
    }

    /// The verdict of each instance, by its index.
    ///
    /// - **Outside**: outside the frustum, by a certificate of its own or of its group's box.
    ///   In sample coverage also: between all pixel centres.
    ///   In a cull of some instances also: not asked for.
    /// - **Occluded**: every other instance that is hidden.
    /// - **Visible**, **unoccluded** and **invalid**: every instance that is kept.
    ///   Unoccluded are those that surely show as a whole, if the pyramid has both ends.
    ///
    /// An absent instance ([`ABSENT`](crate::ABSENT)) has the verdict outside.
    ///
    /// So a verdict does not depend on whether groups were tested, except for a few instances.
    /// A group's test hides these, and their own tests would keep them: they are occluded.
    ///
    /// The members of hidden groups get their verdicts in a pass of their own.
    /// It runs when verdicts or counts are first read, or before the next update.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without [`Outputs::verdicts`](crate::Outputs::verdicts).
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn verdicts(&self) -> Result<Vec<Verdict>> {
        self.require("verdicts", self.visible.outputs().verdicts)?;
        self.refine()?;
        let of_places = self.read(&verdict_ranges(&self.instances, &self.visible))?;
        let mut verdicts = memory::list(self.instances.len() as usize, "verdicts")?;
        verdicts.resize(self.instances.len() as usize, Verdict::Visible);
        for (piece, words) in self.instances.pieces.iter().zip(of_places) {
            let first = piece.range.start as usize;
            for (place, verdict) in words.iter().step_by(4).enumerate() {
                verdicts[first + piece.order.index(place)] = Verdict::of_word((*verdict).into());
            }
        }
        Ok(verdicts)
    }

    /// The draw arguments, [`max_draws`](crate::Visible::max_draws) records per piece.
    /// If the cull did not write them, they are made from its mask: one record per piece.
    /// A mask does not tell bins, so their draws have to be asked for.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without draws, indices and mask, for one with meshes and
    ///   without draws and indices, and for bins of meshes without an index buffer.
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn draws(&self) -> Result<Vec<DrawIndexedIndirect>> {
        if !self.visible.outputs().emit.is_one_list() {
            return self.indexed_draws(self.bins()?);
        }
        let draws = match &self.visible.lists {
            Some(lists) => &lists.draws,
            None => &self.later_lists("draws")?.draws,
        };
        let bytes = self.read(&[BufferRange::first(draws, draws.size())])?;
        Ok(bytemuck::pod_collect_to_vec(&bytes[0]))
    }

    /// The packed list of the kept instances' indices, all pieces joined.
    /// If the cull did not write it, it is made from its mask, ascending.
    /// Of bins it has what they list, ascending; [`Culling::bin`] has the list of one.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without indices and mask.
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn indices(&self) -> Result<Vec<u32>> {
        if let Some(bins) = self.visible.bins.as_ref().filter(|_| self.visible.outputs().indices) {
            return self.indices_of_bins(bins);
        }
        // Of a list that was not asked for, the mask does not tell what a capacity cuts.
        self.require("indices", self.visible.bins.is_none() || !self.visible.is_capped())?;
        let lists = match &self.visible.lists {
            Some(lists) if self.visible.outputs().indices && lists.copied.is_none() => lists,
            _ => self.later_lists("indices")?,
        };
        let bytes = self.read(&[BufferRange::first(&lists.draws, lists.draws.size())])?;
        let draws: Vec<DrawIndexedIndirect> = bytemuck::pod_collect_to_vec(&bytes[0]);
        let ranges: Vec<_> = draws
            .iter()
            .zip(&lists.pieces)
            .map(|(draw, list)| {
                BufferRange::first(
                    list.bound(),
                    4 * u64::from(draw.instance_count.min(list.capacity)),
                )
            })
            .collect();
        let parts = self.read(&ranges)?;
        let mut indices = memory::list(parts.iter().map(|bytes| bytes.len() / 4).sum(), "indices")?;
        indices.extend(parts.iter().flat_map(|bytes| to_u32(bytes)));
        Ok(indices)
    }

    /// How many instances got which verdict, and how many were tested.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without [`Outputs::verdicts`](crate::Outputs::verdicts).
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn counts(&self) -> Result<Counts> {
        self.require("verdicts", self.visible.outputs().verdicts)?;
        self.refine()?;
        let made;
        let counters = match self.ahead.as_ref().and_then(|ahead| ahead.counters.as_ref()) {
            Some(counters) => counters,
            None => {
                made = self.count_verdicts()?;
                &made
            }
        };
        let ranges = count_ranges(&self.instances, &self.visible, &self.options, counters);
        let bytes = self.read(&ranges)?;
        let record: CounterRecord = bytemuck::pod_read_unaligned(&bytes[0]);
        let mut rest = bytes[1..].iter();
        let (mut tested_boxes, mut tested_instances, mut accepted_instances) = ([0; TIERS], 0, 0);
        for piece in &self.instances.pieces {
            let tiers = tiers_of(piece, &self.options);
            let survivors: Vec<SurvivorsRecord> = rest
                .by_ref()
                .take(tiers)
                .map(|bytes| bytemuck::pod_read_unaligned(bytes))
                .collect();
            let Some(groups) = survivors.first() else {
                tested_instances += u64::from(piece.count());
                continue;
            };
            tested_boxes[tiers - 1] += u64::from(piece.boxes(tiers - 1));
            for (tested, above) in tested_boxes.iter_mut().zip(&survivors[1..]) {
                *tested += u64::from(above.tested);
            }
            tested_instances += u64::from(groups.tested);
            accepted_instances += u64::from(groups.accepted);
        }
        let statistics: StatisticsRecord = rest
            .next()
            .map_or_else(StatisticsRecord::default, |bytes| bytemuck::pod_read_unaligned(bytes));
        let kept = [record.visible, record.unoccluded, record.invalid];
        let demand = kept.map(u64::from).iter().sum();
        // To the device, what is absent is outside.
        let absent = self.instances.num_absent();
        Ok(Counts {
            tested: u64::from(self.instances.len()) - absent,
            absent,
            outside: u64::from(record.outside) - absent,
            occluded: record.occluded.into(),
            visible: record.visible.into(),
            unoccluded: record.unoccluded.into(),
            invalid: record.invalid.into(),
            demand,
            written: demand.min(u64::from(self.visible.capacity())),
            tested_groups: tested_boxes[0],
            tested_boxes,
            tested_instances,
            accepted_instances,
            levels: statistics.levels.map(u64::from),
            texels_read: u64::from(statistics.texels_high) << 32 | u64::from(statistics.texels_low),
        })
    }

    /// How many instances are kept (the demand), and how many of them the lists hold.
    /// The demand is `None` if the cull was asked for lists alone, and they are full but too short
    /// for all instances.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without mask, verdicts, indices and draws.
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn demand_and_written(&self) -> Result<(Option<u64>, u64)> {
        let capacity = u64::from(self.visible.capacity());
        let outputs = self.visible.outputs();
        if outputs.mask {
            let demand = self.with_mask(|planes| {
                let words = planes.iter().flat_map(|bytes| to_u32(bytes));
                words.map(|word| u64::from(word.count_ones())).sum()
            })?;
            return Ok((Some(demand), capacity.min(demand)));
        }
        if let Some(bins) = &self.visible.bins {
            return self.demand_and_written_of_bins(bins);
        }
        if outputs.verdicts {
            let counts = self.counts()?;
            return Ok((Some(counts.demand), counts.written));
        }
        let written = self.draws()?.iter().map(|draw| u64::from(draw.instance_count)).sum();
        // Lists that had room for all hold as many as are kept.
        Ok(((written < capacity || !self.visible.is_capped()).then_some(written), written))
    }

    /// Counts the verdicts on the device: a `CounterRecord`.
    fn count_verdicts(&self) -> Result<wgpu::Buffer> {
        let engine = &self.engine;
        let gpu = &engine.context().gpu;
        let size = size_of::<CounterRecord>() as u64;
        engine.scoped(|| {
            let counters = gpu.empty("hiz.count.counters", size, STORAGE)?;
            let mut encoder = engine.encoder("hiz.count.encoder");
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            record_count(gpu, &mut pass, &self.instances, &self.visible, &counters)?;
            drop(pass);
            self.finish(encoder)?;
            Ok(counters)
        })
    }

    /// The lists that the cull did not write, made from its mask when they are first asked for.
    fn later_lists(&self, what: &str) -> Result<&Lists> {
        self.require(what, self.visible.outputs().mask)?;
        if let Some(lists) = self.later.get() {
            return Ok(lists);
        }
        let engine = &self.engine;
        let gpu = &engine.context().gpu;
        let lists = engine.scoped(|| {
            let Outputs { capacity, draw, .. } = self.visible.outputs();
            let lists = Lists::new(gpu, &self.instances, true, *capacity, (&Emit::List, *draw))?;
            let compaction = Compaction::new(gpu, &self.instances, &self.visible, &lists)?;
            let mut encoder = engine.encoder("hiz.compact.encoder");
            lists.record_clear(&mut encoder);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            compaction.record(&mut pass, false);
            drop(pass);
            self.finish(encoder)?;
            Ok(lists)
        })?;
        Ok(self.later.get_or_init(|| lists))
    }

    /// Submits the commands that make an answer, and waits.
    /// So the read-back time counts only the copy that follows.
    fn finish(&self, encoder: wgpu::CommandEncoder) -> Result<()> {
        let submission = self.engine.queue().submit([encoder.finish()]);
        readback::wait(self.engine.device(), Some(submission))
    }

    /// Makes sure that each place has a verdict of its own.
    fn refine(&self) -> Result<()> {
        let engine = &self.engine;
        let submission = engine.scoped(|| {
            let watches = self.instances.watches();
            let mut encoder = engine.encoder("hiz.refine.encoder");
            let gpu = &engine.context().gpu;
            if !watches.record_refinement(gpu, &mut encoder, &self.watch)? {
                return Ok(None);
            }
            let submission = engine.queue().submit([encoder.finish()]);
            watches.refined(&self.watch);
            Ok(Some(submission))
        })?;
        match submission {
            Some(submission) => engine.scoped(|| readback::wait(engine.device(), Some(submission))),
            None => Ok(()),
        }
    }

    pub(super) fn require(&self, output: &str, is_there: bool) -> Result<()> {
        if is_there {
            return Ok(());
        }
        let got = self.visible.outputs();
        Err(Error::mismatch(
            "outputs",
            format!(
                "expected a cull that was asked for {output}, got one with {got}; \
                 name {output} among the cull's outputs"
            ),
        ))
    }

    /// What this cull left of a piece's groups, if it tested them.
    pub(super) fn groups<'a>(
        &self,
        piece: &Piece,
        output: &'a PieceOutput,
    ) -> Option<&'a GroupOutput> {
        groups_of(piece, output, &self.options)
    }
}

/// The bits of each byte, lowest first.
const BITS: [[bool; 8]; 256] = {
    let mut table = [[false; 8]; 256];
    let mut i = 0;
    while i < 8 * table.len() {
        table[i / 8][i % 8] = (i / 8) >> (i % 8) & 1 == 1;
        i += 1;
    }
    table
};

/// Writes the first bits of `bytes` into `bits`, lowest first, a byte at a time.
pub(super) fn spread_bits(bytes: &[u8], bits: &mut [bool]) {
    let mut eights = bits.chunks_exact_mut(8);
    let mut rest = bytes.iter();
    for (eight, byte) in eights.by_ref().zip(rest.by_ref()) {
        eight.copy_from_slice(&BITS[usize::from(*byte)]);
    }
    let last = eights.into_remainder();
    if let Some(byte) = rest.next() {
        last.copy_from_slice(&BITS[usize::from(*byte)][..last.len()]);
    }
}
