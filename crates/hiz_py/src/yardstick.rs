//! Work for benchmarks to time: submissions whose buffers were made beforehand, and the same work
//! done in other ways.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use hiz_core::yardstick::{
    self, BoundsInBuffer, HostRaster, MultisampledDepth, PerLevelReduction, ReductionShape,
};
use hiz_core::{
    CullOptions, Error, Instances, MipOptions, MipTexture, Pyramid, PyramidOptions, StoredLevels,
    Visible, headless,
};
use numpy::{PyArray1, PyReadonlyArrayDyn, PyReadwriteArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::{FloatArray, bounds, depths_of, in_c_order};
use crate::camera::Camera;
use crate::device::{DepthImage, Engine};
use crate::held::{Held, OnDevice, detached};
use crate::meshes::MeshTable;
use crate::options::{Request, mip_options};

/// Wall-clock milliseconds of single submissions to one device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Yardstick(Held<headless::Engine>);

#[pymethods]
impl Yardstick {
    #[new]
    fn new(py: Python<'_>, engine: &Engine) -> PyResult<Self> {
        let engine = headless::Engine::clone(&*engine.0.get(py)?);
        Ok(Self(Held::new(py, engine)))
    }

    /// The profile of Cargo that this module was compiled with; host code is slower with `dev`.
    #[staticmethod]
    fn profile() -> &'static str {
        if cfg!(debug_assertions) { "dev" } else { "release" }
    }

    fn empty_submit_ms(&self, py: Python<'_>) -> PyResult<f64> {
        self.0.run(py, yardstick::empty_submit_ms)
    }

    /// How many pipelines the device has made so far.
    fn pipelines_made(&self, py: Python<'_>) -> PyResult<u64> {
        self.0.run(py, |engine| Ok::<_, Error>(yardstick::pipelines_made(engine)))
    }

    /// Milliseconds of a copy by one thread of the host.
    #[staticmethod]
    #[expect(clippy::needless_pass_by_value, reason = "the arrays are held during the call")]
    fn memcpy_ms(
        py: Python<'_>,
        source: PyReadonlyArrayDyn<'_, f32>,
        mut target: PyReadwriteArrayDyn<'_, f32>,
    ) -> PyResult<f64> {
        in_c_order(source.is_c_contiguous() && target.is_c_contiguous())?;
        let (from, to) = (source.as_slice()?, target.as_slice_mut()?);
        if from.len() != to.len() {
            return Err(PyValueError::new_err(format!(
                "target: expected {} numbers, got {}",
                from.len(),
                to.len()
            )));
        }
        detached(py, || Ok(yardstick::memcpy_ms(from, to)))
    }

    /// A reduction of `depth`: the library's own with these levels, or one dispatch per level.
    /// The latter makes all levels of farthest depths.
    #[pyo3(signature = (depth, shape, levels, depths = "farthest"))]
    fn reduction(
        &self,
        py: Python<'_>,
        depth: &DepthImage,
        shape: &str,
        levels: (u32, u32),
        depths: &str,
    ) -> PyResult<YardstickReduction> {
        let depths = depths_of(depths)?;
        let (engine, depth) = (self.0.get(py)?, depth.0.get(py)?);
        let (engine, depth) =
            (headless::Engine::clone(&engine), headless::DepthImage::clone(&depth));
        let per_level = |shape| {
            detached(py, || PerLevelReduction::new(&engine, &depth, shape)).map(Reducer::PerLevel)
        };
        let reducer = match shape {
            "own" => {
                let levels = StoredLevels { first: levels.0, last: levels.1 };
                let options = PyramidOptions { levels, depths, ..PyramidOptions::default() };
                let pyramid = detached(py, || engine.pyramid_with(&depth, &options))?;
                Reducer::Own(depth, pyramid)
            }
            "buffer" => per_level(ReductionShape::Buffer)?,
            "textures" => per_level(ReductionShape::Textures)?,
            other => return Err(PyValueError::new_err(format!("shape: no shape {other:?}"))),
        };
        Ok(YardstickReduction(Held::new(py, Reduction { engine, reducer })))
    }

    /// A reduction of a rectangle (x0, y0, x1, y1) of `depth` into a pyramid of all levels.
    fn region(
        &self,
        py: Python<'_>,
        depth: &DepthImage,
        rectangle: (u32, u32, u32, u32),
    ) -> PyResult<YardstickReduction> {
        let depth = headless::DepthImage::clone(&*depth.0.get(py)?);
        let prepare = |engine: &headless::Engine| {
            let pyramid = engine.pyramid(&depth)?;
            let reducer = Reducer::Region(depth, pyramid, rectangle.into());
            Ok(Reduction { engine: engine.clone(), reducer })
        };
        self.0.run(py, prepare).map(|work| YardstickReduction(Held::new(py, work)))
    }

    /// A resolve of multisampled depth of the camera's size to the farthest samples.
    fn resolve(
        &self,
        py: Python<'_>,
        camera: &Camera,
        samples: u32,
    ) -> PyResult<YardstickReduction> {
        let prepare = |engine: &headless::Engine| {
            let depth = MultisampledDepth::new(engine, &camera.0, samples)?;
            Ok(Reduction { engine: engine.clone(), reducer: Reducer::Resolve(depth) })
        };
        self.0.run(py, prepare).map(|work| YardstickReduction(Held::new(py, work)))
    }

    /// The levels above 0 of a mip texture of `depth`.
    fn mips(
        &self,
        py: Python<'_>,
        depth: &DepthImage,
        depths: &str,
        lookup: &str,
    ) -> PyResult<YardstickReduction> {
        let depth = headless::DepthImage::clone(&*depth.0.get(py)?);
        let options = MipOptions { level_0: false, ..mip_options(depths, lookup)? };
        let prepare = |engine: &headless::Engine| {
            let mips = engine.context().create_mip_texture(depth.size(), &options)?;
            Ok(Reduction {
                engine: engine.clone(),
                reducer: Reducer::Mips(Box::new((depth, mips))),
            })
        };
        self.0.run(py, prepare).map(|work| YardstickReduction(Held::new(py, work)))
    }

    /// Spheres or boxes in a buffer on the device, as float32.
    fn bounds_in_buffer(
        &self,
        py: Python<'_>,
        kind: &str,
        arrays: Vec<FloatArray<'_>>,
    ) -> PyResult<YardstickFromBuffer> {
        let bounds = bounds(kind, &arrays)?;
        let prepare = |engine: &headless::Engine| {
            Ok(FromBuffer { engine: engine.clone(), bounds: BoundsInBuffer::new(engine, &bounds)? })
        };
        self.0.run(py, prepare).map(|made| YardstickFromBuffer(Held::new(py, made)))
    }

    /// The rasteriser on the host alone, with the view of `camera`.
    fn raster(
        &self,
        py: Python<'_>,
        occluders: &crate::device::Occluders,
        camera: &Camera,
        threads: usize,
    ) -> PyResult<YardstickRaster> {
        let (occluders, camera) = (occluders.0.get(py)?, camera.0.clone());
        let raster = Mutex::new(HostRaster::usual(camera.size()));
        let prepare = |_: &headless::Engine| {
            Ok(Raster { raster, occluders: Arc::clone(&occluders), camera, threads })
        };
        self.0.run(py, prepare).map(|raster| YardstickRaster(Held::new(py, raster)))
    }

    /// Frames of a renderer: the milliseconds of the warm-up, and per frame those of
    /// `record_occluders`, `record_reduce`, `record_cull` and of the device.
    fn frames(
        &self,
        py: Python<'_>,
        instances: &crate::device::Instances,
        occluders: &crate::device::Occluders,
        cameras: Vec<PyRef<'_, Camera>>,
        is_warmed: bool,
    ) -> PyResult<(f64, Vec<[f64; 4]>)> {
        let (instances, occluders) = (instances.0.get(py)?, occluders.0.get(py)?);
        let cameras: Vec<_> = cameras.iter().map(|camera| camera.0.clone()).collect();
        let options = CullOptions::default();
        let (warm_up, frames) = self.0.run(py, |engine| {
            yardstick::frames(engine, &instances, &occluders, &cameras, &options, is_warmed)
        })?;
        let of_frame = |times: yardstick::FrameTimes| {
            [times.occluders, times.reduce, times.cull, times.device]
        };
        Ok((warm_up, frames.into_iter().map(of_frame).collect()))
    }

    /// A cull of `instances` into buffers of its own.
    /// With `depth`, each submission first reduces it into `pyramid`.
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    fn cull(
        &self,
        py: Python<'_>,
        instances: &crate::device::Instances,
        camera: &Camera,
        pyramid: &crate::device::Pyramid,
        certified: bool,
        options: &Bound<'_, PyAny>,
        outputs: &Bound<'_, PyAny>,
        depth: Option<&DepthImage>,
        meshes: Option<&MeshTable>,
    ) -> PyResult<YardstickCull> {
        let meshes = meshes.map(|table| table.0.get(py)).transpose()?;
        let Request { options, outputs } = Request::new(options, outputs, meshes.as_deref())?;
        let (instances, pyramid) = (instances.0.get(py)?, pyramid.0.get(py)?);
        let depth = depth.map(|depth| depth.0.get(py)).transpose()?;
        let prepare = |engine: &headless::Engine| {
            Ok(Cull {
                visible: engine.context().create_visible(&instances, &outputs)?,
                engine: engine.clone(),
                instances: Arc::clone(&instances),
                camera: camera.0.clone(),
                pyramid: Arc::clone(&pyramid.1),
                depth: depth.map(|depth| headless::DepthImage::clone(&depth)),
                options,
                certified,
            })
        };
        self.0.run(py, prepare).map(|cull| YardstickCull(Held::new(py, cull)))
    }
}

enum Reducer {
    Own(headless::DepthImage, Arc<Pyramid>),
    Region(headless::DepthImage, Arc<Pyramid>, [u32; 4]),
    Resolve(MultisampledDepth),
    Mips(Box<(headless::DepthImage, MipTexture)>),
    PerLevel(PerLevelReduction),
}

/// A reduction that can be submitted again and again.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct YardstickReduction(Held<Reduction>);

struct Reduction {
    engine: headless::Engine,
    reducer: Reducer,
}

#[pymethods]
impl YardstickReduction {
    fn ms(&self, py: Python<'_>) -> PyResult<f64> {
        self.0.run(py, |Reduction { engine, reducer }| {
            yardstick::submitted_ms(engine, |encoder| match reducer {
                Reducer::Own(depth, pyramid) => yardstick::reduce(engine, encoder, depth, pyramid),
                Reducer::Region(depth, pyramid, rectangle) => {
                    yardstick::reduce_region(engine, encoder, depth, *rectangle, pyramid)
                }
                Reducer::Resolve(depth) => depth.record(engine, encoder),
                Reducer::Mips(mips) => {
                    let (depth, mips) = &**mips;
                    let convention = depth.camera().convention();
                    engine.context().record_mips(encoder, depth.texture(), convention, mips)
                }
                Reducer::PerLevel(reduction) => {
                    reduction.record(encoder);
                    Ok(())
                }
            })
        })
    }
}

/// Bounds in a buffer that can be taken again and again.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct YardstickFromBuffer(Held<FromBuffer>);

struct FromBuffer {
    engine: headless::Engine,
    bounds: BoundsInBuffer,
}

#[pymethods]
impl YardstickFromBuffer {
    /// Milliseconds of records and group boxes of all of them.
    fn ms(&self, py: Python<'_>) -> PyResult<f64> {
        self.0.run(py, |FromBuffer { engine, bounds }| {
            yardstick::submitted_ms(engine, |encoder| bounds.record(engine, encoder))
        })
    }

    /// Milliseconds of a copy of the same bytes on the device.
    fn copy_ms(&self, py: Python<'_>) -> PyResult<f64> {
        self.0.run(py, |FromBuffer { engine, bounds }| {
            yardstick::submitted_ms(engine, |encoder| {
                bounds.record_copy(encoder);
                Ok(())
            })
        })
    }
}

/// An image on the host that can be drawn again and again.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct YardstickRaster(Held<Raster>);

struct Raster {
    raster: Mutex<HostRaster>,
    occluders: Arc<hiz_core::Occluders>,
    camera: hiz_core::Camera,
    threads: usize,
}

#[pymethods]
impl YardstickRaster {
    /// Milliseconds of clearing the image and drawing all occluders.
    fn ms(&self, py: Python<'_>) -> PyResult<f64> {
        self.0.run(py, |Raster { raster, occluders, camera, threads }| {
            let mut raster = raster.lock().unwrap_or_else(PoisonError::into_inner);
            let start = Instant::now();
            raster.draw(occluders.surface(), camera, *threads, true)?;
            Ok(1e3 * start.elapsed().as_secs_f64())
        })
    }
}

/// A cull that can be submitted again and again.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct YardstickCull(Held<Cull>);

struct Cull {
    engine: headless::Engine,
    instances: Arc<Instances>,
    camera: hiz_core::Camera,
    pyramid: Arc<Pyramid>,
    depth: Option<headless::DepthImage>,
    visible: Visible,
    options: CullOptions,
    certified: bool,
}

#[pymethods]
impl YardstickCull {
    fn ms(&self, py: Python<'_>) -> PyResult<f64> {
        self.0.run(py, |cull| yardstick::submitted_ms(&cull.engine, |encoder| cull.record(encoder)))
    }

    /// Milliseconds of what follows the marking: lists and draws of what `ms` has marked.
    fn emit_ms(&self, py: Python<'_>) -> PyResult<f64> {
        self.0.run(py, |Cull { engine, instances, visible, .. }| {
            yardstick::submitted_ms(engine, |encoder| {
                yardstick::record_emission(engine, encoder, instances, visible)
            })
        })
    }

    /// The mask of the last submission.
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        self.0
            .run(py, |cull| yardstick::read_mask(&cull.engine, &cull.visible))
            .map(|mask| PyArray1::from_vec(py, mask))
    }

    /// Bytes of the buffers for the answer.
    fn device_bytes(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.0.look(py)?.visible.device_bytes())
    }
}

impl OnDevice for Reduction {}

impl OnDevice for FromBuffer {}

impl OnDevice for Raster {}

impl OnDevice for Cull {}

impl Cull {
    fn record(&self, encoder: &mut hiz_core::wgpu::CommandEncoder) -> Result<(), Error> {
        let Self { engine, instances, camera, pyramid, visible, options, .. } = self;
        if let Some(depth) = &self.depth {
            yardstick::reduce(engine, encoder, depth, pyramid)?;
        }
        if self.certified {
            engine.context().record_cull(encoder, instances, camera, pyramid, visible, options)
        } else {
            yardstick::record_uncertified_cull(
                engine, encoder, instances, camera, pyramid, visible, options,
            )
        }
    }
}
