//! The triangles that need not be looked at, because solids of one image stand for them.

use std::ops::Range;

use crate::occluders::placement::Placement;
use crate::occluders::surface::solids::Solids;

/// Which solids stand for their triangles.
#[derive(Debug)]
pub(super) struct LeftOut<'a> {
    solids: &'a Solids,
    /// By copy: where its solids begin in the lists by solid, less the number of its first one.
    of_copy: Vec<u32>,
    /// By solid of a copy.
    is_left_out: Vec<bool>,
    /// Meshlets of copies that have triangles besides those that are left out, sorted.
    mixed: Vec<(u32, u32)>,
}

impl<'a> LeftOut<'a> {
    /// All but the triangles of solids that share edges with others.
    ///
    /// `is_linked` says whether a copy shares any with another one.
    pub(super) fn new(
        solids: &'a Solids,
        placements: &[Placement],
        is_linked: impl Fn(u32) -> bool,
    ) -> Self {
        let mut all =
            Self { solids, of_copy: Vec::new(), is_left_out: Vec::new(), mixed: Vec::new() };
        for (copy, placement) in (0..).zip(placements) {
            let own = solids.of_mesh(placement.mesh);
            let before = all.is_left_out.len() as u32;
            all.of_copy.push(before.wrapping_sub(own.start));
            all.is_left_out.resize(all.is_left_out.len() + own.len(), true);
            let is_linked = is_linked(copy);
            for solid in own.filter(|solid| is_linked || solids.get(*solid).is_shared) {
                all.keep(copy, solid);
            }
        }
        all.sort();
        all
    }

    /// The solids of all copies.
    pub(super) fn num_solids(&self) -> usize {
        self.is_left_out.len()
    }

    /// A solid's place in lists by solid of a copy.
    #[inline]
    pub(super) fn place(&self, copy: u32, solid: u32) -> usize {
        self.of_copy[copy as usize].wrapping_add(solid) as usize
    }

    /// Leaves a solid to its triangles, besides; [`LeftOut::sort`] has to follow.
    pub(super) fn keep(&mut self, copy: u32, solid: u32) {
        let place = self.place(copy, solid);
        if std::mem::take(&mut self.is_left_out[place]) {
            self.mixed.extend(self.solids.meshlets(solid).iter().map(|m| (copy, *m)));
        }
    }

    /// Makes the list of meshlets fit to be searched.
    pub(super) fn sort(&mut self) {
        self.mixed.sort_unstable();
    }

    /// Whether all triangles of a meshlet are left out.
    pub(super) fn has_all_of(&self, copy: u32, meshlet: u32) -> bool {
        self.solids.is_solid(meshlet) && self.mixed.binary_search(&(copy, meshlet)).is_err()
    }

    /// Which of some triangles are left out: bit k for the triangle k after the first.
    #[inline(never)]
    pub(super) fn among(&self, copy: u32, triangles: &Range<u32>) -> u128 {
        let mut set = 0;
        for (k, triangle) in triangles.clone().enumerate() {
            let solid = self.solids.of_triangle(triangle);
            let is_out = solid.is_some_and(|solid| self.is_left_out[self.place(copy, solid)]);
            set |= u128::from(is_out) << k;
        }
        set
    }
}
