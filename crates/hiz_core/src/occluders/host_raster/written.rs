//! Writing the image as NDC depth.

use std::ops::Range;

use crate::host::vectors::widest;
use crate::input::image::DepthConvention;
use crate::occluders::host_raster::edges::STEP;
use crate::occluders::host_raster::lens::Image;
use crate::occluders::host_raster::pane::Pane;
use crate::occluders::host_raster::tile::SIDE;

/// Writes some rows of panes that lie side by side, from the image's left to its right edge.
///
/// `out` begins at the first of the rows, and they are `pitch` bytes apart.
/// A row ends at a multiple of 4 pixels; those past the width repeat the last one.
/// `also` gets each row of tiles while it is in the caches: the image's row where it begins, and
/// the rows of depths with their distance.
pub(super) fn write(
    image: &Image,
    panes: &[Pane],
    out: wgpu::WriteOnly<'_, [u8]>,
    pitch: usize,
    rows: Range<i32>,
    convention: DepthConvention,
    also: impl FnMut(i32, &[f32], usize),
) {
    match convention {
        DepthConvention::Reversed => widest(
            #[inline(always)]
            || write_as(image, panes, out, pitch, rows, |nearness| nearness, also),
        ),
        DepthConvention::Standard => widest(
            #[inline(always)]
            || write_as(image, panes, out, pitch, rows, |nearness| 1.0 - nearness, also),
        ),
    }
}

#[inline(always)]
fn write_as(
    image: &Image,
    panes: &[Pane],
    mut out: wgpu::WriteOnly<'_, [u8]>,
    pitch: usize,
    rows: Range<i32>,
    depth_of: impl Fn(f32) -> f32 + Copy,
    mut also: impl FnMut(i32, &[f32], usize),
) {
    let width = image.width as usize;
    let end = width.next_multiple_of(4).min(pitch / size_of::<f32>());
    let wide = width.next_multiple_of(SIDE);
    // A row of tiles, which stays in the caches.
    let mut lines = vec![0.0; SIDE * wide];
    let top = panes[0].top;
    let (first, last) = (rows.start - top, rows.end - 1 - top);
    for row in first / STEP..=last / STEP {
        for pane in panes {
            pane.write_tiles(row as usize, &mut lines, wide, depth_of);
        }
        for (y, line) in (row * STEP..).zip(lines.chunks_exact_mut(wide)) {
            if !(first..=last).contains(&y) {
                continue;
            }
            let repeated = line[width - 1];
            line[width..].fill(repeated);
            let bytes = bytemuck::cast_slice(&line[..end]);
            let at = (y - first) as usize * pitch;
            out.slice(at..at + bytes.len()).copy_from_slice(bytes);
        }
        also(top + row * STEP, &lines, wide);
    }
}
