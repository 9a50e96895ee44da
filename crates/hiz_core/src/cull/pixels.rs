//! The counts of pixels: a pass of its own behind a cull, which looks at every instance.
//!
//! A group that is hidden as a whole tells nothing about its members' pixels, so they are counted
//! all the same.

use crate::cull::inputs::{BoundView, CullInputs, PreparedView, check_contexts};
use crate::cull::pipelines::{
    CullKey, Decision, DepthStore, classify_constants, layouts, unexplained,
};
use crate::cull::shadow::check_no_shadow;
use crate::error::Result;
use crate::gpu::buffers::{STORAGE, check_alive, entry, made};
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::loops::MOST_ITERATIONS;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::stage_pass;
use crate::host::threads::cores;
use crate::input::bounds::BoundsKind;
use crate::instances::piece::{Piece, RECORD_BINDINGS};
use crate::output::visible::{PieceOutput, Visible};

/// Invocations of a workgroup; `shaders/cull/pixels.wgsl`.
pub(crate) const WORKGROUP: u32 = 128;

/// Those of a workgroup on a processor; `shaders/cull/pixels.wgsl`.
pub(crate) const FEW: u32 = 8;

/// How many instances a workgroup takes at most; `shaders/cull/pixels.wgsl`.
pub(crate) const MOST_ORDERED: u32 = 512;

/// And at least, on a processor: with fewer, those that run side by side differ more in size.
const LEAST_ORDERED: u32 = 64;

/// Workgroups per core of a processor, so that a long one holds up few others.
const PER_CORE: u32 = 2;

/// Invocations that count a large rectangle together; `shaders/cull/pixels_large.wgsl`.
pub(crate) const TEAM: u32 = 8;

/// Invocations that count a huge one on a processor; `shaders/cull/pixels_large.wgsl`.
#[cfg(test)]
pub(crate) const LARGE_TEAM: u32 = 64;

/// In a pyramid of all levels the loops of [`TEAM`] invocations look at all of a rectangle of fewer
/// pixels than this times the iterations that they may take.
///
/// They take an iteration for 8 blocks of 4x4 pixels, which makes n / 8 for n blocks.
/// Before that come rounds, each of [`TEAM`] + 3 iterations for up to 256 texels.
/// A round enters 16 texels, or the rest of those that a round one level coarser has listed.
/// So there are at most n / 256 rounds that list blocks, and one more for each round before them;
/// over all levels that is less than 1.2 n / 256.
/// For a share of 32,255 iterations n is at most 161,300, and 8,500 more at the edges of one that
/// is as long as an image's side: 21,300 iterations for blocks, and 8,800 for rounds.
///
/// Where less is left a round ends the count, so the bound is about completeness alone.
pub(crate) const PIXELS_OF_ITERATION: u32 = 80;

/// Large rectangles of one workgroup on a processor, each of which may take its share of the
/// iterations; `shaders/cull/pixels.wgsl`.
pub(crate) const LARGE_OF_TEAM: u32 = 2;

/// What the loops may take that are not summed up, at most: those over the instances of a
/// workgroup, over classes of sizes, over levels and over planes.
/// `count_of_pixels_by_few` has most: 65 rounds for keys, of up to 4 more each, as many for places,
/// for sums, for counts and for what is left, and 50 for the classes.
const OTHER_ITERATIONS: u32 = 1024;

/// What the loops over rectangles may take.
fn iterations(gpu: &Gpu) -> u32 {
    if gpu.is_processor() { MOST_ITERATIONS - OTHER_ITERATIONS } else { u32::MAX }
}

/// How many workgroups are enough for all cores of a processor.
/// Each costs time.
fn for_all_cores() -> u32 {
    u32::try_from(cores()).unwrap_or(u32::MAX).saturating_mul(PER_CORE)
}

/// How many of so many instances a workgroup takes.
fn ordered(gpu: &Gpu, count: u32) -> u32 {
    if gpu.is_processor() {
        let share = count.div_ceil(for_all_cores()).clamp(LEAST_ORDERED, MOST_ORDERED);
        share.next_multiple_of(FEW)
    } else {
        WORKGROUP
    }
}

/// Workgroups of a graphics card that share the large rectangles out among them, at most.
///
/// On a processor there is one for few of them, so that its loops end with these.
const MOST_TEAMS: u32 = 1024;

/// What a count writes: the counts, the mask of what is not negligible, and the list of large
/// rectangles.
/// Number 2 are the numbers that it reads.
const COUNTED_BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Write), (1, Binding::Write), (2, Binding::Uniform), (3, Binding::Write)];

/// What the count of all instances writes besides on a processor: the arguments of the dispatch for
/// large rectangles.
const TEAM_BINDINGS: &[(u32, Binding)] = &[(0, Binding::Write)];
const TEAMS_LAYOUT: &str = "hiz.pixels.teams_layout";

/// Twin: `shaders/cull/pixels.wgsl`, `Counting`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CountingUniform {
    pub(crate) budget: u32,
    pub(crate) negligible: u32,
    pub(crate) ordered: u32,
    pub(crate) iterations: u32,
}

/// The shader that counts pixels.
pub(crate) fn pixels_module(store: DepthStore, kind: BoundsKind) -> Source {
    let row = match store {
        DepthStore::Apart(SourceKind::Pair) => {
            [wgsl!("cull/pixels_row_pair"), wgsl!("cull/pixels_row_apart")].to_vec()
        }
        DepthStore::Apart(SourceKind::Bits) => {
            [wgsl!("cull/pixels_row_bits"), wgsl!("cull/pixels_row_apart")].to_vec()
        }
        DepthStore::Apart(_) => {
            [wgsl!("cull/pixels_row_sampled"), wgsl!("cull/pixels_row_apart")].to_vec()
        }
        DepthStore::Atlas => vec![wgsl!("cull/pixels_row_atlas")],
        DepthStore::InPlace => vec![wgsl!("cull/pixels_row_in_place")],
    };
    let alone: &[_] = match store {
        DepthStore::Apart(SourceKind::Pair) => &[],
        _ => &[wgsl!("cull/pixels_row_alone")],
    };
    let planes = match kind {
        BoundsKind::Box | BoundsKind::OrientedBox => wgsl!("cull/pixels_planes_box"),
        _ => wgsl!("cull/pixels_planes_any"),
    };
    let count = [
        wgsl!("instances/piece"),
        planes,
        wgsl!("cull/pixels_planes"),
        wgsl!("cull/pixels_sure"),
        wgsl!("cull/pixels_look"),
        wgsl!("cull/pixels"),
        wgsl!("cull/pixels_large"),
    ];
    unexplained(store, kind, Decision::Seen, &[&row[..], alone, &count].concat())
}

fn pixels_pipeline(
    gpu: &Gpu,
    key: &CullKey,
    (one_sample, shown): (bool, bool),
    entry_point: &'static str,
) -> Result<wgpu::ComputePipeline> {
    let written = ("hiz.pixels.layout", COUNTED_BINDINGS);
    let mut layouts = layouts(gpu, key.store, RECORD_BINDINGS, written)?.to_vec();
    if entry_point == BY_FEW {
        layouts.push(gpu.layout(TEAMS_LAYOUT, TEAM_BINDINGS)?);
    }
    gpu.compute_pipeline(&Compute {
        label: "hiz.pixels.pipeline",
        source: pixels_module(key.store, key.kind),
        entry_point,
        layouts: &layouts,
        constants: &pixels_constants(key, one_sample, shown),
    })
}

/// What counts all instances on a processor.
const BY_FEW: &str = "count_of_pixels_by_few";

/// What counts all instances, and then large rectangles of an image of so many pixels.
fn entry_points(gpu: &Gpu, pixels: u64) -> (&'static str, &'static [&'static str]) {
    let of_large: &[_] = &["count_of_many_pixels", "count_of_most_pixels"];
    if !gpu.is_processor() {
        ("count_of_pixels", &of_large[..1])
    } else if pixels / u64::from(PIXELS_OF_ITERATION) < u64::from(iterations(gpu) / LARGE_OF_TEAM) {
        (BY_FEW, &of_large[..1])
    } else {
        (BY_FEW, of_large)
    }
}

/// The constants of a count of pixels.
fn pixels_constants(key: &CullKey, one_sample: bool, shown: bool) -> Vec<(&'static str, f64)> {
    // The rectangle of a footprint and its fit have no effect, because every pixel is looked for.
    let key = CullKey { footprint_log2: 1, descent: true, fit_volume: true, ..*key };
    classify_constants(&key)
        .into_iter()
        .chain([("ONE_SAMPLE", flag(one_sample)), ("SHOWN", flag(shown))])
        .collect()
}

/// The bind group of what the count of a piece writes, made by the first one.
fn bind_counted(
    gpu: &Gpu,
    visible: &Visible,
    (p, piece): (usize, &Piece),
    negligible: Option<u32>,
) -> Result<wgpu::BindGroup> {
    let output = &visible.pieces[p];
    let counts = output.pixels.as_ref().expect("the outputs have counts");
    let large = output.large.as_ref().expect("a list beside the counts");
    check_alive(counts)?;
    output.counted.get(negligible, || {
        let shown = match negligible {
            Some(_) => output.mask.clone(),
            None => gpu.stand_in("hiz.pixels.no_mask")?,
        };
        let counting = gpu.uniform(
            "hiz.pixels.counting",
            &CountingUniform {
                budget: visible.outputs().pixel_budget.unwrap_or(u32::MAX).max(1),
                negligible: negligible.unwrap_or(0),
                ordered: ordered(gpu, piece.count()),
                iterations: iterations(gpu),
            },
        )?;
        gpu.bind_group(
            "hiz.pixels.counts",
            &gpu.layout("hiz.pixels.layout", COUNTED_BINDINGS)?,
            &[
                entry(0, counts.as_entire_binding()),
                entry(1, shown.as_entire_binding()),
                entry(2, counting.as_entire_binding()),
                entry(3, large.as_entire_binding()),
            ],
        )
    })
}

/// The arguments of the dispatch for large rectangles, and what binds them to be written.
fn bind_teams(gpu: &Gpu, output: &PieceOutput) -> Result<Teams> {
    let teams = made(&output.teams, || {
        let usage = STORAGE | wgpu::BufferUsages::INDIRECT;
        let arguments = gpu.empty("hiz.visible.teams", 2 * ARGUMENT_BYTES, usage)?;
        let layout = gpu.layout(TEAMS_LAYOUT, TEAM_BINDINGS)?;
        let whole = [entry(0, arguments.as_entire_binding())];
        let bound = gpu.bind_group("hiz.pixels.teams", &layout, &whole)?;
        Ok((arguments, bound))
    })?;
    Ok(Teams::Each { arguments: teams.0.clone(), bound: teams.1.clone() })
}

/// A count that is prepared: nothing that it records can fail any more.
#[derive(Debug)]
pub(crate) struct PixelPass {
    /// Of all instances.
    pipeline: wgpu::ComputePipeline,
    /// Of those with large rectangles.
    of_large: Vec<wgpu::ComputePipeline>,
    view: BoundView,
    pieces: Vec<CountedPiece>,
}

#[derive(Debug)]
struct CountedPiece {
    records: wgpu::BindGroup,
    written: wgpu::BindGroup,
    /// The list of large rectangles, which begins with the numbers of large and huge ones.
    large: wgpu::Buffer,
    /// Of the pipeline for all instances.
    workgroups: u32,
    teams: Teams,
}

/// The workgroups that count large rectangles.
#[derive(Debug)]
enum Teams {
    /// So many.
    Shared(u32),
    /// As many as the count of all instances writes into these arguments.
    Each { arguments: wgpu::Buffer, bound: wgpu::BindGroup },
}

/// The bytes of the arguments of a dispatch.
const ARGUMENT_BYTES: u64 = 12;

impl PixelPass {
    /// Prepares the count of what `inputs` ask for, into `visible`, if that has room for counts.
    ///
    /// `negligible`: a bit of the mask is set for what may show in more pixels than that.
    pub(crate) fn new(
        gpu: &Gpu,
        inputs: &CullInputs<'_>,
        visible: &Visible,
        negligible: Option<u32>,
    ) -> Result<Option<Self>> {
        if !visible.outputs().pixels {
            return Ok(None);
        }
        check_no_shadow(inputs.options, "counts of pixels")?;
        let CullInputs { instances, pyramid, .. } = *inputs;
        check_contexts(gpu, inputs)?;
        let built = inputs.built()?.by_texture();
        let seen = PreparedView::new(gpu, &CullInputs { built: Some(&built), ..*inputs }, None)?;
        let view = seen.bind(gpu, pyramid, false)?;
        let flags = (seen.has_one_sample(), negligible.is_some());
        let size = pyramid.size();
        let pixels = u64::from(size.width) * u64::from(size.height);
        let (all, of_large) = entry_points(gpu, pixels);
        let made = |entry_point: &'static str| pixels_pipeline(gpu, &seen.key, flags, entry_point);
        let pipeline = made(all)?;
        let of_large = of_large.iter().map(|name| made(name)).collect::<Result<_>>()?;
        let bound = |(p, piece): (usize, &Piece)| {
            let output = &visible.pieces[p];
            let large = output.large.clone().expect("a list beside the counts");
            let written = bind_counted(gpu, visible, (p, piece), negligible)?;
            let records = inputs.among.map_or(&piece.bindings, |among| among.records(p)).clone();
            let count = if inputs.idle { 0 } else { piece.count() };
            let workgroups = count.div_ceil(ordered(gpu, piece.count()));
            let teams = if gpu.is_processor() {
                bind_teams(gpu, output)?
            } else {
                Teams::Shared(count.div_ceil(TEAM).min(MOST_TEAMS))
            };
            Ok(CountedPiece { records, written, large, workgroups, teams })
        };
        let pieces = instances.pieces.iter().enumerate().map(bound).collect::<Result<_>>()?;
        Ok(Some(Self { pipeline, of_large, view, pieces }))
    }

    pub(crate) fn record(
        mut self,
        encoder: &mut wgpu::CommandEncoder,
        pyramid: &crate::pyramid::Pyramid,
    ) {
        self.view.record(encoder, pyramid);
        for piece in &self.pieces {
            encoder.clear_buffer(&piece.large, 0, Some(8));
            if let Teams::Each { arguments, .. } = &piece.teams {
                encoder.clear_buffer(arguments, 0, None);
            }
        }
        let mut pass = stage_pass(encoder, "hiz.pixels.pass", "pixels");
        pass.set_bind_group(0, &self.view.instances, &[]);
        pass.set_pipeline(&self.pipeline);
        for piece in &self.pieces {
            pass.set_bind_group(1, &piece.records, &[]);
            pass.set_bind_group(2, &piece.written, &[]);
            if let Teams::Each { bound, .. } = &piece.teams {
                pass.set_bind_group(3, bound, &[]);
            }
            pass.dispatch_workgroups(piece.workgroups, 1, 1);
        }
        for (number, pipeline) in (0..).zip(&self.of_large) {
            pass.set_pipeline(pipeline);
            for piece in &self.pieces {
                pass.set_bind_group(1, &piece.records, &[]);
                pass.set_bind_group(2, &piece.written, &[]);
                match &piece.teams {
                    Teams::Shared(teams) => pass.dispatch_workgroups(*teams, 1, 1),
                    Teams::Each { arguments, .. } => {
                        pass.dispatch_workgroups_indirect(arguments, number * ARGUMENT_BYTES);
                    }
                }
            }
        }
    }
}
