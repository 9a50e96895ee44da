//! The rasteriser on the host, for devices that are processors.
//!
//! A software driver spends 76 to 98 % of the way from meshes to a mask on drawing the occluders,
//! because its rasteriser is made for pictures.
//! This one draws depth alone, and looks first at what it need not draw:
//!
//! 1. `in_view`: the box of each meshlet against the view, as its `lens` shows it; the rest is
//!    sorted front to back.
//! 2. `pane`: a meshlet whose box is behind all that was drawn where it would show is skipped
//!    (Greene, Kass and Miller 1993; Greene 1996).
//!    The farthest depths of tiles tell this, and pixels where tiles cannot.
//! 3. `vertices`: positions in the image, and the triangles that may cover a pixel's centre.
//!    `sides` says which of their sides are drawn.
//! 4. `triangle`: exact edges on a grid of 1/256 pixel, and the plane of the depth.
//!    `edges` follows them from pixel to pixel and from tile to tile.
//! 5. `tile`: 8x8 pixels as planes with coverage masks, or as pixels.
//!    `tiles` compares eight of them with a triangle at once.
//! 6. `panes`: the parts of the image, each of which one thread draws.
//!
//! **What it promises.**
//! A pixel holds the nearest depth of the triangles that cover its centre.
//! Of closed parts of a mesh the triangles by which a ray leaves do not count (`sides`): where one
//! covers a centre, one by which it enters does, too.
//! Coverage is exact for corners rounded to 1/256 pixel, with the top-left rule, so a centre on a
//! shared edge is covered once.
//! Depth is that of the plane through the corners as they were before that rounding, in float32,
//! and never nearer than the nearest corner.
//! Those corners say, too, which way a face is turned.
//! Nothing is drawn before the near plane or beyond the far plane.
//! Triangles across the near plane or far outside of the image are clipped in float64; a cut whose
//! w is below 2^-33 of its triangle's size has no certain place and is left out.
//! Skipping, the number of panes and the number of threads change no pixel.
//! Without fused multiply-add, which Rust does not use by itself, every machine makes the same
//! bits.
//!
//! Sources: Greene, Kass and Miller, *Hierarchical Z-buffer visibility* (1993); Greene,
//! *Hierarchical polygon tiling with coverage masks* (1996); Hasselgren, Andersson and
//! Akenine-Moller, *Masked software occlusion culling* (2016).

#![allow(clippy::needless_range_loop, reason = "loops over lanes read several arrays at once")]

mod edges;
mod in_view;
mod lanes;
mod lens;
#[cfg(feature = "methods")]
pub(crate) mod one_by_one;
mod pane;
mod panes;
pub(crate) mod planted_fault;
mod sides;
#[cfg(feature = "methods")]
pub(crate) mod snapped;
mod tile;
mod tiles;
mod triangle;
mod vertices;
mod written;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::Result;
use crate::host::memory;
use crate::host::threads::{Locked, cores, on_threads, worth_it};
use crate::host::vectors::with_eight;
use crate::input::image::{DepthConvention, ImageSize};
use crate::input::mesh::FaceCull;
use crate::occluders::drawing::{DrawOptions, Last, Ranked, Touched, both};
pub(crate) use crate::occluders::host_raster::in_view::Scene;
use crate::occluders::host_raster::in_view::{Candidate, in_view};
use crate::occluders::host_raster::lanes::three;
use crate::occluders::host_raster::lens::{Extent, Image, Lens, extent};
use crate::occluders::host_raster::pane::Pane;
use crate::occluders::host_raster::panes::{Grid, Panes, grid_for};
use crate::occluders::host_raster::planted_fault::{Planted, is_planted};
use crate::occluders::host_raster::sides::Senses;
use crate::occluders::host_raster::triangle::{End, Triangle, clipped};
use crate::occluders::host_raster::vertices::Vertices;
use crate::occluders::host_raster::written::write;
use crate::occluders::meshlets::{LANES, Meshlet, PART_GROUPS};
use crate::occluders::shapes::Shapes;
use crate::pyramid::host_levels::LevelRows;

/// A depth image on the host, in the form that the rasteriser draws into.
#[derive(Debug)]
pub(crate) struct HostRaster {
    image: Image,
    panes: Panes,
    /// Whether nothing was drawn yet since it was made or cleared.
    is_clear: bool,
    /// Whether the panes stay as they are.
    is_cut: bool,
}

/// How it is drawn; none of it changes a pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way {
    /// Threads; `None`: as many as the work is worth, of all there are.
    pub(crate) threads: Option<usize>,
    /// Whether hidden meshlets are skipped.
    pub(crate) skip: bool,
}

/// What a drawing did.
#[derive(Debug, Default)]
pub(crate) struct Drawn {
    /// The smallest rectangle around the boxes of what was drawn.
    pub(crate) touched: Touched,
    pub(crate) told: Told,
}

/// Which meshlets were drawn, and which were skipped: copy and number.
#[derive(Debug, Clone, Default)]
pub(crate) struct Told {
    shown: Vec<(u32, u32)>,
    hidden: Vec<(u32, u32)>,
}

impl Told {
    /// Sorts the lists, in which a meshlet that was drawn in parts is more than once before.
    ///
    /// One of which a part was drawn and a part was skipped stays in both.
    pub(crate) fn sort(&mut self) {
        for list in [&mut self.shown, &mut self.hidden] {
            list.sort_unstable();
            list.dedup();
        }
    }

    /// The meshlets that were drawn.
    #[cfg(feature = "methods")]
    pub(crate) fn shown(&self) -> &[(u32, u32)] {
        &self.shown
    }

    fn of(&self, meshlet: (u32, u32)) -> Last {
        let is_in = |list: &[(u32, u32)]| list.binary_search(&meshlet).is_ok();
        if is_in(&self.shown) {
            Last::Shown
        } else if is_in(&self.hidden) {
            Last::Hidden
        } else {
            Last::Unknown
        }
    }
}

impl HostRaster {
    /// An empty image, which is cut into panes for the threads of each drawing that finds it clear.
    pub(crate) fn new(size: ImageSize) -> Self {
        let one = Self::with_fault(size, [1, 1], Planted::default());
        Self { is_cut: false, ..one }
    }

    /// An empty image of about so many columns and rows of panes, with a planted fault for tests.
    pub(crate) fn with_fault(size: ImageSize, grid: Grid, fault: Planted) -> Self {
        let image = Image::of_size(size, fault);
        Self { image, panes: Panes::new(image, grid), is_clear: true, is_cut: true }
    }

    /// Makes the image far everywhere.
    pub(crate) fn clear(&mut self) {
        self.panes.iter_mut().for_each(Pane::clear);
        self.is_clear = true;
    }

    /// Bytes of the image.
    #[cfg(feature = "methods")]
    pub(crate) fn bytes(&self) -> u64 {
        self.panes.bytes()
    }

    /// Draws the copies of a scene, within the limits of `options`.
    ///
    /// `last` is what a drawing with a limit has told before; its lists are sorted.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for a camera that float32 cannot hold, and
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub(crate) fn draw(
        &mut self,
        scene: &Scene<'_>,
        way: Way,
        options: &DrawOptions<'_>,
        last: &Told,
    ) -> Result<Drawn> {
        let (mut lenses, mut candidates) = in_view(scene, &self.image, way.threads)?;
        if options.is_limited() {
            // The faces of a closed part that are left may be those that leave it.
            lenses.iter_mut().for_each(|lens| lens.leaving = None);
            candidates = within_limits(scene.shapes, &lenses, candidates, options, last);
        }
        let mut candidates = self.in_parts(scene.shapes, &lenses, candidates)?;
        // Positive floats are ordered like their bits.
        candidates
            .sort_unstable_by_key(|c| (!c.extent.nearest.to_bits(), c.lens, c.meshlet, c.groups));
        let image = self.image;
        let faces = scene.cull_mode.as_seen_by(scene.camera);
        let drawn: Vec<AtomicBool> = candidates.iter().map(|_| AtomicBool::new(false)).collect();
        let threads = way.threads.unwrap_or_else(|| worth_it(self.drawing_ns(&candidates)));
        if std::mem::take(&mut self.is_clear) && !self.is_cut {
            // More may be added to the image than is drawn now.
            let planned = way.threads.unwrap_or_else(|| threads.max(FEWEST_PLANNED.min(cores())));
            self.panes.cut(image, grid_for(&image, planned));
        }
        on_threads(threads, self.panes.by_work(&candidates), |pane| {
            let (mut vertices, mut triangles) = (Vertices::new(), Vec::new());
            for (candidate, drawn) in candidates.iter().zip(&drawn) {
                let Candidate { extent, .. } = candidate;
                if !pane.meets(extent) {
                    continue;
                }
                if way.skip && pane.hides(extent) {
                    continue;
                }
                drawn.store(true, Ordering::Relaxed);
                let lens = &lenses[candidate.lens as usize];
                draw_meshlet(
                    scene.shapes,
                    candidate,
                    lens,
                    faces,
                    &image,
                    pane,
                    &mut vertices,
                    &mut triangles,
                );
                pane.renew();
            }
        });
        let mut all = Drawn::default();
        for (candidate, drawn) in candidates.iter().zip(&drawn) {
            let meshlet = (candidate.copy, candidate.meshlet);
            if !drawn.load(Ordering::Relaxed) {
                all.told.hidden.push(meshlet);
                continue;
            }
            let Extent { columns, rows, .. } = candidate.extent;
            let rectangle = [columns.0, rows.0, columns.1, rows.1].map(|v| v as u32);
            all.touched = both(all.touched, Some(rectangle));
            all.told.shown.push(meshlet);
        }
        Ok(all)
    }

    /// About how long one thread takes to draw the candidates, in nanoseconds.
    fn drawing_ns(&self, candidates: &[Candidate]) -> u64 {
        let groups: u32 = candidates.iter().map(|c| c.groups.1 - c.groups.0).sum();
        let triangles = LANES * groups as usize;
        // Of the triangles many are skipped, and others are large.
        30 * triangles as u64 + self.image.width as u64 * self.image.height as u64 / 3
    }

    /// About how long one thread takes to write some rows, in nanoseconds.
    fn writing_ns(&self, rows: u64) -> u64 {
        self.image.width as u64 * rows / 2
    }

    /// The candidates, of which those that take much of the image are split.
    ///
    /// Where triangles are large, each one that is skipped saves more than a box costs, and the
    /// order from front to back matters.
    fn in_parts(
        &self,
        shapes: &Shapes,
        lenses: &[Lens],
        candidates: Vec<Candidate>,
    ) -> Result<Vec<Candidate>> {
        let is_whole = |c: &Candidate| {
            c.groups.1 <= PART_GROUPS as u32
                || c.extent.pixels() < SPLIT_FROM * i64::from(c.groups.1) * LANES as i64
        };
        if candidates.iter().all(is_whole) {
            return Ok(candidates);
        }
        let mut parts = memory::list(candidates.len(), "meshlets")?;
        for candidate in candidates {
            if is_whole(&candidate) {
                memory::reserve(&mut parts, 1, "meshlets")?;
                parts.push(candidate);
                continue;
            }
            let meshlet = &shapes.meshlets[candidate.meshlet as usize];
            let lens = &lenses[candidate.lens as usize];
            let boxes = &shapes.blocks.parts[meshlet.first_part as usize..];
            let firsts = (0..candidate.groups.1).step_by(PART_GROUPS);
            memory::reserve(&mut parts, firsts.len(), "meshlets")?;
            with_eight!(eight => for (first, part) in firsts.zip(boxes) {
                if let Some(extent) = extent(eight, lens, &self.image, part.min, part.max) {
                    let end = candidate.groups.1.min(first + PART_GROUPS as u32);
                    parts.push(Candidate { groups: (first, end), extent, ..candidate });
                }
            });
        }
        Ok(parts)
    }

    /// Writes the image as NDC depth, row 0 on top, one number per pixel.
    pub(crate) fn write(
        &self,
        out: &mut [f32],
        convention: DepthConvention,
        threads: Option<usize>,
    ) {
        let threads =
            threads.unwrap_or_else(|| worth_it(self.writing_ns(self.image.height as u64)));
        let pitch = self.image.width as usize * size_of::<f32>();
        let mut rest: &mut [u8] = bytemuck::cast_slice_mut(out);
        let parts: Vec<_> = self
            .panes
            .in_rows(&(0..self.image.height as u32))
            .map(|(panes, rows)| {
                let (part, behind) = std::mem::take(&mut rest).split_at_mut(rows.len() * pitch);
                rest = behind;
                (panes, rows, part)
            })
            .collect();
        on_threads(threads, parts, |(panes, rows, part)| {
            let out = wgpu::WriteOnly::from_mut(part);
            write(&self.image, panes, out, pitch, rows, convention, |_, _, _| ());
        });
    }

    /// Writes some rows of the image as NDC depth, `pitch` bytes from row to row.
    ///
    /// `open` opens a range of the bytes that begin with the first of these rows.
    /// Where the pitch has room, a row ends at a multiple of 4 pixels; those past the width repeat
    /// the last one.
    /// `levels` are made of them, too, if these are all rows.
    ///
    /// # Errors
    /// The first one of `open` or of `levels`.
    pub(crate) fn write_rows(
        &self,
        open: impl Fn(Range<u64>) -> Result<wgpu::BufferViewMut> + Sync,
        pitch: usize,
        convention: DepthConvention,
        rows: &Range<u32>,
        levels: Option<&LevelRows<'_>>,
    ) -> Result<()> {
        let threads = worth_it(self.writing_ns(rows.len() as u64));
        let failed = Locked::new(None);
        let parts: Vec<_> = self.panes.in_rows(rows).collect();
        let write_part = |panes: &[Pane], part: Range<i32>| {
            let byte = |row: i32| ((row - rows.start as i32) as usize * pitch) as u64;
            let mut view = open(byte(part.start)..byte(part.end))?;
            let image_rows = part.start as u32..part.end as u32;
            let mut levels = levels.map(|levels| levels.part(image_rows)).transpose()?;
            let also = |top: i32, lines: &[f32], wide: usize| {
                if let Some(levels) = &mut levels {
                    levels.add(top as u32, bytemuck::cast_slice(lines), wide);
                }
            };
            write(&self.image, panes, view.slice(..), pitch, part, convention, also);
            Ok(())
        };
        on_threads(threads, parts, |(panes, part)| {
            if let Err(error) = write_part(panes, part) {
                *failed.lock() = Some(error);
            }
        });
        let failed = failed.lock().take();
        failed.map_or(Ok(()), Err)
    }
}

/// Those of the candidates that a limit leaves.
fn within_limits(
    shapes: &Shapes,
    lenses: &[Lens],
    candidates: Vec<Candidate>,
    options: &DrawOptions<'_>,
    last: &Told,
) -> Vec<Candidate> {
    let ranked = candidates.iter().map(|c| {
        let Meshlet { min, max, triangles, facing, .. } = &shapes.meshlets[c.meshlet as usize];
        let middle = std::array::from_fn(|k| 0.5 * (min[k] + max[k]));
        Ranked {
            copy: c.copy,
            triangles: triangles.len() as u32,
            area: lenses[c.lens as usize].solid_angle(*facing, middle, c.extent.pixels() as f32),
            last: last.of((c.copy, c.meshlet)),
        }
    });
    let is_kept = options.within_limits(&ranked.collect::<Vec<_>>());
    candidates.into_iter().zip(is_kept).filter_map(|(c, kept)| kept.then_some(c)).collect()
}

/// Threads that an image is cut for at least, where there are so many.
const FEWEST_PLANNED: usize = 4;

/// Meshlets are drawn in parts if so many pixels of their box come to each triangle.
const SPLIT_FROM: i64 = 256;

/// Triangles of a meshlet are sorted if so many pixels of its box come to each of them.
const SORTED_FROM: i64 = 1024;

#[expect(clippy::too_many_arguments, reason = "what one loop over triangles needs")]
fn draw_meshlet(
    shapes: &Shapes,
    candidate: &Candidate,
    lens: &Lens,
    faces: FaceCull,
    image: &Image,
    pane: &mut Pane,
    vertices: &mut Vertices,
    triangles: &mut Vec<Triangle>,
) {
    let pixels = pane.pixels();
    triangles.clear();
    triangles_of(shapes, candidate, lens, faces, image, pixels, vertices, |t| triangles.push(*t));
    pane.draw(triangles);
}

/// Hands out the triangles of a meshlet that may cover a centre in these columns and rows.
#[expect(clippy::too_many_arguments, reason = "what one loop over triangles needs")]
#[inline(always)]
fn triangles_of(
    shapes: &Shapes,
    candidate: &Candidate,
    lens: &Lens,
    faces: FaceCull,
    image: &Image,
    pixels: [(i32, i32); 2],
    vertices: &mut Vertices,
    mut out: impl FnMut(&Triangle),
) {
    let meshlet = &shapes.meshlets[candidate.meshlet as usize];
    let mirrored = lens.mirrored && !is_planted!(image.fault, MirrorsIgnored);
    let faces = if mirrored { faces.reversed() } else { faces };
    let groups = candidate.groups.0..candidate.groups.1;
    vertices.project(&shapes.blocks, meshlet, groups.clone(), lens, image);
    let mut senses = Senses::default();
    let sides = senses.sides(&shapes.blocks, meshlet, lens, faces, image);
    vertices.select(&shapes.blocks, meshlet, groups, &sides, image, pixels);
    if candidate.extent.pixels() > SORTED_FROM * vertices.num_kept() as i64 {
        vertices.sort(&shapes.blocks, meshlet);
    }
    for i in 0..vertices.num_kept() {
        let corners = vertices.corners(&shapes.blocks, meshlet, i);
        let projected = three(|k| vertices.projected(corners[k]));
        match projected {
            [Some(a), Some(b), Some(c)] => {
                if let Some(triangle) = Triangle::new([a, b, c], faces, image) {
                    out(&triangle);
                }
            }
            _ => {
                let triangle = meshlet.triangles.start as usize + vertices.kept(i);
                let positions = shapes.triangles[triangle].map(|v| shapes.positions[v as usize]);
                let ends = std::array::from_fn(|k| End {
                    clip: lens.exact_clip(positions[k], image),
                    projected: projected[k],
                });
                clipped(ends, faces, image, &mut out);
            }
        }
    }
}
