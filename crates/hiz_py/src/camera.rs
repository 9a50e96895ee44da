//! The camera: float64 on the host.

use hiz_core::{Pose, Projection};
use pyo3::prelude::*;

use crate::arguments::{convention, image_size};
use crate::errors::raised;

type Vec3 = [f64; 3];
type Mat4 = [[f64; 4]; 4];
/// Left, right, bottom, top.
type Borders = (f64, f64, f64, f64);

/// A camera with its image size.
#[pyclass(frozen, eq, module = "hizvk._core")]
#[derive(PartialEq)]
pub(crate) struct Camera(pub(crate) hiz_core::Camera);

#[pymethods]
impl Camera {
    #[staticmethod]
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's constructor")]
    fn perspective(
        py: Python<'_>,
        eye: Vec3,
        target: Vec3,
        up: Vec3,
        fov_y: f64,
        near: f64,
        far: Option<f64>,
        reversed_z: bool,
        size: (u32, u32),
    ) -> PyResult<Self> {
        let projection =
            Projection::Perspective { fov_y, near, far, convention: convention(reversed_z) };
        looking(py, &Pose { eye, target, up }, &projection, size)
    }

    #[staticmethod]
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's constructor")]
    fn frustum(
        py: Python<'_>,
        eye: Vec3,
        target: Vec3,
        up: Vec3,
        borders: Borders,
        near: f64,
        far: Option<f64>,
        reversed_z: bool,
        size: (u32, u32),
    ) -> PyResult<Self> {
        looking(py, &Pose { eye, target, up }, &off_centre(borders, near, far, reversed_z), size)
    }

    #[staticmethod]
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's constructor")]
    fn orthographic(
        py: Python<'_>,
        eye: Vec3,
        target: Vec3,
        up: Vec3,
        borders: Borders,
        near: f64,
        far: f64,
        reversed_z: bool,
        size: (u32, u32),
    ) -> PyResult<Self> {
        let (left, right, bottom, top) = borders;
        let convention = convention(reversed_z);
        let projection =
            Projection::Orthographic { left, right, bottom, top, near, far, convention };
        looking(py, &Pose { eye, target, up }, &projection, size)
    }

    #[staticmethod]
    fn from_clip_from_world(
        py: Python<'_>,
        clip_from_world: Mat4,
        reversed_z: bool,
        size: (u32, u32),
    ) -> PyResult<Self> {
        made(
            py,
            hiz_core::Camera::from_clip_from_world(
                clip_from_world,
                image_size(size),
                convention(reversed_z),
            ),
        )
    }

    #[staticmethod]
    fn from_clip_from_camera(
        py: Python<'_>,
        clip_from_camera: Mat4,
        camera_from_world: Mat4,
        reversed_z: bool,
        size: (u32, u32),
    ) -> PyResult<Self> {
        let (size, convention) = (image_size(size), convention(reversed_z));
        made(
            py,
            hiz_core::Camera::from_clip_from_camera(
                clip_from_camera,
                camera_from_world,
                size,
                convention,
            ),
        )
    }

    #[staticmethod]
    fn from_clip_from_camera_pose(
        py: Python<'_>,
        clip_from_camera: Mat4,
        world_from_camera: Mat4,
        reversed_z: bool,
        size: (u32, u32),
    ) -> PyResult<Self> {
        let (size, convention) = (image_size(size), convention(reversed_z));
        made(
            py,
            hiz_core::Camera::from_clip_from_camera_pose(
                clip_from_camera,
                world_from_camera,
                size,
                convention,
            ),
        )
    }

    fn with_size(&self, py: Python<'_>, size: (u32, u32)) -> PyResult<Self> {
        made(py, self.0.with_size(image_size(size)))
    }

    fn size(&self) -> (u32, u32) {
        (self.0.size().height, self.0.size().width)
    }

    fn reversed_z(&self) -> bool {
        self.0.convention().is_reversed()
    }

    fn is_posed(&self) -> bool {
        self.0.is_posed()
    }

    fn rows(&self) -> Mat4 {
        self.0.rows()
    }

    fn origin(&self) -> Vec3 {
        self.0.origin()
    }

    fn clip_from_world(&self) -> Mat4 {
        self.0.clip_from_world()
    }
}

/// `clip_from_camera` of an off-centre perspective, for a camera with x right, y up, z forward.
#[pyfunction]
pub(crate) fn frustum_matrix(
    py: Python<'_>,
    borders: Borders,
    near: f64,
    far: Option<f64>,
    reversed_z: bool,
    size: (u32, u32),
) -> PyResult<Mat4> {
    off_centre(borders, near, far, reversed_z)
        .clip_from_camera(image_size(size))
        .map_err(|error| raised(py, error))
}

fn off_centre(
    (left, right, bottom, top): Borders,
    near: f64,
    far: Option<f64>,
    reversed_z: bool,
) -> Projection {
    Projection::Frustum { left, right, bottom, top, near, far, convention: convention(reversed_z) }
}

fn looking(
    py: Python<'_>,
    pose: &Pose,
    projection: &Projection,
    size: (u32, u32),
) -> PyResult<Camera> {
    made(py, hiz_core::Camera::look_at(pose, projection, image_size(size)))
}

fn made(py: Python<'_>, camera: Result<hiz_core::Camera, hiz_core::Error>) -> PyResult<Camera> {
    camera.map(Camera).map_err(|error| raised(py, error))
}
