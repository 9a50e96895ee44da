//! Which sides of a meshlet's triangles are drawn.
//!
//! A caller may cull fronts or backs.
//! Where none are culled, the faces by which a ray leaves a closed part are left out: it has met a
//! face before by which it entered.
//! docs/occluders.md says why that takes no pixel away.

use crate::input::mesh::FaceCull;
use crate::occluders::host_raster::lens::{Image, Lens};
use crate::occluders::host_raster::planted_fault::is_planted;
use crate::occluders::meshlets::{Blocks, ClosedOf, LANES, MAX_TRIANGLES, Meshlet};

/// Groups of a meshlet's triangles.
const GROUPS: usize = MAX_TRIANGLES / LANES;

/// Which sides of triangles are drawn.
#[derive(Debug)]
pub(super) enum Sides<'a> {
    Both,
    /// Those whose area in the image has this sign.
    Same(f32),
    /// By triangle, those whose area has the sign of the product; 0: both.
    Own(&'a [[i8; LANES]], f32),
}

impl Sides<'_> {
    /// The sides that `culled` leaves.
    pub(super) fn of(culled: FaceCull) -> Self {
        // Rows run downwards, so what is counter-clockwise with y up has a negative area here.
        match culled {
            FaceCull::None => Self::Both,
            FaceCull::Back => Self::Same(-1.0),
            FaceCull::Front => Self::Same(1.0),
        }
    }
}

/// The senses of a meshlet's triangles, where some parts of it count and some do not.
#[derive(Debug, Default)]
pub(super) struct Senses([[i8; LANES]; GROUPS]);

impl Senses {
    /// Which sides of a meshlet's triangles are drawn.
    ///
    /// Faces that leave are left out of parts that no ray begins in.
    /// That is asked of each part, so it does not depend on what else is in the meshlet.
    pub(super) fn sides<'a>(
        &'a mut self,
        blocks: &'a Blocks,
        meshlet: &Meshlet,
        lens: &Lens,
        culled: FaceCull,
        image: &Image,
    ) -> Sides<'a> {
        let Some(leaving) = lens.leaving.filter(|_| culled == FaceCull::None) else {
            return Sides::of(culled);
        };
        let is_planted = is_planted!(image.fault, EnteringLeftOut);
        let entering = if is_planted { leaving.sign } else { -leaving.sign };
        if is_planted!(image.fault, OpenCountsAsClosed) {
            self.0 = [[1; LANES]; GROUPS];
            return Sides::Own(&self.0, entering);
        }
        let Some(closed) = meshlet.closed else { return Sides::Both };
        let ClosedOf { min, max, parts, first_group } = &blocks.closed[closed as usize];
        let count = meshlet.groups().len();
        let senses = &blocks.senses[*first_group as usize..][..count];
        if leaving.is_outside(min, max) || is_planted!(image.fault, ClosedBeforeTheEye) {
            return Sides::Own(senses, entering);
        }
        let parts = &blocks.closed_parts[parts.start as usize..parts.end as usize];
        let mut counts = [0_i8; MAX_TRIANGLES];
        for (part, counts) in parts.iter().zip(&mut counts) {
            *counts = i8::from(leaving.is_outside(&part.min, &part.max));
        }
        let part_of = &blocks.part_of[*first_group as usize..][..count];
        for ((out, senses), part_of) in self.0.iter_mut().zip(senses).zip(part_of) {
            for l in 0..LANES {
                out[l] = senses[l] * counts[usize::from(part_of[l]) % MAX_TRIANGLES];
            }
        }
        Sides::Own(&self.0[..count], entering)
    }
}
