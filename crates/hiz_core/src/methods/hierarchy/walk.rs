//! One frame: the walk through the tree, front to back.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::methods::hierarchy::frame::{HierarchyCounts, NodeState};
use crate::methods::hierarchy::tree::{Node, Tree};
use crate::methods::hierarchy::z_pyramid::ZPyramid;
use crate::occluders::host_raster::one_by_one::{Extent, Looks, OneByOne};
use crate::occluders::shapes::Shapes;

/// A node, or a large meshlet that a node with children holds itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum What {
    Node(u32),
    Meshlet(u32),
}

/// Something that waits for its turn, and what may show of it.
#[derive(Debug)]
struct Waiting {
    extent: Extent,
    what: What,
}

impl Waiting {
    /// The nearest comes first; positive floats are ordered like their bits.
    fn key(&self) -> (u32, Reverse<What>) {
        (self.extent.nearest.to_bits(), Reverse(self.what))
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Waiting {}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key().cmp(&other.key())
    }
}

/// A frame that is being drawn.
pub(super) struct Walk<'a, 'b> {
    pub(super) tree: &'a Tree,
    pub(super) shapes: &'a Shapes,
    pub(super) looks: &'b mut Looks<'a>,
    pub(super) image: &'b mut OneByOne,
    pub(super) pyramid: &'b mut ZPyramid,
    pub(super) states: Vec<NodeState>,
    pub(super) counts: HierarchyCounts,
    /// Items that were drawn, in the order of drawing.
    pub(super) drawn: Vec<u32>,
}

impl Walk<'_, '_> {
    /// Draws what the nodes of the last frame hold, then walks; returns the visible leaves.
    pub(super) fn frame(&mut self, previous: &[u32]) -> Vec<u32> {
        let mut is_drawn = vec![false; self.tree.nodes.len()];
        previous.iter().for_each(|node| is_drawn[*node as usize] = true);
        self.draw_untested(&is_drawn);
        let mut waiting = BinaryHeap::new();
        let mut leaves = Vec::new();
        if !self.tree.nodes.is_empty() {
            self.meet(0, &mut waiting);
        }
        while let Some(Waiting { extent, what }) = waiting.pop() {
            let number = match what {
                What::Node(number) => number,
                What::Meshlet(index) => {
                    self.draw_unless_hidden(index, &extent);
                    continue;
                }
            };
            let node = &self.tree.nodes[number as usize];
            if self.is_hidden(&extent) {
                self.states[number as usize] = NodeState::Hidden;
                self.counts.triangles_in_hidden_nodes += node.triangles;
                continue;
            }
            self.states[number as usize] = NodeState::Visible;
            if !node.own.is_empty() {
                leaves.push((number, extent));
                if !is_drawn[number as usize] {
                    self.open(node, &extent, &mut waiting);
                }
            }
            for child in node.children.clone() {
                self.meet(child, &mut waiting);
            }
        }
        for node in (0_u32..).zip(&is_drawn).filter(|(_, is_drawn)| **is_drawn).map(|(n, _)| n) {
            self.count_drawn_in_hidden(node);
        }
        // What was seen at its turn may be hidden by what came later.
        leaves.retain(|(_, extent)| !self.pyramid.hides(self.image, extent).0);
        let mut leaves: Vec<u32> = leaves.into_iter().map(|(number, _)| number).collect();
        leaves.sort_unstable();
        leaves
    }

    /// Lets a node wait if it may be in the view.
    fn meet(&mut self, number: u32, waiting: &mut BinaryHeap<Waiting>) {
        let node = &self.tree.nodes[number as usize];
        match self.image.extent_of_box(self.looks, &node.bounds) {
            Some(extent) => waiting.push(Waiting { extent, what: What::Node(number) }),
            None => {
                self.states[number as usize] = NodeState::Outside;
                self.counts.triangles_outside += node.triangles;
            }
        }
    }

    /// The test of a node, counted.
    fn is_hidden(&mut self, extent: &Extent) -> bool {
        let (is_hidden, comparisons) = self.pyramid.hides(self.image, extent);
        self.counts.comparisons += comparisons;
        self.counts.settled_by_one += u64::from(comparisons == 1);
        is_hidden
    }

    fn triangles(&self, item: (u32, u32)) -> u64 {
        self.shapes.meshlets[item.1 as usize].triangles.len() as u64
    }

    /// Draws what a visible node holds, each meshlet after a test of its own.
    ///
    /// A node with children holds large meshlets, which wait for their turn.
    fn open(&mut self, node: &Node, extent: &Extent, waiting: &mut BinaryHeap<Waiting>) {
        if node.own.len() == 1 && node.children.is_empty() {
            // The node's box is the meshlet's, and was tested just now.
            self.draw(node.own.start, extent);
            return;
        }
        let mut seen: Vec<Waiting> = Vec::with_capacity(node.own.len());
        for index in node.own.clone() {
            let item = self.tree.items[index as usize];
            match self.image.extent_of(self.looks, item) {
                Some(extent) => seen.push(Waiting { extent, what: What::Meshlet(index) }),
                None => self.counts.triangles_outside += self.triangles(item),
            }
        }
        if !node.children.is_empty() {
            waiting.extend(seen);
            return;
        }
        seen.sort_unstable_by_key(|waiting| Reverse(waiting.key()));
        for waiting in seen {
            if let What::Meshlet(index) = waiting.what {
                self.draw_unless_hidden(index, &waiting.extent);
            }
        }
    }

    fn draw_unless_hidden(&mut self, index: u32, extent: &Extent) {
        if self.pyramid.hides(self.image, extent).0 {
            let item = self.tree.items[index as usize];
            self.counts.triangles_in_hidden_meshlets += self.triangles(item);
        } else {
            self.draw(index, extent);
        }
    }

    /// Draws what these nodes hold, as far as it is in the view, nearest first.
    fn draw_untested(&mut self, is_chosen: &[bool]) {
        let mut seen: Vec<Waiting> = Vec::new();
        for (node, _) in self.tree.nodes.iter().zip(is_chosen).filter(|(_, chosen)| **chosen) {
            for index in node.own.clone() {
                let item = self.tree.items[index as usize];
                match self.image.extent_of(self.looks, item) {
                    Some(extent) => seen.push(Waiting { extent, what: What::Meshlet(index) }),
                    None => self.counts.triangles_outside += self.triangles(item),
                }
            }
        }
        seen.sort_unstable_by_key(|waiting| Reverse(waiting.key()));
        for waiting in seen {
            if let What::Meshlet(index) = waiting.what {
                self.draw(index, &waiting.extent);
            }
        }
    }

    fn draw(&mut self, index: u32, extent: &Extent) {
        let item = self.tree.items[index as usize];
        self.image.draw(self.looks, item, extent);
        self.pyramid.renew(self.image);
        self.counts.triangles_drawn += self.triangles(item);
        self.counts.meshlets_drawn += 1;
        self.drawn.push(index);
    }

    /// Takes what a node of the last frame holds out of the counts of the nodes above it.
    ///
    /// It was counted as drawn or as outside before the walk rejected such a node.
    fn count_drawn_in_hidden(&mut self, number: u32) {
        let own = self.tree.nodes[number as usize].own.clone();
        let mut above = number;
        while above != u32::MAX {
            let sum = match self.states[above as usize] {
                NodeState::Hidden => &mut self.counts.triangles_in_hidden_nodes,
                NodeState::Outside => &mut self.counts.triangles_outside,
                NodeState::NotVisited | NodeState::Visible => {
                    above = self.tree.nodes[above as usize].parent;
                    continue;
                }
            };
            for index in own {
                let (_, meshlet) = self.tree.items[index as usize];
                *sum -= self.shapes.meshlets[meshlet as usize].triangles.len() as u64;
            }
            return;
        }
    }
}
