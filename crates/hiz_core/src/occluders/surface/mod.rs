//! Occluder depth that holds for every larger image of the same view, whatever its sample
//! positions.
//!
//! A rasterised depth image knows its sample points: between them it may show a wall where a larger
//! image finds the gap beside it, and a cull by it hides what can be seen through the gap.
//! The image made here promises instead:
//!
//! > Every ray through the **closed square** of a pixel meets an occluder at the pixel's depth or nearer (inside of the near
//! > plane). Where that cannot be shown the pixel is far.
//!
//! So every point of a larger image (any size, jitter or multisampling) has an occluder at most as
//! far as the pixel that it lies in, and a cull with area coverage by the small image is right for
//! the large one.
//! Hardware and "inner conservative" rasterisers (Akenine-Moller and Aila 2005) give that for one
//! triangle alone and lose every pixel that an inner edge of a mesh crosses; Masked Software
//! Occlusion Culling (Hasselgren, Andersson, Akenine-Moller 2016) merges by sample coverage and
//! admits the error.
//! Here pixels are covered by *sheets*, on the host in float64:
//!
//! **Sheets.**
//! Let P be a closed square and G a set of triangles, seen in the image.
//! Turn each the same way round.
//! Along an edge that two triangles of G share from different sides, their borders run in opposite
//! directions and cancel; what remains is the border of G.
//! The number of times that the border winds about a point is the sum of that over the triangles,
//! and it does not change while the point does not cross the border.
//! So if **no remaining edge meets P, and the border winds about P's centre a number of times other
//! than 0, then every point of P lies in a triangle of G**, and no ray through P gets farther than
//! the farthest depth that triangles of G reach in P.
//! This needs nothing of G: it may fold, overlap, intersect itself, be wrong way round, have zero
//! areas or three triangles at an edge, and every choice of G gives a valid depth.
//!
//! **Which sheets.**
//! `coverage` takes the components of the triangles that touch P, linked across shared edges that
//! meet P (a triangle that is missing from the list leaves its neighbour's edge unpaired, which
//! only spoils that sheet).
//! Of all sheets that cover P the nearest counts.
//! A lamp post before a wall spoils its own sheet, not the wall's.
//! Where triangles lie on the *same* side of their edge (a fold, the silhouette of a closed mesh),
//! borders add up instead of cancelling; modulo 2 they cancel again, and an odd winding covers P
//! too.
//! That closes small folds.
//! What still is open is tried again by quarters of P (`refinement`): a ray through P goes through
//! a quarter, so the farthest quarter counts for P.
//!
//! **Rounding.**
//! No step trusts a sign that float64 could have got wrong.
//! Each projected vertex carries a bound of its error (a few roundings of its terms, counted in
//! `cells`).
//! An exact edge lies within its ends' margins of the computed one: an edge misses P only if the
//! computed one misses P grown by that (`square`).
//! Moving all vertices from their computed to their exact places moves no border across P, so the
//! winding of the computed border, each of whose edges lies certainly on one side of P's centre, is
//! that of the exact one.
//! Inner edges that miss P cancel exactly, since the float64 expression for the edge from b to a is
//! the negative of that for a to b.
//! Depths are bounded over P grown by the margins, and rounded to float32 towards far.
//!
//! **Near and far.**
//! Triangles are clipped a millionth of the depth range behind the near plane, at points that lie
//! exactly on their edges and that neighbours share; the cut is a border.
//! What cannot be projected with certainty is dropped, which makes borders of its neighbours'
//! edges.
//! Beyond the far plane nothing is hidden: such depths become far.

mod cells;
mod coverage;
pub(crate) mod planted_fault;
mod square;
mod topology;

use std::sync::OnceLock;

use crate::error::Result;
use crate::host::linear::Vec3;
use crate::host::rounding::round_up;
use crate::input::camera::Camera;
use crate::input::mesh::FaceCull;
use crate::occluders::surface::cells::Cells;
use crate::occluders::surface::coverage::Coverage;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::topology::Topology;

/// The least normal float32: what is nearer to reversed Z's far plane counts as far.
const LEAST_DEPTH: f32 = f32::MIN_POSITIVE;

/// Choices for [`OccluderSurface::conservative_depth`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConservativeDepthOptions {
    /// How often a pixel is quartered where no sheet covers all of it, at most 8.
    /// Each step finds more occlusion beside silhouettes and costs time there; any number is right.
    pub refinement: u32,
}

impl Default for ConservativeDepthOptions {
    fn default() -> Self {
        Self { refinement: 2 }
    }
}

/// The occluders' triangles on the host, in float64 world coordinates.
///
/// 24 bytes a vertex and 12 a triangle; the first conservative depth image adds about 42 bytes a
/// triangle and 24 a vertex for good, and while it is made about 110 of either.
#[derive(Debug)]
pub struct OccluderSurface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    cull_mode: FaceCull,
    topology: OnceLock<Result<Topology>>,
}

impl OccluderSurface {
    pub(crate) fn new(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, cull_mode: FaceCull) -> Self {
        Self { positions, triangles, cull_mode, topology: OnceLock::new() }
    }

    /// NDC depth of `camera`'s size and convention, row 0 on top: every ray through a pixel's
    /// closed square meets an occluder at this depth or nearer; far where that cannot be shown.
    /// It holds for every larger image of the same view.
    ///
    /// # Errors
    /// [`Error::Limit`](crate::Error::Limit) for more than 357 million triangles.
    pub fn conservative_depth(
        &self,
        camera: &Camera,
        options: &ConservativeDepthOptions,
    ) -> Result<Vec<f32>> {
        self.conservative_depth_planted(camera, options, Planted::default())
    }

    /// The same with a fault, for tests.
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
        self.conservative_depth_planted(camera, options, Planted(fault))
    }

    fn conservative_depth_planted(
        &self,
        camera: &Camera,
        options: &ConservativeDepthOptions,
        fault: Planted,
    ) -> Result<Vec<f32>> {
        let topology =
            self.topology.get_or_init(|| Topology::new(&self.positions, &self.triangles));
        let topology = topology.as_ref().map_err(Clone::clone)?;
        let convention = camera.convention();
        let culled = self.cull_mode.as_seen_by(camera);
        let cells = Cells::new(topology, camera, culled, fault);
        // `far` of the far plane; reversed Z counts its depths negative.
        let beyond = if convention.is_reversed() { 0.0 } else { 1.0 };
        let far =
            Coverage::new(&cells, fault).image(camera.size(), beyond, options.refinement.min(8));
        #[expect(clippy::cast_possible_truncation, reason = "the fault that is planted")]
        let rounded =
            if is_planted!(fault, RoundedToNearest) { |far| far as f32 } else { round_up };
        let ndc = |far: f64| match (far < beyond, convention.is_reversed()) {
            (false, _) => convention.far(),
            (true, false) => rounded(far).min(1.0),
            (true, true) => Some(-rounded(far)).filter(|d| *d >= LEAST_DEPTH).unwrap_or(0.0),
        };
        Ok(far.into_iter().map(ndc).collect())
    }

    /// World positions of the vertices, in the meshes' order, once for each place.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Triangles as indices of [`positions`](Self::positions).
    /// A mirrored copy's corners are turned round.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Which faces do not occlude.
    pub fn cull_mode(&self) -> FaceCull {
        self.cull_mode
    }

    /// Bytes on the host, with the topology if it was made.
    pub fn host_bytes(&self) -> u64 {
        let made = self.topology.get().and_then(|topology| topology.as_ref().ok());
        (size_of_val(&self.positions[..]) + size_of_val(&self.triangles[..])) as u64
            + made.map_or(0, Topology::bytes)
    }
}
