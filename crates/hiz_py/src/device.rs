//! The device, and the objects on it.

use std::sync::Arc;

use hiz_core::headless::{self, AdapterSummary, AmongSource, CullExtras};
use hiz_core::{
    ConservativeDepthOptions, DepthEnd, DepthLoad, DrawOptions, FaceCull, InstanceOptions,
    MeshData, OccluderOptions, Only, Outputs, PyramidOptions, Rasteriser, ReceiverMaskOptions,
    StoredLevels, StoredOrder, ViewsOutputs,
};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::approximate::ApproximateCulling;
use crate::arguments::{
    DepthArray, FloatArray, LevelArray, bounds, depth_input, depth_inputs, depths_of, in_c_order,
};
use crate::camera::Camera;
use crate::culling::{Counts, Culling, StageTime, ViewsCulling, stage_time};
use crate::held::{Held, OnDevice, detached};
use crate::meshes::{LodNumbers, MeshTable, mesh_table};
use crate::options::{LastRequest, Request, cull_options, mip_options};

/// The depth of a single cull.
#[derive(FromPyObject)]
enum SingleDepth<'py> {
    #[pyo3(transparent, annotation = "Pyramid")]
    Pyramid(Bound<'py, Pyramid>),
    #[pyo3(annotation = "image, kind, scale, invalid, rounding, tolerance")]
    Image(DepthArray<'py>, String, f64, Vec<f64>, String, (f64, f64)),
}

/// Which instances a cull is restricted to.
#[derive(FromPyObject)]
enum AmongArgument<'py> {
    #[pyo3(transparent, annotation = "Culling")]
    Kept(Bound<'py, Culling>),
    #[pyo3(transparent, annotation = "ViewsCulling")]
    KeptByAny(Bound<'py, ViewsCulling>),
    #[pyo3(transparent, annotation = "bool array")]
    Mask(PyReadonlyArray1<'py, bool>),
}

/// Index, name, driver, version of the driver, backend, device type.
type Summary = (usize, String, String, String, String, String);

fn summary(adapter: &AdapterSummary) -> Summary {
    let AdapterSummary { index, name, driver, driver_info, backend, device_type } = adapter.clone();
    (index, name, driver, driver_info, backend, device_type)
}

/// The adapters of this machine.
#[pyfunction]
pub(crate) fn adapters(py: Python<'_>) -> PyResult<Vec<Summary>> {
    Ok(detached(py, || Ok(headless::adapters()))?.iter().map(summary).collect())
}

#[cfg(not(feature = "testing"))]
fn open(adapter: Option<&str>) -> hiz_core::Result<headless::Engine> {
    headless::Engine::new(adapter)
}

/// Opens a device whose shaders may have planted faults, so that a Python test can be seen to fail.
/// `HIZVK_PLANTED_FAULT` replaces texts in the shaders, as for the Rust tests: `what => by what` on
/// each line.
/// A build without the feature `testing` does not read it.
#[cfg(feature = "testing")]
fn open(adapter: Option<&str>) -> hiz_core::Result<headless::Engine> {
    let planted = std::env::var("HIZVK_PLANTED_FAULT").unwrap_or_default();
    let planted: Vec<String> = planted.lines().map(|line| line.replace("\\n", "\n")).collect();
    let faults: Vec<(&str, &str)> =
        planted.iter().filter_map(|line| line.split_once(" => ")).collect();
    headless::Engine::with_planted_faults(adapter, &faults)
}

/// The copies that a mask names; all of them without one.
fn chosen<'a>(mask: Option<&'a PyReadonlyArray1<'_, bool>>) -> PyResult<Only<'a>> {
    Ok(match mask {
        None => Only::All,
        Some(mask) => Only::Masked(mask.as_slice()?),
    })
}

/// A device with its queue and pipelines.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Engine(pub(crate) Held<headless::Engine>, LastRequest);

#[pymethods]
impl Engine {
    #[new]
    fn new(py: Python<'_>, adapter: Option<&str>) -> PyResult<Self> {
        detached(py, || open(adapter))
            .map(|engine| Self(Held::new(py, engine), LastRequest::default()))
    }

    fn adapter(&self, py: Python<'_>) -> PyResult<Summary> {
        Ok(summary(self.0.look(py)?.adapter()))
    }

    fn max_image_side(&self, py: Python<'_>) -> PyResult<u32> {
        Ok(self.0.get(py)?.max_image_side())
    }

    fn instances(
        &self,
        py: Python<'_>,
        kind: &str,
        arrays: Vec<FloatArray<'_>>,
        strict_and_order: (bool, String),
        mesh_ids: Option<PyReadonlyArray1<'_, u32>>,
        scales: Option<FloatArray<'_>>,
    ) -> PyResult<Instances> {
        let bounds = bounds(kind, &arrays)?;
        let (strict, order) = strict_and_order;
        let order = match order.as_str() {
            "morton" => StoredOrder::Morton,
            "given" => StoredOrder::Given,
            other => return Err(PyValueError::new_err(format!("order: no order {other:?}"))),
        };
        #[allow(clippy::needless_update, reason = "hiz_core's `testing` adds a field")]
        let options = InstanceOptions {
            strict,
            order,
            mesh_ids: mesh_ids.as_ref().map(|ids| ids.as_slice()).transpose()?,
            scales: scales.as_ref().map(FloatArray::floats).transpose()?,
            ..InstanceOptions::default()
        };
        self.0
            .run(py, |engine| engine.instances(&bounds, &options))
            .map(|instances| Instances(Held::new(py, instances)))
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
        let instances = instances.0.get(py)?;
        self.0.run(py, |engine| engine.update(&instances, first, &bounds, strict))
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
        self.0
            .run(py, |engine| engine.occluders(&data, &OccluderOptions { cull_mode }))
            .map(|occluders| Occluders(Held::new(py, occluders)))
    }

    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    fn render_depth(
        &self,
        py: Python<'_>,
        occluders: &Occluders,
        camera: &Camera,
        rasteriser: &str,
        only: Option<PyReadonlyArray1<'_, bool>>,
        max_triangles: Option<u64>,
        max_occluders: Option<u64>,
    ) -> PyResult<DepthImage> {
        let rasteriser = match rasteriser {
            "auto" => Rasteriser::Auto,
            "device" => Rasteriser::Device,
            "host" => Rasteriser::Host,
            _ => {
                let error = format!("rasteriser: no rasteriser {rasteriser:?}");
                return Err(PyValueError::new_err(error));
            }
        };
        let occluders = occluders.0.get(py)?;
        let only = chosen(only.as_ref())?;
        let options =
            DrawOptions { load: DepthLoad::Clear, only, max_triangles, max_copies: max_occluders };
        let draw = |engine: &headless::Engine| {
            engine.render_depth_with(&occluders, &camera.0, rasteriser, &options)
        };
        self.0.run(py, draw).map(|(depth, _)| DepthImage(Held::new(py, depth)))
    }

    fn render_depth_into(
        &self,
        py: Python<'_>,
        depth: &DepthImage,
        occluders: &Occluders,
        only: Option<PyReadonlyArray1<'_, bool>>,
        max_triangles: Option<u64>,
        max_occluders: Option<u64>,
    ) -> PyResult<Option<(u32, u32, u32, u32)>> {
        let (depth, occluders) = (depth.0.get(py)?, occluders.0.get(py)?);
        let only = chosen(only.as_ref())?;
        let options =
            DrawOptions { load: DepthLoad::Load, only, max_triangles, max_copies: max_occluders };
        let touched =
            self.0.run(py, |engine| engine.render_depth_into(&depth, &occluders, &options))?;
        Ok(touched.map(<(u32, u32, u32, u32)>::from))
    }

    fn render_depth_conservative(
        &self,
        py: Python<'_>,
        occluders: &Occluders,
        camera: &Camera,
        refinement: u32,
    ) -> PyResult<DepthImage> {
        let options = ConservativeDepthOptions { refinement };
        let occluders = occluders.0.get(py)?;
        self.0
            .run(py, |engine| engine.render_depth_conservative(&occluders, &camera.0, &options))
            .map(|depth| DepthImage(Held::new(py, depth)))
    }

    /// `image` is float32, float64, or 16 bits: float16 if `rounding` is "half", else whole numbers.
    /// `rounding` says to which floats the numbers were rounded before: "none", "single" or "half".
    /// `tolerance` is relative and absolute, in world units.
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    #[pyo3(signature = (image, kind, scale, invalid, rounding, tolerance, camera, depths = "farthest"))]
    fn upload_depth(
        &self,
        py: Python<'_>,
        image: DepthArray<'_>,
        kind: &str,
        scale: f64,
        invalid: Vec<f64>,
        rounding: &str,
        tolerance: (f64, f64),
        camera: &Camera,
        depths: &str,
    ) -> PyResult<DepthImage> {
        let depth = depth_input(&image, kind, scale, &invalid, (rounding, tolerance))?;
        let (camera, depths) = (&camera.0, depths_of(depths)?);
        self.0
            .run(py, |engine| engine.upload_depth_for(&depth, camera, depths))
            .map(|depth| DepthImage(Held::new(py, depth)))
    }

    /// As `upload_depth`, with an image for each sample of a pixel: the farthest one counts.
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    #[pyo3(signature = (images, kind, scale, invalid, rounding, tolerance, camera, depths = "farthest"))]
    fn upload_samples(
        &self,
        py: Python<'_>,
        images: Vec<DepthArray<'_>>,
        kind: &str,
        scale: f64,
        invalid: Vec<f64>,
        rounding: &str,
        tolerance: (f64, f64),
        camera: &Camera,
        depths: &str,
    ) -> PyResult<DepthImage> {
        let samples = depth_inputs(&images, kind, scale, &invalid, (rounding, tolerance))?;
        let (camera, depths) = (&camera.0, depths_of(depths)?);
        self.0
            .run(py, |engine| engine.upload_samples_for(&samples, camera, depths))
            .map(|depth| DepthImage(Held::new(py, depth)))
    }

    /// The depth image of `light` that holds the farthest receivers in `depth`.
    fn receiver_mask(
        &self,
        py: Python<'_>,
        depth: &DepthImage,
        light: &Camera,
        filter_radius: f64,
        reach_px: f64,
        slacks: (f64, f64),
    ) -> PyResult<DepthImage> {
        let options = ReceiverMaskOptions {
            filter_radius,
            reach_px,
            depth_slack: slacks.0,
            depth_slack_abs: slacks.1,
        };
        let depth = depth.0.get(py)?;
        self.0
            .run(py, |engine| engine.receiver_mask(&depth, &light.0, &options))
            .map(|mask| DepthImage(Held::new(py, mask)))
    }

    /// Renews a pyramid within the rectangle (x0, y0, x1, y1) of its depth image.
    fn renew(
        &self,
        py: Python<'_>,
        pyramid: &Pyramid,
        depth: &DepthImage,
        rectangle: (u32, u32, u32, u32),
    ) -> PyResult<()> {
        let (pyramid, depth) = (pyramid.0.get(py)?, depth.0.get(py)?);
        self.0.run(py, |engine| engine.renew_pyramid(&pyramid.1, &depth, rectangle.into()))
    }

    /// Replaces the rectangle of an uploaded image by whole rows, one image for each sample.
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    fn replace_depth(
        &self,
        py: Python<'_>,
        pyramid: &Pyramid,
        depth: &DepthImage,
        rectangle: (u32, u32, u32, u32),
        images: Vec<DepthArray<'_>>,
        kind: &str,
        scale: f64,
        invalid: Vec<f64>,
        rounding: &str,
        tolerance: (f64, f64),
    ) -> PyResult<()> {
        let rows = depth_inputs(&images, kind, scale, &invalid, (rounding, tolerance))?;
        let (pyramid, depth) = (pyramid.0.get(py)?, depth.0.get(py)?);
        self.0.run(py, |engine| engine.replace_depth(&pyramid.1, &depth, rectangle.into(), &rows))
    }

    /// The mask of bounds that are used once, and the counts of the first of them.
    /// `depth` is what `upload_depth` takes, or a pyramid.
    fn cull_once<'py>(
        &self,
        py: Python<'py>,
        bounds: (&str, Vec<FloatArray<'_>>),
        camera: &Camera,
        depth: SingleDepth<'py>,
        options: &Bound<'_, PyAny>,
    ) -> PyResult<(Bound<'py, PyArray1<bool>>, Counts)> {
        let bounds = self::bounds(bounds.0, &bounds.1)?;
        let (options, camera) = (cull_options(options)?, &camera.0);
        let answer = match &depth {
            SingleDepth::Pyramid(pyramid) => {
                let pyramid = pyramid.get().0.get(py)?;
                self.0.run(py, |engine| engine.cull_once(&bounds, camera, &pyramid.1, &options))
            }
            SingleDepth::Image(image, kind, scale, invalid, rounding, tolerance) => {
                let depth = depth_input(image, kind, *scale, invalid, (rounding, *tolerance))?;
                self.0
                    .run(py, |engine| engine.cull_once_by_depth(&bounds, camera, &depth, &options))
            }
        }?;
        Ok((PyArray1::from_vec(py, answer.mask), Counts::of(&answer.first_counts)))
    }

    #[pyo3(signature = (depth, levels, depths = "farthest"))]
    fn pyramid(
        &self,
        py: Python<'_>,
        depth: &DepthImage,
        levels: (u32, u32),
        depths: &str,
    ) -> PyResult<Pyramid> {
        let levels = StoredLevels { first: levels.0, last: levels.1 };
        let depths = depths_of(depths)?;
        let options = PyramidOptions { levels, depths, ..PyramidOptions::default() };
        let depth = depth.0.get(py)?;
        let reduce = |engine: &headless::Engine| {
            Ok((engine.clone(), engine.pyramid_with(&depth, &options)?))
        };
        self.0.run(py, reduce).map(|built| Pyramid(Held::new(py, built)))
    }

    /// A mesh is a list of levels of detail, each with the numbers of its draw and its error.
    fn mesh_table(&self, py: Python<'_>, meshes: Vec<Vec<LodNumbers>>) -> PyResult<MeshTable> {
        self.0
            .run(py, |engine| mesh_table(engine, &meshes))
            .map(|table| MeshTable(Held::new(py, table)))
    }

    /// `options` is a `hizvk.CullOptions`, `outputs` a `hizvk.Outputs`.
    /// `meshes` is the table of the meshes that the outputs speak of.
    /// `among`: a mask, or an earlier answer; `ahead`: the answer comes to the host by itself.
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    fn cull(
        &self,
        py: Python<'_>,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Pyramid,
        options: &Bound<'_, PyAny>,
        outputs: &Bound<'_, PyAny>,
        meshes: Option<&MeshTable>,
        among: Option<AmongArgument<'_>>,
        ahead: bool,
    ) -> PyResult<Culling> {
        let meshes = meshes.map(|table| table.0.get(py)).transpose()?;
        let Request { options, outputs } = match &meshes {
            None => self.1.or_new(options, outputs)?,
            meshes => Request::new(options, outputs, meshes.as_deref())?,
        };
        let (instances, pyramid) = (instances.0.get(py)?, pyramid.0.get(py)?);
        let among = among.as_ref().map(|among| HeldAmong::new(py, among)).transpose()?;
        let cull = |engine: &headless::Engine| {
            let mut words = Vec::new();
            let source = among.as_ref().map(HeldAmong::source);
            let mask = source.map(|source| source.mask(&instances, &mut words)).transpose()?;
            let extras = CullExtras { mask, ahead, ..CullExtras::default() };
            engine.cull_given(&instances, &camera.0, &pyramid.1, &options, &outputs, &extras)
        };
        self.0.run(py, cull).map(|culling| Culling(Held::new(py, Arc::new(culling))))
    }

    /// As `cull`; what can show in at most `negligible_px` pixels is culled, too.
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    fn cull_approximate(
        &self,
        py: Python<'_>,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Pyramid,
        options: &Bound<'_, PyAny>,
        outputs: &Bound<'_, PyAny>,
        negligible_px: u32,
    ) -> PyResult<ApproximateCulling> {
        let Request { options, outputs } = Request::new(options, outputs, None)?;
        let (instances, pyramid) = (instances.0.get(py)?, pyramid.0.get(py)?);
        let cull = |engine: &headless::Engine| {
            let (camera, pyramid) = (&camera.0, &pyramid.1);
            engine.cull_approximate(&instances, camera, pyramid, &options, &outputs, negligible_px)
        };
        self.0.run(py, cull).map(|culling| ApproximateCulling(Held::new(py, culling)))
    }

    /// As `cull`, for several views; the lists of `outputs` are those of what any view keeps.
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    fn cull_views(
        &self,
        py: Python<'_>,
        instances: &Instances,
        cameras: Vec<PyRef<'_, Camera>>,
        pyramids: Vec<PyRef<'_, Pyramid>>,
        options: &Bound<'_, PyAny>,
        outputs: &Bound<'_, PyAny>,
        among: Option<AmongArgument<'_>>,
        ahead: bool,
    ) -> PyResult<ViewsCulling> {
        let Request { options, outputs: any } = Request::new(options, outputs, None)?;
        let outputs = ViewsOutputs {
            each: Outputs { mask: true, verdicts: any.verdicts, ..Outputs::NONE },
            any,
        };
        let instances = instances.0.get(py)?;
        let pyramids =
            pyramids.iter().map(|pyramid| pyramid.0.get(py)).collect::<PyResult<Vec<_>>>()?;
        let views: Vec<_> = cameras
            .iter()
            .zip(&pyramids)
            .map(|(camera, pyramid)| (&camera.0, &pyramid.1))
            .collect();
        let among = among.as_ref().map(|among| HeldAmong::new(py, among)).transpose()?;
        let cull = |engine: &headless::Engine| {
            let mut words = Vec::new();
            let source = among.as_ref().map(HeldAmong::source);
            let mask = source.map(|source| source.mask(&instances, &mut words)).transpose()?;
            let extras = CullExtras { mask, ahead, ..CullExtras::default() };
            engine.cull_views(&instances, &views, &options, &outputs, &extras)
        };
        self.0.run(py, cull).map(|culling| ViewsCulling(Held::new(py, culling)))
    }

    /// As `cull`; `occluders` says where depth comes from, and `stored` which levels and depths are.
    /// `more`: whether there are two passes, then samples per pixel and views.
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    fn warm_up(
        &self,
        py: Python<'_>,
        instances: &Instances,
        camera: &Camera,
        occluders: Option<&Occluders>,
        stored: ((u32, u32), String),
        options: &Bound<'_, PyAny>,
        outputs: &Bound<'_, PyAny>,
        meshes: Option<&MeshTable>,
        more: (bool, u32, u32),
    ) -> PyResult<()> {
        let meshes = meshes.map(|table| table.0.get(py)).transpose()?;
        let Request { options, outputs } = Request::new(options, outputs, meshes.as_deref())?;
        let instances = instances.0.get(py)?;
        let occluders = occluders.map(|occluders| occluders.0.get(py)).transpose()?;
        let ((first, last), depths) = stored;
        let (levels, depths) = (StoredLevels { first, last }, depths_of(&depths)?);
        let levels = PyramidOptions { levels, depths, ..PyramidOptions::default() };
        let (two_passes, samples, views) = more;
        let more = headless::MoreWarmUp { two_passes, samples, views };
        self.0.run(py, |engine| {
            let occluders = occluders.as_deref().map(Arc::as_ref);
            engine.warm_up(&instances, &camera.0, occluders, &levels, &options, &outputs, &more)
        })
    }

    fn start_timing(&self, py: Python<'_>) -> PyResult<()> {
        self.0.run(py, headless::Engine::start_timing)
    }

    /// The stages since `start_timing`, with their numbers of passes and milliseconds.
    fn stop_timing(&self, py: Python<'_>) -> PyResult<Vec<StageTime>> {
        Ok(self.0.run(py, headless::Engine::stop_timing)?.iter().map(stage_time).collect())
    }

    fn wait(&self, py: Python<'_>) -> PyResult<()> {
        self.0.run(py, headless::Engine::wait)
    }

    /// For tests: the engine's own error in a fork, which the error of [`Held::get`] usually hides.
    /// It also drops a clone of the engine there.
    fn wait_without_guard(&self, py: Python<'_>) -> PyResult<()> {
        let engine = headless::Engine::clone(&*self.0.look(py)?);
        detached(py, move || engine.wait())
    }
}

/// An [`AmongArgument`] for calls without the interpreter.
enum HeldAmong<'a> {
    Mask(&'a [bool]),
    #[expect(clippy::redundant_allocation, reason = "what Python holds is an `Arc` itself")]
    Kept(Arc<Arc<headless::Culling>>),
    KeptByAny(Arc<headless::ViewsCulling>),
}

impl<'a> HeldAmong<'a> {
    fn new(py: Python<'_>, among: &'a AmongArgument<'_>) -> PyResult<Self> {
        Ok(match among {
            AmongArgument::Mask(mask) => Self::Mask(mask.as_slice()?),
            AmongArgument::Kept(culling) => Self::Kept(culling.get().0.get(py)?),
            AmongArgument::KeptByAny(views) => Self::KeptByAny(views.get().0.get(py)?),
        })
    }

    fn source(&self) -> AmongSource<'_> {
        match self {
            Self::Mask(mask) => AmongSource::Mask(mask),
            Self::Kept(culling) => AmongSource::Kept(culling),
            Self::KeptByAny(views) => AmongSource::KeptByAny(views),
        }
    }
}

/// Bounds on the device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Instances(pub(crate) Held<Arc<hiz_core::Instances>>);

impl OnDevice for Arc<hiz_core::Instances> {}

#[pymethods]
impl Instances {
    fn num_instances(&self, py: Python<'_>) -> PyResult<u32> {
        Ok(self.0.look(py)?.len())
    }

    fn kind(&self, py: Python<'_>) -> PyResult<&'static str> {
        Ok(match self.0.look(py)?.kind() {
            hiz_core::BoundsKind::Sphere => "spheres",
            hiz_core::BoundsKind::Box => "boxes",
            hiz_core::BoundsKind::OrientedBox => "oriented_boxes",
            hiz_core::BoundsKind::Point | hiz_core::BoundsKind::WidePoint => "points",
        })
    }

    fn num_pieces(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.0.look(py)?.num_pieces())
    }

    fn invalid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u64>>> {
        self.0
            .run(py, |instances| instances.invalid())
            .map(|invalid| PyArray1::from_vec(py, invalid))
    }

    fn host_bytes(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.0.get(py)?.host_bytes())
    }

    fn device_bytes(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.0.look(py)?.device_bytes())
    }
}

/// Flat positions and triangles, and which faces do not occlude.
type SurfaceArrays<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u32>>, &'static str);

/// Triangle meshes on the device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Occluders(pub(crate) Held<Arc<hiz_core::Occluders>>);

impl OnDevice for Arc<hiz_core::Occluders> {}

#[pymethods]
impl Occluders {
    #[pyo3(name = "move")]
    fn move_mesh(
        &self,
        py: Python<'_>,
        mesh: usize,
        transforms: Option<FloatArray<'_>>,
    ) -> PyResult<()> {
        let transforms = transforms.as_ref().map(FloatArray::floats).transpose()?;
        self.0.run(py, |occluders| occluders.move_mesh(mesh, transforms))
    }

    fn host_bytes(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.0.look(py)?.surface().host_bytes())
    }

    /// Copies of the world positions, 3 per vertex, and of the vertices, 3 per triangle; and the
    /// faces that do not occlude.
    fn surface<'py>(&self, py: Python<'py>) -> PyResult<SurfaceArrays<'py>> {
        let occluders = self.0.look(py)?;
        let surface = occluders.surface();
        let faces = match surface.cull_mode() {
            FaceCull::None => "none",
            FaceCull::Back => "back",
            FaceCull::Front => "front",
        };
        let (positions, triangles) = surface.world();
        let positions = PyArray1::from_slice(py, positions.as_flattened());
        Ok((positions, PyArray1::from_slice(py, triangles.as_flattened()), faces))
    }

    fn num_triangles(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.0.look(py)?.num_triangles())
    }

    fn num_parts(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.0.look(py)?.num_parts())
    }

    fn device_bytes(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.0.look(py)?.device_bytes())
    }
}

/// A depth image on the device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct DepthImage(pub(crate) Held<headless::DepthImage>);

#[pymethods]
impl DepthImage {
    fn read<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        self.0.run(py, headless::DepthImage::read).map(|depth| PyArray1::from_vec(py, depth))
    }

    fn rasteriser(&self, py: Python<'_>) -> PyResult<Option<&'static str>> {
        Ok(self.0.look(py)?.rasteriser().map(|rasteriser| match rasteriser {
            Rasteriser::Auto => "auto",
            Rasteriser::Device => "device",
            Rasteriser::Host => "host",
        }))
    }
}

impl OnDevice for headless::DepthImage {}

/// A depth pyramid on the device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Pyramid(pub(crate) Held<WithEngine>);

/// The pyramid, and the engine that reads it.
pub(crate) type WithEngine = (headless::Engine, Arc<hiz_core::Pyramid>);

impl OnDevice for WithEngine {
    fn engine(&self) -> Option<&headless::Engine> {
        Some(&self.0)
    }
}

#[pymethods]
impl Pyramid {
    fn num_levels(&self, py: Python<'_>) -> PyResult<u32> {
        Ok(self.0.look(py)?.1.num_levels())
    }

    /// The first and the last stored level above 0; none for an image of one pixel.
    fn stored_levels(&self, py: Python<'_>) -> PyResult<Option<(u32, u32)>> {
        Ok(self.0.look(py)?.1.stored_levels().map(|levels| (levels.first, levels.last)))
    }

    /// `((height, width), texels)` of each level of a mip texture.
    fn mips<'py>(
        &self,
        py: Python<'py>,
        depths: &str,
        lookup: &str,
    ) -> PyResult<Vec<LevelArray<'py>>> {
        let options = mip_options(depths, lookup)?;
        let levels = self.0.run(py, |(engine, pyramid)| {
            let mips = engine.mips(pyramid, &options)?;
            let level = |k| {
                let size = mips.level_size(k).map_or((0, 0), |size| (size.height, size.width));
                Ok((size, engine.read_mip(&mips, k)?))
            };
            (0..mips.num_levels()).map(level).collect::<Result<Vec<_>, _>>()
        })?;
        Ok(levels.into_iter().map(|(size, t)| (size, PyArray1::from_vec(py, t))).collect())
    }

    /// `((height, width), texels)` of a level of one end.
    fn read_level<'py>(&self, py: Python<'py>, k: u32, nearest: bool) -> PyResult<LevelArray<'py>> {
        let end = if nearest { DepthEnd::Nearest } else { DepthEnd::Farthest };
        let (size, texels) = self.0.run(py, |(engine, pyramid)| {
            let size = pyramid.level_size(k).map_or((0, 0), |size| (size.height, size.width));
            Ok((size, engine.read_level_of(pyramid, k, end)?))
        })?;
        Ok((size, PyArray1::from_vec(py, texels)))
    }

    fn device_bytes(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.0.get(py)?.1.device_bytes())
    }
}
