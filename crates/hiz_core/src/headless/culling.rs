//! A cull that was submitted, and what can be read of it.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::{Engine, locked, milliseconds, to_u32};
use crate::camera::Camera;
use crate::cull::{CullInputs, CullOptions, ExplanationRecord, record_explain};
use crate::error::Result;
use crate::host;
use crate::instances::Instances;
use crate::pyramid::Pyramid;
use crate::readback::{self, BufferRange};
use crate::visible::{CounterRecord, DrawIndexedIndirect, Visible};

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
    pub(super) visible: Visible,
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
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn mask(&self) -> Result<Vec<bool>> {
        let ranges: Vec<_> = self
            .instances
            .pieces
            .iter()
            .zip(&self.visible.pieces)
            .map(|(piece, output)| BufferRange::first(&output.planes, 4 * u64::from(piece.words())))
            .collect();
        let planes = self.read(&ranges)?;
        let mut mask = host::list(self.instances.len() as usize, "mask")?;
        for (piece, plane) in self.instances.pieces.iter().zip(planes) {
            let words = host::collected(to_u32(&plane), "bit planes")?;
            mask.extend((0..piece.count() as usize).map(|i| bit(&words, i) == 1));
        }
        Ok(mask)
    }

    /// Each instance's verdict: 0 outside, 1 occluded, 2 visible, 3 invalid (kept).
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn verdicts(&self) -> Result<Vec<u8>> {
        let ranges: Vec<_> = self
            .instances
            .pieces
            .iter()
            .zip(&self.visible.pieces)
            .map(|(piece, output)| BufferRange::first(&output.planes, 8 * u64::from(piece.words())))
            .collect();
        let planes = self.read(&ranges)?;
        let mut verdicts = host::list(self.instances.len() as usize, "verdicts")?;
        for (piece, plane) in self.instances.pieces.iter().zip(planes) {
            let words = host::collected(to_u32(&plane), "bit planes")?;
            let (kept, low) = words.split_at(piece.words() as usize);
            verdicts.extend((0..piece.count() as usize).map(|i| 2 * bit(kept, i) + bit(low, i)));
        }
        Ok(verdicts)
    }

    /// The draw arguments, one record a piece.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn draws(&self) -> Result<Vec<DrawIndexedIndirect>> {
        let draws = &self.visible.draws;
        let bytes = self.read(&[BufferRange::first(draws, draws.size())])?;
        Ok(bytemuck::pod_collect_to_vec(&bytes[0]))
    }

    /// The packed list, the pieces joined.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn indices(&self) -> Result<Vec<u32>> {
        let draws = self.draws()?;
        let ranges: Vec<_> = draws
            .iter()
            .zip(&self.visible.pieces)
            .map(|(draw, output)| {
                BufferRange::first(&output.list, 4 * u64::from(draw.instance_count.min(output.list_capacity)))
            })
            .collect();
        let lists = self.read(&ranges)?;
        let mut indices = host::list(lists.iter().map(|bytes| bytes.len() / 4).sum(), "indices")?;
        indices.extend(lists.iter().flat_map(|bytes| to_u32(bytes)));
        Ok(indices)
    }

    /// How many instances met which end.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn counts(&self) -> Result<Counts> {
        let (counters, draws) = (&self.visible.counters, &self.visible.draws);
        let bytes =
            self.read(&[BufferRange::first(counters, counters.size()), BufferRange::first(draws, draws.size())])?;
        let record: CounterRecord = bytemuck::pod_read_unaligned(&bytes[0]);
        let draws: Vec<DrawIndexedIndirect> = bytemuck::pod_collect_to_vec(&bytes[1]);
        Ok(Counts {
            tested: u64::from(self.instances.len()),
            outside: record.outside.into(),
            occluded: record.occluded.into(),
            visible: record.visible.into(),
            invalid: record.invalid.into(),
            demand: u64::from(record.visible) + u64::from(record.invalid),
            written: draws.iter().map(|d| u64::from(d.instance_count)).sum(),
            levels: record.levels.map(u64::from),
            texels_read: u64::from(record.texels_high) << 32 | u64::from(record.texels_low),
        })
    }

    /// Why instance `index` got its verdict: the cull's own steps, run for it once more.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for an index past the end.
    pub fn explain(&self, index: u64) -> Result<Explanation> {
        let engine = &self.engine;
        let index = u32::try_from(index).unwrap_or(u32::MAX);
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
            };
            record_explain(&engine.context().gpu, &mut encoder, &inputs, index, &target)?;
            engine.queue().submit([encoder.finish()]);
            readback::read_buffers(engine.device(), engine.queue(), &[BufferRange::first(&target, target.size())])
        })?;
        Ok(explanation(&bytemuck::pod_read_unaligned(&bytes[0]), &self.camera))
    }
}

fn bit(words: &[u32], i: usize) -> u8 {
    (words[i / 32] >> (i % 32) & 1) as u8
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
        (6, _) => "not surely behind every pixel that it can touch, or the budget ended: kept",
        (_, 1) => "behind the farthest depth of all texels that it can touch",
        _ => "behind the texels, but not surely inside their block: kept",
    };
    let [x0, y0, x1, y1] = record.texels;
    let corners = [[x0, y0], [x1, y0], [x0, y1], [x1, y1]];
    let (mut texels, mut texel_depths) = (Vec::new(), Vec::new());
    if reached_depth {
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
        farthest: reached_depth.then(|| f32::from_bits(record.farthest_bits)),
        nearest: (record.stage >= 3).then_some(nearest),
        reason,
    }
}
