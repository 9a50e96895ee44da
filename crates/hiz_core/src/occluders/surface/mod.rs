//! Occluder depth that holds for every larger image of the same view, with any sample positions.
//!
//! A rasterised depth image knows its sample points alone.
//! Between them it may show a wall where a larger image shows a gap beside the wall.
//! A cull against it hides what is visible through that gap.
//! The image made here promises more:
//!
//! > Every ray through the **closed square** of a pixel meets an occluder at the pixel's depth or
//! > nearer, and beyond the near plane.
//! > Where that cannot be shown the pixel is far.
//!
//! So every point of a larger image, with any size, jitter or multisampling, has an occluder at
//! most as far as the pixel that contains the point.
//! A cull with area coverage against the small image is therefore right for the large one.
//!
//! Two published methods promise less:
//!
//! - Hardware and "inner conservative" rasterisers (Akenine-Moller and Aila 2005) give this
//!   guarantee for one triangle alone.
//!   They lose every pixel that an inner edge of a mesh crosses.
//! - Masked Software Occlusion Culling (Hasselgren, Andersson, Akenine-Moller 2016) merges by
//!   sample coverage, and admits the error.
//!
//! Here pixels are covered by sets of triangles, on the host.
//!
//! **Sets of triangles.**
//! Let P be a closed square, and G a set of triangles as they appear in the image.
//! Orient all of them the same way round.
//! Where two triangles of G share an edge and lie on different sides of it, their borders run in
//! opposite directions along the edge and cancel.
//! The edges that remain are the border of G.
//! How often that border winds about a point is the sum over the triangles of how often theirs do.
//! This number does not change while the point moves without crossing the border.
//!
//! Therefore, **if no remaining edge meets P, and the border winds about P's centre a number of
//! times other than 0, then every point of P lies in a triangle of G**.
//! No ray through P then gets farther than the farthest depth that the triangles of G reach in P.
//!
//! Nothing is assumed of G, nor of the signs with which borders are added up.
//! It may fold, overlap, intersect itself or face the wrong way.
//! It may have triangles of area zero, or three triangles at one edge.
//! Every choice of G gives a valid depth.
//!
//! The files follow the data (`image` calls them in this order):
//!
//! 1. `topology` knows which triangles of a mesh share edges, `links` which copies of meshes do.
//!    Both are made once.
//! 2. `thresholds` chooses G by depth, from the depths at the centres of the pixels around P.
//! 3. `solids` knows the closed convex parts of a mesh, such as boxes.
//!    `hulls` takes each of them as one set G, and its triangles are `left_out` of the rest.
//! 4. `looks` picks the meshlets that may matter, and rounds their vertices to 1/256 pixel
//!    (`projector`, `facets`).
//!    `walk` hands out their triangles and edges.
//! 5. `proof` decides in exact integers which G cover their pixels (`coverage`, `squares`,
//!    `chains`).
//!    Single triangles come first (`alone`), then sets for the pixels that are left (`pixel_bits`).
//!    Nearly all pixels end here.
//! 6. `search` decides the rest by the same integers, with G that are connected across shared edges
//!    that meet P (`meeting`).
//!    Each connected component is a sheet, and the nearest of those that cover P counts.
//! 7. `sheets` is the same search in float64, for vertices that are too uncertain for integers
//!    (`cells`, `square`).
//!    Tests compare all pixels with it.
//!
//! Where a sheet covers only a part of P, its quarters are tried.
//! Every ray through P goes through a quarter, so the farthest quarter counts for P.
//!
//! At folds and at silhouettes of closed meshes two triangles lie on the *same* side of their edge.
//! Their borders then add up instead of cancelling.
//! Modulo 2 they cancel again, and an odd winding covers P, too.
//! That closes small folds.
//!
//! **Rounding.**
//! No step trusts a sign that float64 may have got wrong.
//! Integers have their own account in docs/occluders.md; this is that of `sheets`.
//!
//! - Each projected vertex carries a bound of its error, which is a few roundings of its terms,
//!   counted in `projector`.
//! - An exact edge lies within the margins of its ends from the computed edge.
//!   It misses P if the computed edge misses P grown by the margins (`square`).
//! - Moving all vertices from their computed to their exact places moves no border across P.
//!   Each edge of the computed border lies certainly on one side of P's centre.
//!   The computed border therefore winds about it as often as the exact border.
//! - Inner edges that miss P cancel exactly.
//!   The float64 expression for the edge from b to a is the negative of the one for a to b.
//! - Depths are bounded over P grown by the margins, and rounded to float32 towards far.
//!
//! **Near and far.**
//! Triangles are clipped a millionth of the depth range behind the near plane.
//! The cuts are at points that lie exactly on the edges and that neighbours share; the cut itself
//! is a border.
//! Triangles without a certain projection are dropped; their neighbours' edges become borders.
//! Beyond the far plane nothing is hidden: such depths become far.

mod alone;
mod cells;
mod chains;
mod coverage;
mod facets;
mod hulls;
mod image;
mod left_out;
mod links;
mod looks;
mod meeting;
mod open_pixels;
mod pixel_bits;
pub(crate) mod planted_fault;
mod projector;
mod proof;
mod search;
mod sheets;
mod solids;
mod square;
mod squares;
mod thresholds;
mod topology;
mod walk;

use std::sync::{Arc, OnceLock};

use crate::error::{Error, Result};
use crate::host::memory;
use crate::host::threads::Locked;
use crate::host::vectors::widest;
use crate::input::bounds::Floats;
use crate::input::camera::Camera;
use crate::input::mesh::{FaceCull, MeshData};
use crate::occluders::drawing::OccluderOptions;
use crate::occluders::drawing::{DrawOptions, Touched};
use crate::occluders::host_raster::{HostRaster, Scene, Told, Way};
use crate::occluders::placement::Placement;
use crate::occluders::shapes::Shapes;
use crate::occluders::surface::facets::Rounder;
use crate::occluders::surface::links::{Links, Standing};
use crate::occluders::surface::looks::Placed;
use crate::occluders::surface::planted_fault::Planted;
use crate::occluders::surface::projector::Projector;
use crate::occluders::surface::solids::Solids;
use crate::occluders::surface::topology::Topology;
use crate::occluders::view::View;

/// The least normal float32.
/// Depths below it, next to the far plane of reversed Z, count as far.
const LEAST_DEPTH: f32 = f32::MIN_POSITIVE;

/// Choices for [`OccluderSurface::conservative_depth`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConservativeDepthOptions {
    /// How often a pixel is quartered where no sheet covers all of it; more than 8 counts as 8.
    ///
    /// Each step finds more occlusion beside silhouettes and costs time there.
    /// The result is right for every number.
    pub refinement: u32,
}

impl Default for ConservativeDepthOptions {
    fn default() -> Self {
        Self { refinement: 2 }
    }
}

impl ConservativeDepthOptions {
    fn refinement(&self) -> u32 {
        self.refinement.min(8)
    }
}

/// The occluders' triangles on the host, in float64 world coordinates.
///
/// | memory on the host, in bytes | per vertex | per triangle |
/// |---|---|---|
/// | always | 24 | 12 |
/// | from the first conservative depth image on, besides | 6 | about 55, in boxes 80 |
/// | while one is made, besides, of what is looked at | about 50 | about 80 |
///
/// # Examples
/// ```
/// use hiz_core::{ConservativeDepthOptions, Floats, MeshData, OccluderOptions, OccluderSurface};
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
///
/// // 10 m away, from the left of the view to 1.4 pixels right of its middle; no device is needed.
/// let right = 1.4 * 10.0 / 32.0;
/// let (left, low, high, z) = (-20.0, -20.0, 20.0, -10.0);
/// let corners = [left, low, z, right, low, z, left, high, z, right, high, z];
/// let (vertices, triangles) = (Floats::F64(&corners), &[0, 1, 2, 2, 1, 3]);
/// let wall = MeshData { vertices, triangles, transforms: None };
/// let surface = OccluderSurface::from_meshes(&[wall], &OccluderOptions::default())?;
/// let depth = surface.conservative_depth(&camera, &ConservativeDepthOptions::default())?;
///
/// // Pixel 32 is covered as a whole: 0.1 / 10, or a little farther.
/// assert!((0.0099..=0.01).contains(&depth[32]));
/// // Pixel 33 is covered up to 40 %, so something may show beside the wall.
/// assert_eq!(depth[33], 0.0);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct OccluderSurface {
    shapes: Shapes,
    placements: Locked<Arc<Vec<Placement>>>,
    cull_mode: FaceCull,
    shared: OnceLock<Result<Shared>>,
    /// What the last drawing with a limit has told of its meshlets, sorted.
    told: Locked<Told>,
}

/// What is made of the meshes at the first conservative image.
#[derive(Debug)]
struct Shared {
    topology: Topology,
    links: Links,
    solids: Solids,
}

impl Shared {
    /// Bytes on the host.
    fn bytes(&self) -> u64 {
        self.topology.bytes() + self.links.bytes() + self.solids.bytes()
    }
}

impl OccluderSurface {
    /// The surface of `meshes`, made without a device.
    ///
    /// # Errors
    /// Those of [`HizContext::create_occluders`](crate::HizContext::create_occluders), as far as
    /// they do not concern a device.
    pub fn from_meshes(meshes: &[MeshData<'_>], options: &OccluderOptions) -> Result<Self> {
        let shapes = Shapes::new(meshes)?;
        let placements = Placement::of_meshes(&shapes, meshes)?;
        let placements = Locked::new(Arc::new(placements));
        Ok(Self {
            shapes,
            placements,
            cull_mode: options.cull_mode,
            shared: OnceLock::new(),
            told: Locked::default(),
        })
    }

    pub(crate) fn shapes(&self) -> &Shapes {
        &self.shapes
    }

    /// Where the copies stand now.
    pub(crate) fn placements(&self) -> Arc<Vec<Placement>> {
        Arc::clone(&self.placements.lock())
    }

    /// Lets mesh `mesh` stand at other places from now on.
    ///
    /// See [`Occluders::move_mesh`](crate::Occluders::move_mesh).
    ///
    /// # Errors
    /// [`Error::Invalid`] for a mesh that does not exist and for unusable transforms.
    pub fn move_mesh(&self, mesh: usize, transforms: Option<Floats<'_>>) -> Result<()> {
        let meshes = self.shapes.meshes.len();
        if mesh >= meshes {
            return Err(Error::invalid(
                "mesh",
                format!("expected the number of one of the {meshes} meshes, got {mesh}"),
            ));
        }
        let mut moved = Placement::of_mesh(&self.shapes, mesh as u32, transforms)?;
        let mut placements = self.placements.lock();
        let begin = placements.partition_point(|p| (p.mesh as usize) < mesh);
        let end = placements.partition_point(|p| p.mesh as usize <= mesh);
        for (i, placement) in moved.iter_mut().enumerate() {
            // A copy that stays where it is keeps what was found out about it.
            let before = placements[begin..end].get(i);
            placement.moves = match before {
                Some(before) if before.matrix == placement.matrix => before.moves,
                Some(before) => before.moves + 1,
                None => 1,
            };
        }
        let mut all = placements.to_vec();
        all.splice(begin..end, moved);
        *placements = Arc::new(all);
        Ok(())
    }

    /// The number of triangles, counted once per transform of their mesh.
    pub fn num_triangles(&self) -> u64 {
        let of_mesh = |p: &Placement| self.shapes.meshes[p.mesh as usize].triangles.len() as u64;
        self.placements().iter().map(of_mesh).sum()
    }

    /// The NDC depth of these occluders, which holds for every larger image of the same view.
    ///
    /// Every ray through a pixel's closed square meets an occluder at the pixel's depth or nearer.
    /// Where that cannot be shown the pixel is far.
    /// The result has one number per pixel of `camera`, row 0 on top, in its depth convention.
    ///
    /// The proof, by sheets of neighbouring triangles, opens `occluders/surface/mod.rs`.
    ///
    /// # Errors
    /// [`Error::Limit`] for more than 357 million triangles.
    pub fn conservative_depth(
        &self,
        camera: &Camera,
        options: &ConservativeDepthOptions,
    ) -> Result<Vec<f32>> {
        self.usual_depth(camera, options, Planted::default())
    }

    /// Refuses what [`OccluderSurface::draw_into`] would refuse.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a camera that float32 cannot hold, and for copies that do not exist.
    pub(super) fn check_drawing(&self, camera: &Camera, options: &DrawOptions<'_>) -> Result<()> {
        View::new(camera)?;
        options.only.of(&self.placements()).map(drop)
    }

    /// Draws what `camera` sees into an image of its size; returns the rectangle around it.
    pub(crate) fn draw_into(
        &self,
        raster: &mut HostRaster,
        camera: &Camera,
        way: Way,
        options: &DrawOptions<'_>,
    ) -> Result<Touched> {
        let placements = self.placements();
        let scene = Scene {
            shapes: &self.shapes,
            copies: &options.only.of(&placements)?,
            camera,
            cull_mode: self.cull_mode,
        };
        if !options.is_limited() {
            return Ok(raster.draw(&scene, way, options, &Told::default())?.touched);
        }
        let last = self.told.lock().clone();
        let mut drawn = raster.draw(&scene, way, options, &last)?;
        drawn.told.sort();
        *self.told.lock() = drawn.told;
        Ok(drawn.touched)
    }

    /// The NDC depth of these occluders at the centres of the pixels, drawn on the host.
    ///
    /// No device is needed.
    /// The result has one number per pixel of `camera`, row 0 on top, in its depth convention.
    /// What it promises opens `occluders/host_raster/mod.rs`.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a camera that float32 cannot hold.
    /// - [`Error::OutOfMemory`].
    pub fn depth(&self, camera: &Camera) -> Result<Vec<f32>> {
        let size = camera.size();
        let mut raster = HostRaster::new(size);
        let all = DrawOptions::default();
        self.draw_into(&mut raster, camera, Way { threads: None, skip: true }, &all)?;
        let mut depth = memory::list(size.pixels() as usize, "depth")?;
        depth.resize(size.pixels() as usize, 0.0);
        raster.write(&mut depth, camera.convention(), None);
        Ok(depth)
    }

    /// [`OccluderSurface::conservative_depth`] with a planted fault, for tests.
    ///
    /// # Errors
    /// As [`OccluderSurface::conservative_depth`].
    #[cfg(feature = "testing")]
    pub fn conservative_depth_with_fault(
        &self,
        camera: &Camera,
        options: &ConservativeDepthOptions,
        fault: Option<planted_fault::PlantedFault>,
    ) -> Result<Vec<f32>> {
        self.usual_depth(camera, options, Planted(fault))
    }

    /// [`OccluderSurface::conservative_depth`] by a search of every pixel, for tests.
    ///
    /// # Errors
    /// As [`OccluderSurface::conservative_depth`].
    #[cfg(feature = "testing")]
    pub fn conservative_depth_searched(
        &self,
        camera: &Camera,
        options: &ConservativeDepthOptions,
        fault: Option<planted_fault::PlantedFault>,
    ) -> Result<Vec<f32>> {
        self.depth_by(camera, Planted(fault), |placed, links, rounder| {
            image::searched(placed, links, rounder, camera, options.refinement())
        })
    }

    /// [`OccluderSurface::conservative_depth`] with any depths for the pixels' centres, for tests.
    ///
    /// They are NDC depths, which choose what is tried and what is searched.
    /// The result is right whatever they are.
    ///
    /// # Errors
    /// As [`OccluderSurface::conservative_depth`].
    ///
    /// # Panics
    /// If there is not one depth per pixel.
    #[cfg(feature = "testing")]
    pub fn conservative_depth_by_centres(
        &self,
        camera: &Camera,
        options: &ConservativeDepthOptions,
        centres: &[f32],
        fault: Option<planted_fault::PlantedFault>,
    ) -> Result<Vec<f32>> {
        assert_eq!(centres.len() as u64, camera.size().pixels(), "one depth per pixel");
        self.depth_by(camera, Planted(fault), |placed, links, rounder| {
            image::image(placed, links, rounder, camera, options.refinement(), centres)
        })
    }

    fn usual_depth(
        &self,
        camera: &Camera,
        options: &ConservativeDepthOptions,
        fault: Planted,
    ) -> Result<Vec<f32>> {
        // What the rasteriser refuses is seen in float64 alone.
        let centres = match self.depth(camera) {
            Err(Error::Invalid { .. } | Error::Limit { .. }) => None,
            centres => Some(centres?),
        };
        let refinement = options.refinement();
        self.depth_by(camera, fault, |placed, links, rounder| match &centres {
            Some(centres) => image::image(placed, links, rounder, camera, refinement, centres),
            None => image::searched(placed, links, rounder, camera, refinement),
        })
    }

    /// NDC depths from the values of `far` that `image` finds.
    fn depth_by(
        &self,
        camera: &Camera,
        fault: Planted,
        image: impl FnOnce(Placed<'_>, &Standing<'_>, &Rounder) -> Vec<f32>,
    ) -> Result<Vec<f32>> {
        let placements = self.placements();
        let shared = self.shared.get_or_init(|| {
            let topology = Topology::new(&self.shapes)?;
            let links = Links::new(&self.shapes, &topology, &placements);
            let solids = Solids::new(&self.shapes, &topology)?;
            Ok(Shared { topology, links, solids })
        });
        let Shared { topology, links, solids } = shared.as_ref().map_err(Clone::clone)?;
        let placed = Placed {
            shapes: &self.shapes,
            placements: &placements,
            topology,
            solids,
            culled: self.cull_mode.as_seen_by(camera),
            fault,
        };
        let rounder = Rounder::new(Projector::new(camera, fault));
        let mut far = image(placed, &links.standing(&placements), &rounder);
        let convention = camera.convention();
        // The value of `far` at the far plane; reversed Z counts its depths negative.
        let beyond = if convention.is_reversed() { 0.0 } else { 1.0 };
        let (farthest, is_reversed) = (convention.far(), convention.is_reversed());
        widest(
            #[inline(always)]
            || {
                for depth in &mut far {
                    // Depths below the least one are at the far plane, too.
                    let ndc = if is_reversed { -*depth } else { *depth };
                    let is_near = (*depth < beyond) & (!is_reversed | (ndc >= LEAST_DEPTH));
                    *depth = if is_near { ndc } else { farthest };
                }
            },
        );
        Ok(far)
    }

    /// World positions of the vertices, and triangles as indices into them.
    ///
    /// Vertices are in the meshes' order, repeated for each transform.
    /// The corners of a mirrored copy are reversed, so that front faces stay front faces.
    pub fn world(&self) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for placement in self.placements().iter() {
            let mesh = &self.shapes.meshes[placement.mesh as usize];
            let moved = (positions.len() as u32).wrapping_sub(mesh.vertices.start);
            let own = mesh.vertices.start as usize..mesh.vertices.end as usize;
            positions.extend(self.shapes.positions[own].iter().map(|p| placement.world(*p)));
            let own = mesh.triangles.start as usize..mesh.triangles.end as usize;
            triangles.extend(self.shapes.triangles[own].iter().map(|t| {
                let [a, b, c] = t.map(|v| v.wrapping_add(moved));
                if placement.mirrored { [a, c, b] } else { [a, b, c] }
            }));
        }
        (positions, triangles)
    }

    /// Which faces do not occlude.
    pub fn cull_mode(&self) -> FaceCull {
        self.cull_mode
    }

    /// Bytes on the host, including the topology once a conservative depth image was made.
    pub fn host_bytes(&self) -> u64 {
        let made = self.shared.get().and_then(|shared| shared.as_ref().ok());
        self.shapes.bytes() + made.map_or(0, Shared::bytes)
    }
}
