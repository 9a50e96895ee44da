//! Colours and depth images of points: conversions only.

use hiz_core::{ColourSums, ColourWeight, Colours};
use numpy::{PyArray1, PyReadonlyArrayDyn, PyReadwriteArray1, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::{FloatArray, in_c_order};
use crate::camera::Camera;
use crate::errors::raised;

/// An image of three channels.
#[derive(FromPyObject)]
pub(crate) enum Picture<'py> {
    #[pyo3(transparent, annotation = "uint8 array")]
    Bytes(PyReadonlyArrayDyn<'py, u8>),
    #[pyo3(transparent, annotation = "float32 array")]
    F32(PyReadonlyArrayDyn<'py, f32>),
}

impl Picture<'_> {
    fn colours(&self) -> PyResult<Colours<'_>> {
        Ok(match self {
            Self::Bytes(array) => {
                in_c_order(array.is_c_contiguous())?;
                Colours::Bytes(array.as_slice()?)
            }
            Self::F32(array) => {
                in_c_order(array.is_c_contiguous())?;
                Colours::F32(array.as_slice()?)
            }
        })
    }
}

/// Adds the colours of one image to the points that `visible` names.
/// `sums`: colours (3 N), weights (N) and counts (N), which are changed.
#[expect(clippy::too_many_arguments, reason = "the signature of Python's function")]
#[pyfunction]
pub(crate) fn add_colours(
    py: Python<'_>,
    positions: FloatArray<'_>,
    visible: PyReadonlyArrayDyn<'_, bool>,
    camera: &Camera,
    image: Picture<'_>,
    bilinear: bool,
    weight: &str,
    mut colours: PyReadwriteArray1<'_, f32>,
    mut weights: PyReadwriteArray1<'_, f32>,
    mut counts: PyReadwriteArray1<'_, u32>,
) -> PyResult<()> {
    let (positions, image, camera) = (positions.floats()?, image.colours()?, &camera.0);
    let visible = visible.as_slice()?;
    let weight = match weight {
        "equal" => ColourWeight::Equal,
        "near" => ColourWeight::Near,
        other => return Err(PyValueError::new_err(format!("weight: no weight {other:?}"))),
    };
    let sums = ColourSums {
        colours: colours.as_slice_mut()?,
        weights: weights.as_slice_mut()?,
        counts: counts.as_slice_mut()?,
    };
    py.detach(|| hiz_core::add_colours(positions, visible, camera, (image, bilinear, weight), sums))
        .map_err(|error| raised(py, error))
}

/// The NDC depth of discs around points, one number per pixel.
#[pyfunction]
pub(crate) fn depth_of_points<'py>(
    py: Python<'py>,
    positions: FloatArray<'_>,
    camera: &Camera,
    radius: f64,
    radius_px: f64,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let (positions, camera) = (positions.floats()?, &camera.0);
    py.detach(|| hiz_core::depth_of_points(positions, camera, radius, radius_px))
        .map(|depth| PyArray1::from_vec(py, depth))
        .map_err(|error| raised(py, error))
}
