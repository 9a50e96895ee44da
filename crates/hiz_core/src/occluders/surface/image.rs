//! The conservative depths of an image: thresholds, proof, finer proof, search.

use crate::input::camera::Camera;
use crate::occluders::surface::cells::Cells;
use crate::occluders::surface::facets::Rounder;
use crate::occluders::surface::links::Standing;
use crate::occluders::surface::looks::{Looks, Placed, Tiles};
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::proof::Proof;
use crate::occluders::surface::sheets::search;
use crate::occluders::surface::thresholds;

/// A pixel is searched if its distance to the far plane may grow by 1 / this at least.
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
    let cells = Cells::new(&placed, &rounder.projector, &looks, links, &open);
    let beyond = if camera.convention().is_reversed() { 0.0 } else { 1.0 };
    let mut far = vec![beyond; size.pixels() as usize];
    search(&cells, &open, refinement, placed.fault, &mut far);
    far
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
    let tiles = Tiles::new(&slabs, size);
    let looks = &Looks::new(&placed, camera, rounder, &tiles);
    let proof = Proof { placed, rounder, looks, links, size, convention };
    let (mut far, is_open) = proof.image(&slabs, &tiles);
    let open = OpenPixels::new(size, is_open);
    let mut is_open = vec![false; far.len()];
    let floors = proof.refine(&open, u32::from(refinement > 0), &mut far);
    for (pixel, floor) in open.pixels().iter().zip(floors) {
        let pixel = *pixel as usize;
        let found = beyond - far[pixel].min(beyond);
        is_open[pixel] = if floor < beyond {
            found < WORTH * (beyond - floor)
        } else {
            // A part that nothing is seen in shows the sky, or what no depth was tried for.
            found <= 0.0 && slabs[pixel].has_surroundings()
        };
    }
    if looks.has_uncertain {
        // What is too uncertain for the proof is missing at the centres, too.
        for (is_open, far) in is_open.iter_mut().zip(&far) {
            *is_open |= *far >= beyond;
        }
    }
    let mut far: Vec<f64> = far.into_iter().map(f64::from).collect();
    let open = OpenPixels::new(size, is_open);
    if !open.is_empty() {
        let cells = Cells::new(&placed, &rounder.projector, looks, links, &open);
        search(&cells, &open, refinement, placed.fault, &mut far);
    }
    far
}
