//! Occluders as the caller holds them: on the host and on the device.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::device::{ContextId, Gpu};
use crate::input::bounds::Floats;
use crate::input::mesh::MeshData;
use crate::occluders::device_meshes::DeviceMeshes;
use crate::occluders::drawing::OccluderOptions;
use crate::occluders::placement::Placement;
use crate::occluders::shapes::Shapes;
use crate::occluders::surface::OccluderSurface;

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
    pub(super) on_device: DeviceMeshes,
    pub(super) surface: OccluderSurface,
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

    pub(super) fn shapes(&self) -> &Shapes {
        self.surface.shapes()
    }

    /// Where the copies stand now.
    pub(super) fn placements(&self) -> Arc<Vec<Placement>> {
        self.surface.placements()
    }
}
