//! The device and what lives on it.

use std::sync::Arc;

use hiz_core::headless::{self, AdapterSummary};
use hiz_core::{
    ConservativeDepthOptions, DepthConvention, DepthKind, FaceCull, Floats, InstanceOptions, MeshData, OccluderOptions,
    PyramidOptions, StoredLevels, StoredOrder,
};
use numpy::{PyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::{FloatArray, LevelArray, bounds, depth_kind, in_c_order};
use crate::camera::Camera;
use crate::culling::{CullArguments, Culling};
use crate::errors::detached;

/// Index, name, driver, its version, backend, type.
type Summary = (usize, String, String, String, String, String);

fn summary(adapter: &AdapterSummary) -> Summary {
    let AdapterSummary { index, name, driver, driver_info, backend, device_type } = adapter.clone();
    (index, name, driver, driver_info, backend, device_type)
}

/// The Vulkan adapters of this machine.
#[pyfunction]
pub(crate) fn adapters(py: Python<'_>) -> Vec<Summary> {
    py.detach(headless::adapters).iter().map(summary).collect()
}

/// Whether faults can be planted into the shaders of this build by an environment variable:
/// development builds alone take it.
pub(crate) const TAKES_PLANTED_FAULTS: bool = cfg!(debug_assertions);

#[cfg(not(debug_assertions))]
fn open(adapter: Option<&str>) -> hiz_core::Result<headless::Engine> {
    headless::Engine::new(adapter)
}

/// `HIZVK_PLANTED_FAULT` (`what => by what`, one a line) replaces texts in the shaders, as for the
/// Rust tests: does a Python test turn red? A release has no word of it.
#[cfg(debug_assertions)]
fn open(adapter: Option<&str>) -> hiz_core::Result<headless::Engine> {
    let planted = std::env::var("HIZVK_PLANTED_FAULT").unwrap_or_default();
    let planted: Vec<String> = planted.lines().map(|line| line.replace("\\n", "\n")).collect();
    let faults: Vec<(&str, &str)> = planted.iter().filter_map(|line| line.split_once(" => ")).collect();
    headless::Engine::with_planted_faults(adapter, &faults)
}

/// A device with its queue and pipelines.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Engine(pub(crate) headless::Engine);

#[pymethods]
impl Engine {
    #[new]
    fn new(py: Python<'_>, adapter: Option<&str>) -> PyResult<Self> {
        detached(py, || open(adapter)).map(Self)
    }

    fn adapter(&self) -> Summary {
        summary(self.0.adapter())
    }

    fn max_image_side(&self) -> u32 {
        self.0.max_image_side()
    }

    fn instances(
        &self,
        py: Python<'_>,
        kind: &str,
        arrays: Vec<FloatArray<'_>>,
        strict: bool,
        order: &str,
        piece_capacity: Option<u32>,
    ) -> PyResult<Instances> {
        let bounds = bounds(kind, &arrays)?;
        let order = match order {
            "morton" => StoredOrder::Morton,
            "given" => StoredOrder::Given,
            other => return Err(PyValueError::new_err(format!("order: no order {other:?}"))),
        };
        let options = InstanceOptions { strict, order, piece_capacity };
        detached(py, || self.0.instances(&bounds, &options)).map(Instances)
    }

    fn update(
        &self,
        py: Python<'_>,
        instances: &Instances,
        first: u32,
        kind: &str,
        arrays: Vec<FloatArray<'_>>,
        strict: bool,
    ) -> PyResult<()> {
        let bounds = bounds(kind, &arrays)?;
        detached(py, || self.0.update(&instances.0, first, &bounds, strict))
    }

    fn occluders(
        &self,
        py: Python<'_>,
        meshes: Vec<(FloatArray<'_>, PyReadonlyArrayDyn<'_, u32>, Option<FloatArray<'_>>)>,
        cull: &str,
    ) -> PyResult<Occluders> {
        let cull_mode = match cull {
            "none" => FaceCull::None,
            "back" => FaceCull::Back,
            "front" => FaceCull::Front,
            _ => return Err(PyValueError::new_err(format!("cull: no mode {cull:?}"))),
        };
        let mut data = Vec::with_capacity(meshes.len());
        for (vertices, triangles, transforms) in &meshes {
            in_c_order(triangles.is_c_contiguous())?;
            data.push(MeshData {
                vertices: vertices.floats()?,
                triangles: triangles.as_slice()?,
                transforms: transforms.as_ref().map(FloatArray::floats).transpose()?,
            });
        }
        detached(py, || self.0.occluders(&data, &OccluderOptions { cull_mode })).map(Occluders)
    }

    fn render_depth(&self, py: Python<'_>, occluders: &Occluders, camera: &Camera) -> PyResult<DepthImage> {
        detached(py, || self.0.render_depth(&occluders.0, &camera.0)).map(DepthImage)
    }

    fn render_depth_conservative(
        &self,
        py: Python<'_>,
        occluders: &Occluders,
        camera: &Camera,
        refinement: u32,
    ) -> PyResult<DepthImage> {
        let options = ConservativeDepthOptions { refinement };
        detached(py, || self.0.render_depth_conservative(&occluders.0, &camera.0, &options)).map(DepthImage)
    }

    fn upload_depth(
        &self,
        py: Python<'_>,
        image: FloatArray<'_>,
        kind: &str,
        scale: f64,
        camera: &Camera,
    ) -> PyResult<DepthImage> {
        let (image, kind) = (image.floats()?, depth_kind(kind)?);
        let own_kind = match camera.0.convention() {
            DepthConvention::Standard => DepthKind::Ndc,
            DepthConvention::Reversed => DepthKind::ReversedNdc,
        };
        detached(py, || match image {
            // Already what is uploaded: no copy in between.
            Floats::F32(ndc) if kind == own_kind && scale == 1.0 => self.0.upload_depth(ndc, &camera.0),
            _ => self.0.upload_depth(&hiz_core::ndc_from_kind(image, kind, scale, &camera.0)?, &camera.0),
        })
        .map(DepthImage)
    }

    fn pyramid(&self, py: Python<'_>, depth: &DepthImage, levels: (u32, u32)) -> PyResult<Pyramid> {
        let levels = StoredLevels { first: levels.0, last: levels.1 };
        let options = PyramidOptions { levels, ..PyramidOptions::default() };
        let pyramid = detached(py, || self.0.pyramid_with(&depth.0, &options))?;
        Ok(Pyramid { engine: self.0.clone(), pyramid })
    }

    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    fn cull(
        &self,
        py: Python<'_>,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Pyramid,
        order: &str,
        coverage: &str,
        guard_px: Option<f64>,
        depth_slack: f64,
        depth_slack_abs: f64,
        transform_slack: f64,
        footprint: u32,
        descent: u32,
        fit: &str,
        hierarchy: Option<bool>,
        outputs: (bool, bool, bool, bool),
        capacity: Option<u32>,
        draw: (u32, u32, i32, u32),
        statistics: bool,
    ) -> PyResult<Culling> {
        let arguments = CullArguments {
            order,
            coverage,
            guard_px,
            depth_slack,
            depth_slack_abs,
            transform_slack,
            footprint,
            descent,
            fit,
            hierarchy,
            outputs,
            capacity,
            draw,
            statistics,
        };
        let (options, output) = (arguments.options()?, arguments.output());
        detached(py, || self.0.cull(&instances.0, &camera.0, &pyramid.pyramid, &options, &output)).map(Culling)
    }

    fn wait(&self, py: Python<'_>) -> PyResult<()> {
        detached(py, || self.0.wait())
    }
}

/// Bounds on the device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Instances(pub(crate) Arc<hiz_core::Instances>);

#[pymethods]
impl Instances {
    fn num_instances(&self) -> u32 {
        self.0.len()
    }

    fn kind(&self) -> &'static str {
        match self.0.kind() {
            hiz_core::BoundsKind::Sphere => "spheres",
            hiz_core::BoundsKind::Box => "boxes",
            hiz_core::BoundsKind::OrientedBox => "oriented_boxes",
        }
    }

    fn num_pieces(&self) -> usize {
        self.0.num_pieces()
    }

    fn invalid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u64>>> {
        detached(py, || self.0.invalid()).map(|invalid| PyArray1::from_vec(py, invalid))
    }

    fn host_bytes(&self) -> u64 {
        self.0.host_bytes()
    }

    fn device_bytes(&self) -> u64 {
        self.0.device_bytes()
    }
}

/// Triangle meshes on the device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Occluders(Arc<hiz_core::Occluders>);

#[pymethods]
impl Occluders {
    fn host_bytes(&self) -> u64 {
        self.0.surface().host_bytes()
    }

    fn num_triangles(&self) -> u64 {
        self.0.num_triangles()
    }

    fn num_parts(&self) -> usize {
        self.0.num_parts()
    }

    fn device_bytes(&self) -> u64 {
        self.0.device_bytes()
    }
}

/// A depth image on the device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct DepthImage(pub(crate) headless::DepthImage);

#[pymethods]
impl DepthImage {
    fn read<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        detached(py, || self.0.read()).map(|depth| PyArray1::from_vec(py, depth))
    }
}

/// A depth pyramid on the device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Pyramid {
    engine: headless::Engine,
    pub(crate) pyramid: Arc<hiz_core::Pyramid>,
}

#[pymethods]
impl Pyramid {
    fn num_levels(&self) -> u32 {
        self.pyramid.num_levels()
    }

    /// The first and the last stored level above 0; nothing for an image of one pixel.
    fn stored_levels(&self) -> Option<(u32, u32)> {
        self.pyramid.stored_levels().map(|levels| (levels.first, levels.last))
    }

    /// `((height, width), texels)` of a level.
    fn read_level<'py>(&self, py: Python<'py>, k: u32) -> PyResult<LevelArray<'py>> {
        let texels = detached(py, || self.engine.read_level(&self.pyramid, k))?;
        let size = self.pyramid.level_size(k).map_or((0, 0), |size| (size.height, size.width));
        Ok((size, PyArray1::from_vec(py, texels)))
    }

    fn device_bytes(&self) -> u64 {
        self.pyramid.device_bytes()
    }
}
