//! Arrays and words from Python as the engine's borrowed types.

use hiz_core::{
    Bounds, DepthConvention, DepthInput, DepthKind, DepthNumbers, DepthTolerance, Depths, Floats,
    ImageSize, WorldTolerance,
};
use numpy::{PyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// `(height, width)` of a level and its texels in C order.
pub(crate) type LevelArray<'py> = ((u32, u32), Bound<'py, PyArray1<f32>>);

/// A float array of any shape.
/// A call holds it, so that its memory stays while it is read without the interpreter lock.
#[derive(FromPyObject)]
pub(crate) enum FloatArray<'py> {
    #[pyo3(transparent, annotation = "float32 array")]
    F32(PyReadonlyArrayDyn<'py, f32>),
    #[pyo3(transparent, annotation = "float64 array")]
    F64(PyReadonlyArrayDyn<'py, f64>),
}

impl FloatArray<'_> {
    /// Its numbers in C order, without a copy.
    pub(crate) fn floats(&self) -> PyResult<Floats<'_>> {
        Ok(match self {
            Self::F32(array) => {
                in_c_order(array.is_c_contiguous())?;
                Floats::F32(array.as_slice()?)
            }
            Self::F64(array) => {
                in_c_order(array.is_c_contiguous())?;
                Floats::F64(array.as_slice()?)
            }
        })
    }
}

/// A depth image, held like a [`FloatArray`].
#[derive(FromPyObject)]
pub(crate) enum DepthArray<'py> {
    #[pyo3(transparent)]
    Floats(FloatArray<'py>),
    #[pyo3(transparent, annotation = "uint16 array")]
    U16(PyReadonlyArrayDyn<'py, u16>),
}

impl DepthArray<'_> {
    /// Its numbers in C order, without a copy.
    /// `halves`: whether 16 bits are those of a float16.
    pub(crate) fn numbers(&self, halves: bool) -> PyResult<DepthNumbers<'_>> {
        Ok(match self {
            Self::Floats(array) => array.floats()?.into(),
            Self::U16(array) => {
                in_c_order(array.is_c_contiguous())?;
                let numbers = array.as_slice()?;
                if halves { DepthNumbers::F16(numbers) } else { DepthNumbers::U16(numbers) }
            }
        })
    }
}

/// Refuses Fortran order, which `as_slice` accepts although its numbers come in another sequence.
pub(crate) fn in_c_order(is_c_contiguous: bool) -> PyResult<()> {
    if is_c_contiguous {
        Ok(())
    } else {
        Err(PyValueError::new_err("expected an array in C order"))
    }
}

/// The bounds of this kind in these arrays.
pub(crate) fn bounds<'a>(kind: &str, arrays: &'a [FloatArray<'_>]) -> PyResult<Bounds<'a>> {
    match (kind, arrays) {
        ("spheres", [centers, radii]) => {
            Ok(Bounds::Spheres { centers: centers.floats()?, radii: radii.floats()? })
        }
        ("boxes", [min, max]) => Ok(Bounds::Boxes { min: min.floats()?, max: max.floats()? }),
        ("points", [positions]) => Ok(Bounds::Points { positions: positions.floats()? }),
        ("oriented_boxes", [centers, half_sizes, rotations]) => Ok(Bounds::OrientedBoxes {
            centers: centers.floats()?,
            half_sizes: half_sizes.floats()?,
            rotations: rotations.floats()?,
        }),
        _ => Err(PyValueError::new_err(format!(
            "bounds: no kind {kind:?} of {} arrays",
            arrays.len()
        ))),
    }
}

/// Which depths a pyramid stores, by its word in Python.
pub(crate) fn depths_of(word: &str) -> PyResult<Depths> {
    match word {
        "farthest" => Ok(Depths::Farthest),
        "nearest" => Ok(Depths::Nearest),
        "both" => Ok(Depths::Both),
        "receivers" => Ok(Depths::Receivers),
        other => Err(PyValueError::new_err(format!("depths: no depths {other:?}"))),
    }
}

/// A depth image, and what its numbers mean.
/// `rounding` says to which floats they were rounded before: "none", "single" or "half".
/// Beside it stand relative and absolute tolerance in the world.
pub(crate) fn depth_input<'a>(
    image: &'a DepthArray<'_>,
    kind: &str,
    scale: f64,
    invalid: &'a [f64],
    (rounding, (relative, absolute)): (&str, (f64, f64)),
) -> PyResult<DepthInput<'a>> {
    let tolerance = match rounding {
        "none" => DepthTolerance::NONE,
        "single" => DepthTolerance::SINGLE,
        "half" => DepthTolerance::HALF,
        other => return Err(PyValueError::new_err(format!("rounding: no rounding {other:?}"))),
    };
    let numbers = image.numbers(rounding == "half")?;
    let world_tolerance = WorldTolerance { relative, absolute };
    Ok(DepthInput { numbers, kind: depth_kind(kind)?, scale, invalid, tolerance, world_tolerance })
}

/// [`depth_input`] of the image of each sample.
pub(crate) fn depth_inputs<'a>(
    images: &'a [DepthArray<'_>],
    kind: &str,
    scale: f64,
    invalid: &'a [f64],
    moved: (&str, (f64, f64)),
) -> PyResult<Vec<DepthInput<'a>>> {
    images.iter().map(|image| depth_input(image, kind, scale, invalid, moved)).collect()
}

/// The meaning of a depth image's numbers.
pub(crate) fn depth_kind(kind: &str) -> PyResult<DepthKind> {
    match kind {
        "ndc" => Ok(DepthKind::Ndc),
        "reversed_ndc" => Ok(DepthKind::ReversedNdc),
        "z" => Ok(DepthKind::Z),
        "distance" => Ok(DepthKind::Distance),
        _ => Err(PyValueError::new_err(format!("kind: no kind {kind:?}"))),
    }
}

/// The size from Python's `(height, width)`.
pub(crate) fn image_size((height, width): (u32, u32)) -> ImageSize {
    ImageSize { width, height }
}

/// The convention from Python's `reversed_z`.
pub(crate) fn convention(reversed_z: bool) -> DepthConvention {
    if reversed_z { DepthConvention::Reversed } else { DepthConvention::Standard }
}
