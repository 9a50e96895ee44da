//! The conservative depths of an image: thresholds, proof, finer proof, search.

use crate::host::threads::{cores, on_threads};
use crate::input::camera::Camera;
use crate::occluders::surface::cells::Cells;
use crate::occluders::surface::facets::Rounder;
use crate::occluders::surface::links::Standing;
use crate::occluders::surface::looks::{Looks, Placed, Tiles, Wanted};
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::proof::{Proof, band_rows, bands};
use crate::occluders::surface::sheets::search;
use crate::occluders::surface::thresholds;

/// A pixel is searched if its distance to the far plane is less than this share of what it may be.
///
/// Nothing rests on it.
const WORTH: f32 = 0.98;
/// As [`image`], by a search of all pixels: slow, and what tests compare with.
pub(super) fn searched(
    placed: Placed<'_>,
    links: &Standing<'_>,
    rounder: &Rounder,
    camera: &Camera,
    refinement: u32,
) -> Vec<f64> {
    let size = camera.size();
    let looks = Looks::new(&placed, camera, rounder, &Tiles::open(size));
    let open = OpenPixels::new(size, vec![true; size.pixels() as usize]);
    let beyond = if camera.convention().is_reversed() { 0.0 } else { 1.0 };
    let mut far = vec![beyond; size.pixels() as usize];
    let search = Search { placed, links, rounder, looks: &looks, refinement };
    search.lower(&open, &Tiles::open(size), &mut far);
    far
}

/// What is searched.
#[derive(Debug, Clone, Copy)]
struct Search<'a> {
    placed: Placed<'a>,
    links: &'a Standing<'a>,
    rounder: &'a Rounder,
    looks: &'a Looks,
    refinement: u32,
}

impl Search<'_> {
    /// Lowers the values of `far` of the open pixels where a search finds nearer ones.
    ///
    /// What `tiles` hide is not searched for.
    fn lower(&self, open: &OpenPixels, tiles: &Tiles, far: &mut [f64]) {
        let (size, fault) = (open.size(), self.placed.fault);
        let part = (band_rows(size) * size.width) as usize;
        on_threads(cores(), far.chunks_mut(part).zip(bands(size)), |(far, rows)| {
            if !open.of_rows(rows).is_empty() {
                let wanted = Wanted { open, tiles, rows };
                let projector = &self.rounder.projector;
                let cells = Cells::new(&self.placed, projector, self.looks, self.links, &wanted);
                search(&cells, open, rows, self.refinement, fault, far);
            }
        });
    }
}

/// For every pixel, rows from top to bottom: every ray through its closed square is blocked at this
/// value of `far` or before.
///
/// At least the value at the far plane where that cannot be shown.
/// `centres` are NDC depths at the pixels' centres, for choices alone.
pub(super) fn image(
    placed: Placed<'_>,
    links: &Standing<'_>,
    rounder: &Rounder,
    camera: &Camera,
    refinement: u32,
    centres: &[f32],
) -> Vec<f64> {
    let (size, convention) = (camera.size(), camera.convention());
    let beyond = if convention.is_reversed() { 0.0 } else { 1.0 };
    let slabs = thresholds::image(centres, size, convention);
    let tiles = Tiles::new(slabs.iter().map(|slabs| slabs.last), size);
    let looks = &Looks::new(&placed, camera, rounder, &tiles);
    let proof = Proof { placed, rounder, looks, links, size, convention };
    let (mut far, is_open) = proof.image(&slabs, &tiles);
    let open = OpenPixels::new(size, is_open);
    let mut is_open = vec![false; far.len()];
    let floors = proof.refine(&open, &tiles, u32::from(refinement > 0), &mut far);
    for (pixel, floor) in open.pixels().iter().zip(floors) {
        let pixel = *pixel as usize;
        let found = beyond - far[pixel].min(beyond);
        // Where a sample finds nothing, it may be behind all that was tried.
        is_open[pixel] = found <= 0.0 || found < WORTH * (beyond - floor);
    }
    if looks.has_uncertain {
        // What is too uncertain for the proof is missing at the centres, too.
        for (is_open, far) in is_open.iter_mut().zip(&far) {
            *is_open |= *far >= beyond;
        }
    }
    let mut far: Vec<f64> = far.into_iter().map(|far| f64::from(far.min(beyond))).collect();
    let open = OpenPixels::new(size, is_open);
    if !open.is_empty() {
        // What is farther than what is known of all open pixels around is not searched for.
        #[expect(clippy::cast_possible_truncation, reason = "they were float32 before")]
        let bound = |i: usize| if open.is_open(i) { far[i] as f32 } else { f32::NEG_INFINITY };
        let tiles = Tiles::new((0..far.len()).map(bound), size);
        Search { placed, links, rounder, looks, refinement }.lower(&open, &tiles, &mut far);
    }
    far
}
