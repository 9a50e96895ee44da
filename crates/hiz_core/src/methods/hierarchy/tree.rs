//! An octree over the meshlets of all copies, in which nothing small is held by a large node.
//!
//! The tree of Greene, Kass and Miller holds what crosses a cube's middle planes in that cube.
//! So a small triangle may come to lie in the largest cube, which is hardly ever hidden.
//! Here a meshlet goes down into the cell that contains its middle, as long as that cell is no
//! smaller than the meshlet (loose octree: Ulrich 2000).
//! The box of a node is the box around what it holds, so its looseness costs nothing.

use std::ops::Range;

use crate::error::Result;
use crate::host::linear::Vec3;
use crate::host::memory;
use crate::methods::hierarchy::planted_fault::{Planted, is_planted};
use crate::occluders::host_raster::one_by_one::WorldBox;
use crate::occluders::placement::Placement;
use crate::occluders::shapes::Shapes;

/// A meshlet of a copy, as `(copy, meshlet)`.
pub(super) type Item = (u32, u32);

/// A node of the tree.
#[derive(Debug, Clone)]
pub(super) struct Node {
    /// The box around all that it and its children hold.
    pub(super) bounds: WorldBox,
    /// The meshlets that it holds itself: some of [`Tree::items`].
    pub(super) own: Range<u32>,
    /// Those of all nodes below it, and its own.
    pub(super) all: Range<u32>,
    pub(super) children: Range<u32>,
    /// `u32::MAX` for the root.
    pub(super) parent: u32,
    /// The root has level 0.
    pub(super) level: u8,
    /// Triangles of `all`.
    pub(super) triangles: u64,
}

/// The nodes, parents before children; the first one is the root.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) items: Vec<Item>,
}

/// A meshlet on its way into the tree.
#[derive(Debug, Clone, Copy)]
struct Placed {
    item: Item,
    bounds: WorldBox,
    middle: Vec3,
    /// The largest side of its box.
    size: f64,
    triangles: u32,
}

/// A cube of space.
#[derive(Debug, Clone, Copy)]
struct Cell {
    middle: Vec3,
    side: f64,
}

impl Cell {
    fn octant_of(&self, p: Vec3) -> usize {
        (0..3).map(|k| usize::from(p[k] >= self.middle[k]) << k).sum()
    }

    fn octant(&self, octant: usize) -> Self {
        let quarter = 0.25 * self.side;
        let offset = |k: usize| if octant >> k & 1 == 1 { quarter } else { -quarter };
        Self { middle: std::array::from_fn(|k| self.middle[k] + offset(k)), side: 0.5 * self.side }
    }
}

impl Tree {
    /// The tree over all meshlets of all copies.
    ///
    /// A node of more than `threshold` meshlets is split, down to level `deepest`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub(super) fn new(
        shapes: &Shapes,
        placements: &[Placement],
        (threshold, deepest): (usize, u8),
        fault: Planted,
    ) -> Result<Self> {
        let meshlets_of = |p: &Placement| shapes.meshes[p.mesh as usize].meshlets.clone();
        let count = placements.iter().map(|p| meshlets_of(p).len()).sum();
        let mut placed: Vec<Placed> = memory::list(count, "meshlets")?;
        for (copy, placement) in (0..).zip(placements) {
            for number in meshlets_of(placement) {
                let meshlet = &shapes.meshlets[number as usize];
                let bounds = WorldBox::of(placement, meshlet.min, meshlet.max);
                let WorldBox { min, max, .. } = bounds;
                placed.push(Placed {
                    item: (copy, number),
                    bounds,
                    middle: std::array::from_fn(|k| 0.5 * min[k] + 0.5 * max[k]),
                    size: (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max),
                    triangles: meshlet.triangles.len() as u32,
                });
            }
        }
        let mut tree = Self { nodes: Vec::new(), items: Vec::new() };
        if !placed.is_empty() {
            let mut all = WorldBox::NOTHING;
            placed.iter().for_each(|p| all.include(&p.bounds));
            let WorldBox { min, max, .. } = all;
            let side = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
            let cell = Cell { middle: std::array::from_fn(|k| 0.5 * min[k] + 0.5 * max[k]), side };
            tree.nodes.push(Node::unfinished(u32::MAX, 0));
            let splitting = Splitting { threshold: threshold.max(1), deepest, fault };
            tree.fill(0, &mut placed, 0, cell, &splitting)?;
        }
        tree.items = memory::collected(placed.iter().map(|p| p.item), "meshlets")?;
        Ok(tree)
    }

    /// Fills node `index` with `placed`, which begin at `first` among all items.
    fn fill(
        &mut self,
        index: usize,
        placed: &mut [Placed],
        first: u32,
        mut cell: Cell,
        splitting: &Splitting,
    ) -> Result<()> {
        /// Of what is larger than a child's cell.
        const OWN: usize = 0;
        let mut level = self.nodes[index].level;
        let mut ends = [placed.len(); 9];
        while placed.len() > splitting.threshold && level < splitting.deepest {
            // Own ones first, then those of each octant.
            let part = |p: &Placed| {
                if p.size > 0.5 * cell.side { OWN } else { 1 + cell.octant_of(p.middle) }
            };
            placed.sort_by_cached_key(|p| (part(p), p.item));
            ends = std::array::from_fn(|k| placed.partition_point(|p| part(p) <= k));
            // A node whose content lies in one child would say nothing that the child does not.
            let only = (1..9).find(|k| ends[*k] - ends[k - 1] == placed.len());
            let Some(only) = only else { break };
            (cell, level) = (cell.octant(only - 1), level + 1);
            ends = [placed.len(); 9];
        }
        self.nodes[index].level = level;
        let begin = self.nodes.len();
        for k in 1..9 {
            if ends[k] > ends[k - 1] {
                memory::reserve(&mut self.nodes, 1, "nodes")?;
                self.nodes.push(Node::unfinished(index as u32, level + 1));
            }
        }
        let children = begin as u32..self.nodes.len() as u32;
        let mut child = begin;
        for k in 1..9 {
            let (from, to) = (ends[k - 1], ends[k]);
            if to > from {
                let below = &mut placed[from..to];
                self.fill(child, below, first + from as u32, cell.octant(k - 1), splitting)?;
                child += 1;
            }
        }
        let mut bounds = WorldBox::NOTHING;
        placed[..ends[OWN]].iter().for_each(|p| bounds.include(&p.bounds));
        let missed =
            usize::from(is_planted!(splitting.fault, ParentMissesChild) && children.len() > 1);
        let known = &self.nodes[begin..begin + children.len() - missed];
        known.iter().for_each(|node| bounds.include(&node.bounds));
        let node = &mut self.nodes[index];
        node.bounds = bounds;
        node.own = first..first + ends[OWN] as u32;
        node.all = first..first + placed.len() as u32;
        node.children = children;
        node.triangles = placed.iter().map(|p| u64::from(p.triangles)).sum();
        Ok(())
    }
}

/// When nodes are split.
struct Splitting {
    threshold: usize,
    deepest: u8,
    fault: Planted,
}

impl Node {
    fn unfinished(parent: u32, level: u8) -> Self {
        let bounds = WorldBox::NOTHING;
        Self { bounds, own: 0..0, all: 0..0, children: 0..0, parent, level, triangles: 0 }
    }
}
