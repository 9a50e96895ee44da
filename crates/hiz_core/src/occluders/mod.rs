//! Occluders: triangle meshes that hide other things.
//!
//! The data goes through these files:
//!
//! 1. `shapes` checks meshes and cuts them into `meshlets`, each mesh in its own space.
//!    `placement` says where the copies of a mesh stand.
//! 2. `drawing` says which copies are drawn, and `view` is a camera in the space of a copy.
//! 3. `host_raster` draws the meshes on the host, for devices that are processors.
//! 4. `surface` holds them on the host, and computes conservative depth from them in float64.
//! 5. `device_raster` draws the meshes on the device.
//! 6. `depth` is the image that the one rasteriser or the other draws into.
//!
//! The drawing is recorded into the caller's encoder; nothing here submits or reads back.

pub(crate) mod depth;
pub(crate) mod device_raster;
pub(crate) mod drawing;
pub(crate) mod host_raster;
mod meshlets;
mod placement;
mod shapes;
pub(crate) mod surface;
mod view;

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::device::{ContextId, Gpu};
use crate::input::bounds::Floats;
use crate::input::mesh::{FaceCull, MeshData};
use crate::occluders::device_raster::DeviceMeshes;
use crate::occluders::placement::Placement;
use crate::occluders::shapes::Shapes;
use crate::occluders::surface::OccluderSurface;

/// How occluders are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OccluderOptions {
    /// Which triangles do not occlude; all occlude by default.
    pub cull_mode: FaceCull,
}

/// Triangle meshes on the device, and the places where they stand.
///
/// Each mesh is stored once, 24 bytes per vertex and 12 bytes per triangle.
///
/// # Examples
/// ```
/// use hiz_core::{Floats, MeshData, OccluderOptions, headless::Engine};
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
///
/// // A square of two triangles in two places: 10 m away, and 10 m farther.
/// let corners = [-20.0, -20.0, 0.0, 20.0, -20.0, 0.0, -20.0, 20.0, 0.0, 20.0, 20.0, 0.0];
/// let mut transforms = [0.0; 32];
/// for (matrix, z) in transforms.chunks_exact_mut(16).zip([-10.0, -20.0]) {
///     for k in [0, 5, 10, 15] {
///         matrix[k] = 1.0;
///     }
///     matrix[11] = z;
/// }
/// let (vertices, transforms) = (Floats::F32(&corners), Some(Floats::F64(&transforms)));
/// let mesh = MeshData { vertices, triangles: &[0, 1, 2, 2, 1, 3], transforms };
/// let walls = engine.occluders(&[mesh], &OccluderOptions::default())?;
/// assert_eq!((walls.num_parts(), walls.num_triangles()), (2, 4));
///
/// // NDC depth is near / view depth: 0.1 / 10, up to the rasteriser's rounding.
/// let depth = engine.render_depth(&walls, &camera)?.read()?;
/// assert!(depth.iter().all(|d| (d - 0.01).abs() < 1e-6));
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct Occluders {
    pub(crate) context: ContextId,
    on_device: DeviceMeshes,
    surface: OccluderSurface,
}

impl Occluders {
    pub(crate) fn new(
        gpu: &Gpu,
        meshes: &[MeshData<'_>],
        options: &OccluderOptions,
    ) -> Result<Self> {
        let surface = OccluderSurface::from_meshes(meshes, options)?;
        let on_device = DeviceMeshes::new(gpu, surface.shapes())?;
        Ok(Self { context: gpu.id(), on_device, surface })
    }

    /// The triangles on the host, from which conservative depth is computed.
    pub fn surface(&self) -> &OccluderSurface {
        &self.surface
    }

    /// Lets mesh `mesh` (in the order of the upload) stand at other places from now on.
    ///
    /// `transforms` are as in [`MeshData::transforms`]; their number may be another one, and 0.
    /// What was recorded before is drawn where the mesh stood then.
    /// A move costs its matrices alone: vertices, triangles and what was made of them stay.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for a mesh that does not exist and for unusable
    /// transforms.
    /// Nothing has moved then.
    pub fn move_mesh(&self, mesh: usize, transforms: Option<Floats<'_>>) -> Result<()> {
        self.surface.move_mesh(mesh, transforms)
    }

    /// The number of triangles, counted once per transform of their mesh.
    pub fn num_triangles(&self) -> u64 {
        self.surface.num_triangles()
    }

    /// The number of copies: meshes, counted once per transform.
    pub fn num_parts(&self) -> usize {
        self.placements().len()
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        self.on_device.bytes()
    }

    fn shapes(&self) -> &Shapes {
        self.surface.shapes()
    }

    /// Where the copies stand now.
    fn placements(&self) -> Arc<Vec<Placement>> {
        self.surface.placements()
    }
}
