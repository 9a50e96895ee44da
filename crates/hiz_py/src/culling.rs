//! The answer of a cull, which is read on request.

use std::sync::Arc;

use hiz_core::{Verdict, headless};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::held::{Held, OnDevice};

/// Name, number of passes, milliseconds on the device.
pub(crate) type StageTime = (&'static str, u32, Option<f64>);

pub(crate) fn stage_time(stage: &hiz_core::StageTime) -> StageTime {
    (stage.stage, stage.passes, stage.gpu_ms)
}

/// A submitted cull.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Culling(pub(crate) Held<Arc<headless::Culling>>);

impl OnDevice for Arc<headless::Culling> {}

#[pymethods]
impl Culling {
    fn num_instances(&self, py: Python<'_>) -> PyResult<u32> {
        Ok(self.0.look(py)?.instances().len())
    }

    /// Whether the answer has arrived; waits for nothing.
    fn is_ready(&self, py: Python<'_>) -> PyResult<bool> {
        self.0.run(py, |culling| culling.is_ready())
    }

    fn wait(&self, py: Python<'_>) -> PyResult<()> {
        self.0.run(py, |culling| culling.wait())
    }

    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        self.0.run(py, |culling| culling.mask()).map(|mask| PyArray1::from_vec(py, mask))
    }

    fn verdicts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let codes = |culling: &Arc<headless::Culling>| {
            culling.verdicts().map(bytemuck::cast_vec::<Verdict, u8>)
        };
        self.0.run(py, codes).map(|verdicts| PyArray1::from_vec(py, verdicts))
    }

    fn indices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        self.0.run(py, |culling| culling.indices()).map(|indices| PyArray1::from_vec(py, indices))
    }

    /// The records one after the other, 20 bytes each.
    fn draws<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.0
            .run(py, |culling| culling.draws())
            .map(|draws| PyBytes::new(py, bytemuck::cast_slice(&draws)))
    }

    /// How many records of each piece draw something.
    fn draw_counts(&self, py: Python<'_>) -> PyResult<Vec<u32>> {
        self.0.run(py, |culling| culling.draw_counts())
    }

    /// The LOD of each instance; 255 for those that are not kept.
    fn lods<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        self.0.run(py, |culling| culling.lods()).map(|lods| PyArray1::from_vec(py, lods))
    }

    /// The list of one bin.
    fn bin<'py>(
        &self,
        py: Python<'py>,
        mesh: u32,
        lod: u32,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let bin = |culling: &Arc<headless::Culling>| culling.bin(mesh, lod);
        self.0.run(py, bin).map(|indices| PyArray1::from_vec(py, indices))
    }

    /// The counts of pixels one after the other, five u32 each.
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let counts = self.0.run(py, |culling| culling.pixels())?;
        Ok(PyArray1::from_slice(py, bytemuck::cast_slice(&counts)))
    }

    fn counts(&self, py: Python<'_>) -> PyResult<Counts> {
        Ok(Counts::of(&self.0.run(py, |culling| culling.counts())?))
    }

    /// How many instances were kept, if that is known, and how many of them are listed.
    fn demand_and_written(&self, py: Python<'_>) -> PyResult<(Option<u64>, u64)> {
        self.0.run(py, |culling| culling.demand_and_written())
    }

    /// Milliseconds for recording, for compiling, until the device was done, and for readback.
    fn timings(&self, py: Python<'_>) -> PyResult<(f64, f64, f64, f64)> {
        let timings = self.0.get(py)?.timings();
        Ok((timings.record_ms, timings.compile_ms, timings.wall_ms, timings.readback_ms))
    }

    /// The stages with their numbers of passes and milliseconds on the device.
    fn stage_times(&self, py: Python<'_>) -> PyResult<Option<Vec<StageTime>>> {
        let stages = self.0.run(py, |culling| culling.stage_times())?;
        Ok(stages.map(|stages| stages.iter().map(stage_time).collect()))
    }

    fn explain(&self, py: Python<'_>, index: u64) -> PyResult<Explanation> {
        self.0.run(py, |culling| culling.explain(index)).map(Explanation)
    }
}

/// A submitted cull for several views.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct ViewsCulling(pub(crate) Held<headless::ViewsCulling>);

impl OnDevice for headless::ViewsCulling {}

#[pymethods]
impl ViewsCulling {
    fn num_instances(&self, py: Python<'_>) -> PyResult<u32> {
        Ok(self.0.look(py)?.instances().len())
    }

    fn num_views(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.0.look(py)?.num_views())
    }

    fn is_ready(&self, py: Python<'_>) -> PyResult<bool> {
        self.0.run(py, headless::ViewsCulling::is_ready)
    }

    fn wait(&self, py: Python<'_>) -> PyResult<()> {
        self.0.run(py, headless::ViewsCulling::wait)
    }

    /// The masks one after the other.
    fn masks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        self.0.run(py, headless::ViewsCulling::masks).map(|masks| PyArray1::from_vec(py, masks))
    }

    fn any<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        self.0.run(py, headless::ViewsCulling::any).map(|any| PyArray1::from_vec(py, any))
    }

    fn any_indices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        self.0
            .run(py, headless::ViewsCulling::any_indices)
            .map(|indices| PyArray1::from_vec(py, indices))
    }

    /// The records one after the other, 20 bytes each.
    fn any_draws<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.0
            .run(py, headless::ViewsCulling::any_draws)
            .map(|draws| PyBytes::new(py, bytemuck::cast_slice(&draws)))
    }

    fn view(&self, py: Python<'_>, view: usize) -> PyResult<Culling> {
        let culling = Arc::clone(self.0.look(py)?.view(view));
        Ok(Culling(Held::new(py, culling)))
    }
}

/// How many instances got which verdict, and how many tests that took.
#[pyclass(frozen, get_all, module = "hizvk._core")]
pub(crate) struct Counts {
    tested: u64,
    absent: u64,
    outside: u64,
    occluded: u64,
    visible: u64,
    unoccluded: u64,
    invalid: u64,
    demand: u64,
    written: u64,
    tested_groups: u64,
    tested_boxes: [u64; 3],
    tested_instances: u64,
    accepted_instances: u64,
    levels: [u64; 16],
    texels_read: u64,
}

impl Counts {
    pub(crate) fn of(counts: &headless::Counts) -> Self {
        Self {
            tested: counts.tested,
            absent: counts.absent,
            outside: counts.outside,
            occluded: counts.occluded,
            visible: counts.visible,
            unoccluded: counts.unoccluded,
            invalid: counts.invalid,
            demand: counts.demand,
            written: counts.written,
            tested_groups: counts.tested_groups,
            tested_boxes: counts.tested_boxes,
            tested_instances: counts.tested_instances,
            accepted_instances: counts.accepted_instances,
            levels: counts.levels,
            texels_read: counts.texels_read,
        }
    }
}

/// How one verdict came about.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Explanation(headless::Explanation);

#[pymethods]
impl Explanation {
    #[getter]
    fn verdict(&self) -> u8 {
        self.0.verdict as u8
    }

    #[getter]
    fn reason(&self) -> &str {
        &self.0.reason
    }

    #[getter]
    fn rectangle(&self) -> Option<[i32; 4]> {
        self.0.rectangle
    }

    #[getter]
    fn level(&self) -> Option<u32> {
        self.0.level
    }

    /// Level, column, row and depth of each texel.
    #[getter]
    fn texels(&self) -> Vec<(u32, u32, u32, f32)> {
        let told = &self.0;
        let places = told.texel_levels.iter().zip(&told.texels).zip(&told.texel_depths);
        places.map(|((level, [x, y]), depth)| (*level, *x, *y, *depth)).collect()
    }

    #[getter]
    fn texels_read(&self) -> u32 {
        self.0.texels_read
    }

    #[getter]
    fn decisive(&self) -> Option<usize> {
        self.0.decisive
    }

    #[getter]
    fn farthest(&self) -> Option<f32> {
        self.0.farthest
    }

    #[getter]
    fn nearest(&self) -> Option<f64> {
        self.0.nearest
    }

    #[getter]
    fn farthest_z(&self) -> Option<f64> {
        self.0.farthest_z
    }

    #[getter]
    fn in_front_of(&self) -> Option<f32> {
        self.0.in_front_of
    }

    #[getter]
    fn in_front_of_z(&self) -> Option<f64> {
        self.0.in_front_of_z
    }

    #[getter]
    fn nearest_z(&self) -> Option<f64> {
        self.0.nearest_z
    }

    #[getter]
    fn stale(&self) -> bool {
        self.0.stale
    }

    #[getter]
    fn group(&self) -> Option<Self> {
        self.0.group.as_deref().cloned().map(Self)
    }
}
