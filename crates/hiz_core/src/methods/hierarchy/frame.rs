//! A frame of hierarchical visibility, and what it took.

use crate::input::image::ImageSize;

/// What became of a node in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum NodeState {
    /// A node above it was hidden or outside of the view.
    NotVisited = 0,
    /// Its box is outside of the view.
    Outside = 1,
    /// Its box was hidden when its turn came.
    Hidden = 2,
    /// Its box was not hidden when its turn came.
    Visible = 3,
}

/// What a frame did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HierarchyCounts {
    /// Depths that the tests of nodes compared: one for each cell, and one for each pixel.
    pub comparisons: u64,
    /// Nodes whose test took one comparison.
    pub settled_by_one: u64,
    /// Triangles that the boxes of nodes or of meshlets show to be outside of the view.
    pub triangles_outside: u64,
    /// Triangles in and below hidden nodes.
    pub triangles_in_hidden_nodes: u64,
    /// Triangles of hidden meshlets in visible nodes.
    pub triangles_in_hidden_meshlets: u64,
    /// Triangles of the meshlets that were drawn.
    pub triangles_drawn: u64,
    /// Meshlets that were drawn.
    pub meshlets_drawn: u64,
}

/// How many pixels' centres triangles cover, each triangle by itself.
///
/// Divided by the number of pixels this is the depth complexity.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CoveredCentres {
    /// Of all triangles in the view.
    pub in_view: u64,
    /// Of the meshlets that were drawn.
    pub drawn: u64,
}

/// A frame of [`HierarchicalVisibility`](super::HierarchicalVisibility).
#[derive(Debug, Clone, PartialEq)]
pub struct HierarchyFrame {
    /// NDC depth, row 0 on top.
    pub depth: Vec<f32>,
    /// Levels 1 to the coarsest one of the pyramid, with their sizes.
    pub levels: Vec<(ImageSize, Vec<f32>)>,
    /// By node.
    pub states: Vec<NodeState>,
    /// Nodes that hold meshlets and that the finished image does not hide, ascending.
    pub visible_leaves: Vec<u32>,
    /// What it took.
    pub counts: HierarchyCounts,
    /// If it was asked for.
    pub centres: Option<CoveredCentres>,
    /// Milliseconds of the drawing on its one thread, without what comes after it.
    pub milliseconds: f64,
}

/// The same image by the rasteriser's own list: all meshlets in the view, sorted front to back.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatFrame {
    /// NDC depth, row 0 on top.
    pub depth: Vec<f32>,
    /// Meshlets that were drawn.
    pub meshlets_drawn: u64,
    /// Their triangles.
    pub triangles_drawn: u64,
    /// Milliseconds of the drawing on one thread.
    pub milliseconds: f64,
}

/// A node of the tree, for those who look at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HierarchyNode {
    /// The box around what it and the nodes below it hold, in world coordinates.
    pub min: [f64; 3],
    /// The greatest corner of that box.
    pub max: [f64; 3],
    /// The number of the node above it; the root has none.
    pub parent: Option<u32>,
    /// The root has level 0.
    pub level: u32,
    /// Meshlets that it holds itself.
    pub meshlets: u32,
    /// Triangles in it and below it.
    pub triangles: u64,
}
