//! Hierarchical visibility: an octree of the scene is walked front to back against a pyramid of the
//! depths that were drawn so far.
//!
//! Source: Greene, Kass and Miller, *Hierarchical Z-buffer visibility*, SIGGRAPH 1993, sections 3.1
//! (octree), 3.2 (pyramid) and 3.3 (coherence from frame to frame); as *Real-Time Rendering*
//! (Moller and Haines 1999, the chapter on culling) tells it.
//!
//! 1. `tree`: an octree over meshlets.
//!    Above `threshold` meshlets a node is split, down to a deepest level.
//!    Nothing small is held by a large node.
//! 2. `walk`: nodes come nearest first.
//!    A node whose box is hidden goes with all below it.
//!    What a visible node holds is drawn at once.
//! 3. `z_pyramid`: after each meshlet the tiles that got nearer are propagated upward.
//!    The test of a box begins with the smallest cell that encloses it, and ends at the pixels.
//!
//! What differs from the text:
//!
//! - The primitives are meshlets of at most 128 triangles, not single polygons.
//! - Boxes are tight around what a node holds, and a box is tested by its rectangle and its nearest
//!   depth, not face by face.
//! - A priority queue gives the order, so siblings of different parents are in order, too.
//!
//! A hidden box is farther than all pixels of its rectangle, with margins for every rounding.
//! So the image has the same bits as one that was drawn without skipping.

mod frame;
mod planted_fault;
mod tree;
mod walk;
mod z_pyramid;

use std::time::Instant;

use crate::error::{Error, Result};
use crate::host::memory;
use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::input::mesh::MeshData;
use crate::methods::hierarchy::planted_fault::Planted;
use crate::methods::hierarchy::tree::Tree;
use crate::methods::hierarchy::walk::Walk;
use crate::methods::hierarchy::z_pyramid::ZPyramid;
use crate::occluders::drawing::{DrawOptions, OccluderOptions};
use crate::occluders::host_raster::one_by_one::{Looks, OneByOne};
use crate::occluders::host_raster::{HostRaster, Scene, Told, Way};
use crate::occluders::placement::Placement;
use crate::occluders::surface::OccluderSurface;

pub use frame::{
    CoveredCentres, FlatFrame, HierarchyCounts, HierarchyFrame, HierarchyNode, NodeState,
};
#[cfg(feature = "testing")]
pub use planted_fault::HierarchyFault;

/// When nodes of the tree are split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HierarchyOptions {
    /// A node of more meshlets is split; at least 1.
    pub threshold: u32,
    /// The root has level 0, and nodes of this level are not split; at most 30.
    pub deepest: u32,
}

impl Default for HierarchyOptions {
    fn default() -> Self {
        Self { threshold: 4, deepest: 16 }
    }
}

/// The algorithm of Greene, Kass and Miller over the meshlets of triangle meshes.
///
/// # Examples
/// ```
/// use hiz_core::methods::hierarchy::{HierarchicalVisibility, HierarchyOptions};
/// use hiz_core::{Floats, MeshData, OccluderOptions};
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
///
/// // A wall that fills the view, and 16 triangles in a row behind it.
/// let wall = [-50.0, -50.0, -10.0, 50.0, -50.0, -10.0, -50.0, 50.0, -10.0, 50.0, 50.0, -10.0];
/// let row: Vec<[f64; 9]> = (-8..8)
///     .map(f64::from)
///     .map(|x| [x, 0.0, -30.0, x + 1.0, 0.0, -30.0, x, 1.0, -30.0])
///     .collect();
/// let mesh = |corners, triangles| {
///     MeshData { vertices: Floats::F64(corners), triangles, transforms: None }
/// };
/// let behind = row.iter().map(|corners| mesh(&corners[..], &[0, 1, 2][..]));
/// let meshes: Vec<_> = std::iter::once(mesh(&wall, &[0, 1, 2, 2, 1, 3])).chain(behind).collect();
/// let options = HierarchyOptions { threshold: 1, ..HierarchyOptions::default() };
/// let scene = HierarchicalVisibility::new(&meshes, &OccluderOptions::default(), &options)?;
/// let frame = scene.render(&camera, &[], false)?;
/// assert_eq!(frame.counts.triangles_drawn, 2);
/// assert_eq!(frame.counts.triangles_in_hidden_nodes, 16);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct HierarchicalVisibility {
    surface: OccluderSurface,
    tree: Tree,
    fault: Planted,
    /// The images of the last frame, for the next one of that size.
    images: Locked<Option<Images>>,
}

struct Images {
    image: OneByOne,
    pyramid: ZPyramid,
    flat: HostRaster,
}

impl std::fmt::Debug for Images {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Images").field("size", &self.pyramid.size()).finish_non_exhaustive()
    }
}

impl HierarchicalVisibility {
    /// Builds the tree.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for options out of range, and for meshes as in
    ///   [`OccluderSurface::from_meshes`].
    /// - [`Error::OutOfMemory`].
    pub fn new(
        meshes: &[MeshData<'_>],
        drawing: &OccluderOptions,
        options: &HierarchyOptions,
    ) -> Result<Self> {
        Self::build(meshes, drawing, options, Planted::default())
    }

    /// [`HierarchicalVisibility::new`] with a planted fault, for tests.
    ///
    /// # Errors
    /// As [`HierarchicalVisibility::new`].
    #[cfg(feature = "testing")]
    pub fn with_fault(
        meshes: &[MeshData<'_>],
        drawing: &OccluderOptions,
        options: &HierarchyOptions,
        fault: Option<HierarchyFault>,
    ) -> Result<Self> {
        Self::build(meshes, drawing, options, Planted(fault))
    }

    fn build(
        meshes: &[MeshData<'_>],
        drawing: &OccluderOptions,
        options: &HierarchyOptions,
        fault: Planted,
    ) -> Result<Self> {
        let HierarchyOptions { threshold, deepest } = *options;
        if threshold == 0 {
            return Err(Error::invalid("threshold", "expected at least 1 meshlet, got 0"));
        }
        if deepest > 30 {
            return Err(Error::invalid(
                "deepest",
                format!("expected a level of at most 30, got {deepest}"),
            ));
        }
        let surface = OccluderSurface::from_meshes(meshes, drawing)?;
        let splitting = (threshold as usize, deepest as u8);
        let tree = Tree::new(surface.shapes(), &surface.placements(), splitting, fault)?;
        Ok(Self { surface, tree, fault, images: Locked::default() })
    }

    /// The nodes of the tree, parents before children; the first one is the root.
    pub fn nodes(&self) -> impl ExactSizeIterator<Item = HierarchyNode> {
        self.tree.nodes.iter().map(|node| HierarchyNode {
            min: node.bounds.min,
            max: node.bounds.max,
            parent: (node.parent != u32::MAX).then_some(node.parent),
            level: node.level.into(),
            meshlets: node.own.len() as u32,
            triangles: node.triangles,
        })
    }

    /// The number of triangles, counted once per transform of their mesh.
    pub fn num_triangles(&self) -> u64 {
        self.surface.num_triangles()
    }

    /// The number of meshlets, counted once per transform of their mesh.
    pub fn num_meshlets(&self) -> usize {
        self.tree.items.len()
    }

    /// Draws what `camera` sees, front to back.
    ///
    /// `previous` are nodes that are drawn first and untested: the visible leaves of the last
    /// frame.
    /// They change no pixel, and neither does their order.
    /// `count` asks for [`HierarchyFrame::centres`], which takes much longer than the frame.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a camera that float32 cannot hold, and for nodes that do not exist.
    /// - [`Error::OutOfMemory`].
    pub fn render(&self, camera: &Camera, previous: &[u32], count: bool) -> Result<HierarchyFrame> {
        let nodes = self.tree.nodes.len();
        if let Some(bad) = previous.iter().find(|node| **node as usize >= nodes) {
            return Err(Error::invalid(
                "previous",
                format!("expected numbers of the {nodes} nodes, got {bad}"),
            ));
        }
        let mut kept = self.images.lock();
        let Images { image, pyramid, .. } = self.images_of(&mut kept, camera.size());
        let placements = self.surface.placements();
        let copies: Vec<_> = (0..).zip(placements.iter()).collect();
        let start = Instant::now();
        let looks = Looks::new(self.scene(&copies, camera))?;
        image.clear();
        pyramid.clear();
        let states = vec![NodeState::NotVisited; nodes];
        let mut frame = HierarchyFrame {
            depth: Vec::new(),
            levels: Vec::new(),
            states: Vec::new(),
            visible_leaves: Vec::new(),
            counts: HierarchyCounts::default(),
            centres: count.then(CoveredCentres::default),
            milliseconds: 0.0,
        };
        if let Some(mut looks) = looks {
            let (tree, shapes, looks) = (&self.tree, self.surface.shapes(), &mut looks);
            let counts = HierarchyCounts::default();
            let (image, pyramid) = (&mut *image, &mut *pyramid);
            let mut walk =
                Walk { tree, shapes, looks, image, pyramid, states, counts, drawn: Vec::new() };
            frame.visible_leaves = walk.frame(previous);
            let Walk { states, counts, drawn, looks, image, .. } = walk;
            frame.milliseconds = start.elapsed().as_secs_f64() * 1e3;
            (frame.states, frame.counts) = (states, counts);
            frame.centres = count.then(|| self.centres(looks, image, &drawn));
        }
        let convention = camera.convention();
        frame.depth = empty_image(camera)?;
        image.write(&mut frame.depth, convention);
        frame.levels = pyramid.written(&frame.depth, convention);
        Ok(frame)
    }

    /// The same image by the list that [`OccluderSurface::depth`] draws, on one thread.
    ///
    /// # Errors
    /// Those of [`HierarchicalVisibility::render`].
    pub fn render_flat(&self, camera: &Camera) -> Result<FlatFrame> {
        let mut kept = self.images.lock();
        let Images { flat, .. } = self.images_of(&mut kept, camera.size());
        let placements = self.surface.placements();
        let copies: Vec<_> = (0..).zip(placements.iter()).collect();
        let way = Way { threads: Some(1), skip: true };
        let start = Instant::now();
        flat.clear();
        let scene = self.scene(&copies, camera);
        let mut drawn = flat.draw(&scene, way, &DrawOptions::default(), &Told::default())?;
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        drawn.told.sort();
        let shown = drawn.told.shown();
        let meshlets = &self.surface.shapes().meshlets;
        let triangles = shown.iter().map(|(_, m)| meshlets[*m as usize].triangles.len() as u64);
        let (meshlets_drawn, triangles_drawn) = (shown.len() as u64, triangles.sum());
        let mut depth = empty_image(camera)?;
        flat.write(&mut depth, camera.convention(), Some(1));
        Ok(FlatFrame { depth, meshlets_drawn, triangles_drawn, milliseconds })
    }

    fn scene<'a>(&'a self, copies: &'a [(u32, &'a Placement)], camera: &'a Camera) -> Scene<'a> {
        let cull_mode = self.surface.cull_mode();
        Scene { shapes: self.surface.shapes(), copies, camera, cull_mode }
    }

    /// The images of this size: those that were kept, or new ones.
    fn images_of<'a>(&self, kept: &'a mut Option<Images>, size: ImageSize) -> &'a mut Images {
        if kept.as_ref().is_some_and(|images| images.pyramid.size() != size) {
            *kept = None;
        }
        kept.get_or_insert_with(|| Images {
            image: OneByOne::new(size),
            pyramid: ZPyramid::new(size, self.fault),
            flat: HostRaster::new(size),
        })
    }

    /// The centres that triangles cover: of all meshlets in the view, and of those drawn.
    fn centres(
        &self,
        looks: &mut Looks<'_>,
        image: &mut OneByOne,
        drawn: &[u32],
    ) -> CoveredCentres {
        let mut is_drawn = vec![false; self.tree.items.len()];
        drawn.iter().for_each(|index| is_drawn[*index as usize] = true);
        let mut sums = CoveredCentres::default();
        for (item, is_drawn) in self.tree.items.iter().zip(is_drawn) {
            if let Some(extent) = image.extent_of(looks, *item) {
                let centres = image.centres(looks, *item, &extent);
                sums.in_view += centres;
                sums.drawn += if is_drawn { centres } else { 0 };
            }
        }
        sums
    }
}

fn empty_image(camera: &Camera) -> Result<Vec<f32>> {
    let pixels = camera.size().pixels() as usize;
    let mut depth = memory::list(pixels, "depth")?;
    depth.resize(pixels, 0.0);
    Ok(depth)
}
