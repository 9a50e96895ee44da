//! A meshlet's vertices in the image, and the triangles that may cover a pixel's centre.
//!
//! Both loops work on [`LANES`] at a time in arrays of fixed length, which compilers turn into
//! vectors.

use std::ops::Range;

use crate::host::vectors::widest;
use crate::occluders::host_raster::lanes::{greatest, lanes, least, three};
use crate::occluders::host_raster::lens::{HALF, Image, LEAST_W, Lens, rounded};
use crate::occluders::host_raster::planted_fault::is_planted;
use crate::occluders::host_raster::sides::Sides;
use crate::occluders::host_raster::triangle::Corner;
use crate::occluders::meshlets::{
    Blocks, LANES, MAX_TRIANGLES, MAX_VERTICES, Meshlet, PART_GROUPS,
};

/// In a vertex' code: it needs clipping, since it is before the near plane or far outside.
const CLIP: u32 = 1;

/// One number of each vertex.
type PerVertex<T> = [T; MAX_VERTICES];

/// The vertices of one meshlet.
pub(super) struct Vertices {
    /// The position in the image in units, about its middle.
    x: PerVertex<f32>,
    y: PerVertex<f32>,
    nearness: PerVertex<f32>,
    /// [`CLIP`], and a bit for each plane that the vertex is outside of.
    code: PerVertex<u32>,
    /// Triangles that may cover a centre, and how many they are.
    kept: [u8; MAX_TRIANGLES + LANES],
    num_kept: usize,
}

impl Vertices {
    pub(super) fn new() -> Self {
        Self {
            x: [0.0; MAX_VERTICES],
            y: [0.0; MAX_VERTICES],
            nearness: [0.0; MAX_VERTICES],
            code: [0; MAX_VERTICES],
            kept: [0; MAX_TRIANGLES + LANES],
            num_kept: 0,
        }
    }

    /// Projects the vertices of the triangles in `groups` of `meshlet`: of all or of one part.
    pub(super) fn project(
        &mut self,
        blocks: &Blocks,
        meshlet: &Meshlet,
        groups: Range<u32>,
        lens: &Lens,
        image: &Image,
    ) {
        widest(
            #[inline(always)]
            || self.project_groups(blocks, meshlet, groups, lens, image),
        );
    }

    #[inline(always)]
    fn project_groups(
        &mut self,
        blocks: &Blocks,
        meshlet: &Meshlet,
        groups: Range<u32>,
        lens: &Lens,
        image: &Image,
    ) {
        let count = (meshlet.num_vertices as usize).div_ceil(LANES);
        let first = meshlet.first_vertex as usize;
        let high: [&[[f32; LANES]]; 3] =
            blocks.high.each_ref().map(|axis| axis[first..][..count * LANES].as_chunks().0);
        let low: Option<[&[[f32; LANES]]; 3]> = meshlet.first_low.map(|first| {
            let first = first as usize;
            blocks.low.each_ref().map(|axis| axis[first..][..count * LANES].as_chunks().0)
        });
        let mut used = if groups == meshlet.groups() {
            (1 << count) - 1
        } else {
            let part = groups.start as usize / PART_GROUPS;
            u32::from(blocks.parts[meshlet.first_part as usize + part].vertices)
        };
        while used != 0 {
            let group = used.trailing_zeros() as usize;
            used &= used - 1;
            let from_eye = three(
                #[inline(always)]
                |k| {
                    let (hi, lo) = (lens.eye_hi[k], lens.eye_lo[k]);
                    let high = &high[k][group];
                    match &low {
                        None => lanes(|i| (high[i] - hi) - lo),
                        Some(low) => lanes(|i| (high[i] - hi) + (low[k][group][i] - lo)),
                    }
                },
            );
            self.project_group(group, &from_eye, lens, image);
        }
    }

    #[inline(always)]
    fn project_group(
        &mut self,
        group: usize,
        from_eye: &[[f32; LANES]; 3],
        lens: &Lens,
        image: &Image,
    ) {
        fn part<T>(of: &mut PerVertex<T>, group: usize) -> &mut [T; LANES] {
            &mut of.as_chunks_mut().0[group]
        }
        let half = image.half.map(|h| h as f32);
        let (x, y) = (part(&mut self.x, group), part(&mut self.y, group));
        let nearness = part(&mut self.nearness, group);
        let code = part(&mut self.code, group);
        // Number by number, not vertex by vertex, so that compilers make vectors.
        let row = |k: usize| {
            let [a, b, c, d] = lens.rows[k];
            lanes(|i| a * from_eye[0][i] + b * from_eye[1][i] + (c * from_eye[2][i] + d))
        };
        let (all_px, all_py, all_n, all_w) = (row(0), row(1), row(2), row(3));
        for i in 0..LANES {
            let [px, py, n, w] = [all_px[i], all_py[i], all_n[i], all_w[i]];
            // NaN fails each of these, so it is clipped, and there it is dropped.
            let is_behind = (n <= w) | is_planted!(image.fault, NearUnclipped);
            let is_within = (px.abs() <= image.guard[0] * w) & (py.abs() <= image.guard[1] * w)
                | is_planted!(image.fault, GuardClamped);
            let fits = is_behind & is_within & (w > LEAST_W);
            code[i] = u32::from(!fits)
                | u32::from(px < -half[0] * w) << 1
                | u32::from(px > half[0] * w) << 2
                | u32::from(py < -half[1] * w) << 3
                | u32::from(py > half[1] * w) << 4
                | u32::from(n > w) << 5
                | u32::from(n < 0.0) << 6;
            let inverse = 1.0 / w;
            x[i] = px * inverse;
            y[i] = py * inverse;
            nearness[i] = n * inverse;
            if is_planted!(image.fault, GuardClamped) {
                x[i] = x[i].clamp(-image.guard[0], image.guard[0]);
                y[i] = y[i].clamp(-image.guard[1], image.guard[1]);
            }
        }
    }

    /// Finds the triangles in `groups` of `meshlet` that may cover a centre in these columns and
    /// rows, from the first to the last.
    pub(super) fn select(
        &mut self,
        blocks: &Blocks,
        meshlet: &Meshlet,
        groups: Range<u32>,
        sides: &Sides<'_>,
        image: &Image,
        pixels: [(i32, i32); 2],
    ) {
        widest(
            #[inline(always)]
            || match *sides {
                Sides::Both => self.select_among(
                    blocks,
                    meshlet,
                    groups,
                    #[inline(always)]
                    |_, _, _, _| true,
                    image,
                    pixels,
                ),
                Sides::Same(sign) => self.select_among(
                    blocks,
                    meshlet,
                    groups,
                    #[inline(always)]
                    |_, _, area, spare| area * sign >= -spare,
                    image,
                    pixels,
                ),
                Sides::Own(senses, sign) => self.select_among(
                    blocks,
                    meshlet,
                    groups,
                    #[inline(always)]
                    |group, i, area, spare| area * (f32::from(senses[group][i]) * sign) >= -spare,
                    image,
                    pixels,
                ),
            },
        );
    }

    /// `is_wanted` says by group, lane and area of a triangle whether its side is drawn; what the
    /// last number leaves open counts as wanted.
    #[inline(always)]
    fn select_among(
        &mut self,
        blocks: &Blocks,
        meshlet: &Meshlet,
        groups: Range<u32>,
        is_wanted: impl Fn(usize, usize, f32, f32) -> bool,
        image: &Image,
        [(left, right), (top, bottom)]: [(i32, i32); 2],
    ) {
        let count = meshlet.triangles.len();
        let corners = corners_of(blocks, meshlet, groups.clone());
        let [half_x, half_y] = image.half;
        let mut kept = 0;
        for (group, corners) in (groups.start as u8..).zip(corners) {
            let of = |values: &PerVertex<f32>| {
                three(|k| lanes(|i| values[usize::from(corners[k][i]) % MAX_VERTICES]))
            };
            let ([x0, x1, x2], [y0, y1, y2]) = (of(&self.x), of(&self.y));
            let [c0, c1, c2] =
                three(|k| lanes(|i| self.code[usize::from(corners[k][i]) % MAX_VERTICES]));
            let mut keep = [0_u32; LANES];
            for i in 0..LANES {
                let outside = (c0[i] & c1[i] & c2[i]) & !CLIP;
                let clip = (c0[i] | c1[i] | c2[i]) & CLIP;
                let ends = |a, b, c| (least(least(a, b), c), greatest(greatest(a, b), c));
                let (x, y) = (ends(x0[i], x1[i], x2[i]), ends(y0[i], y1[i], y2[i]));
                // The first and the last centre between the extremes, rounded like the corners.
                // What is clipped may be anywhere, and these numbers of it are not used.
                let first = |v: f32, half: i32| rounded(v).wrapping_add(half + HALF - 1) >> 8;
                let last = |v: f32, half: i32| rounded(v).wrapping_add(half - HALF) >> 8;
                let columns = (first(x.0, half_x), last(x.1, half_x));
                let rows = (first(y.0, half_y), last(y.1, half_y));
                let covers = (columns.0 <= columns.1)
                    & (columns.1 >= left)
                    & (columns.0 <= right)
                    & (rows.0 <= rows.1)
                    & (rows.1 >= top)
                    & (rows.0 <= bottom);
                let (ax, ay, bx, by) = (x1[i] - x0[i], y1[i] - y0[i], x2[i] - x0[i], y2[i] - y0[i]);
                let (p, q) = (ax * by, ay * bx);
                // What rounding to the grid leaves open is left to the exact test.
                // Each corner moves by half a unit, so each difference by at most one.
                let spare = (p.abs() + q.abs()) * 1e-6
                    + ((ax.abs() + ay.abs()) + (bx.abs() + by.abs()) + 2.5);
                let spare =
                    if is_planted!(image.fault, SidesOfUnroundedCorners) { 0.0 } else { spare };
                let faces = is_wanted(usize::from(group), i, p - q, spare);
                keep[i] = u32::from((outside == 0) & ((clip != 0) | (covers & faces)));
            }
            for (i, keep) in (0..).zip(keep) {
                self.kept[kept] = group * LANES as u8 + i;
                kept += keep as usize;
            }
        }
        // Padding in the last group is no triangle.
        while kept > 0 && usize::from(self.kept[kept - 1]) >= count {
            kept -= 1;
        }
        self.num_kept = kept;
    }

    /// Sorts the triangles that [`select`](Self::select) has found front to back, nearly.
    ///
    /// Where one of them needs clipping its place in the order is any.
    pub(super) fn sort(&mut self, blocks: &Blocks, meshlet: &Meshlet) {
        // The lowest byte of a key is the triangle, the others are those of its nearest corner.
        let mut keys = [0; MAX_TRIANGLES];
        let keys = &mut keys[..self.num_kept];
        for (i, key) in keys.iter_mut().enumerate() {
            let [a, b, c] = self.corners(blocks, meshlet, i).map(|v| self.nearness[v]);
            let nearest = greatest(greatest(a, b), c);
            *key = (!nearest.to_bits() & !0xFF) | u32::from(self.kept[i]);
        }
        keys.sort_unstable();
        for (kept, key) in self.kept.iter_mut().zip(keys) {
            *kept = *key as u8;
        }
    }

    /// How many triangles [`select`](Self::select) has found.
    pub(super) fn num_kept(&self) -> usize {
        self.num_kept
    }

    /// The `i`-th of these triangles, by its number in the meshlet.
    #[inline(always)]
    pub(super) fn kept(&self, i: usize) -> usize {
        usize::from(self.kept[i])
    }

    /// Where a vertex is in the image; `None` if its triangles need clipping.
    #[inline(always)]
    pub(super) fn projected(&self, vertex: usize) -> Option<Corner> {
        (self.code[vertex] & CLIP == 0).then(|| Corner {
            x: self.x[vertex],
            y: self.y[vertex],
            nearness: self.nearness[vertex],
        })
    }

    /// The corners of the `i`-th of these triangles, as vertices.
    #[inline(always)]
    pub(super) fn corners(&self, blocks: &Blocks, meshlet: &Meshlet, i: usize) -> [usize; 3] {
        let triangle = self.kept(i);
        let group = &blocks.corners[meshlet.first_group as usize + triangle / LANES];
        three(|k| usize::from(group[k][triangle % LANES]) % MAX_VERTICES)
    }
}

/// The corners of the triangles in `groups` of `meshlet`.
#[inline(always)]
fn corners_of<'a>(
    blocks: &'a Blocks,
    meshlet: &Meshlet,
    groups: Range<u32>,
) -> &'a [[[u8; LANES]; 3]] {
    let corners = &blocks.corners[meshlet.first_group as usize..];
    &corners[groups.start as usize..groups.end as usize]
}
