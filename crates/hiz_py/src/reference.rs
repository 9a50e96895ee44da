//! The oracle of `hiz_ref`: conversions only.

use hiz_core::{Bounds, DepthKind, Floats};
use hiz_ref::{Coverage, DepthMeaning, Options, OwnDepth, Verdict, View, Volume};
use numpy::{PyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::{FloatArray, LevelArray, bounds, depth_kind, in_c_order};
use crate::camera::Camera;
use crate::held::detached;

/// How many instances are decided between two checks for an interrupt by the user.
const BATCH: usize = 256;

// The codes of `hizvk.reference`.
const HIDDEN: u8 = 1;
const VISIBLE: u8 = 2;
const INVALID: u8 = 3;
const UNDECIDED: u8 = 4;
const COVERED: u8 = 5;
const UNOCCLUDED: u8 = 6;

/// A camera as the oracle takes it.
fn view_of(camera: &hiz_core::Camera) -> View {
    View {
        rows: camera.rows(),
        origin: camera.origin(),
        width: camera.size().width,
        height: camera.size().height,
        reversed: camera.convention().is_reversed(),
    }
}

fn coverage_of(coverage: &str) -> PyResult<Coverage> {
    match coverage {
        "area" => Ok(Coverage::Area),
        "sample" => Ok(Coverage::Sample),
        other => Err(PyValueError::new_err(format!("coverage: no coverage {other:?}"))),
    }
}

/// What a depth image's numbers mean to the oracle.
fn meaning<'a>(
    camera: &hiz_core::Camera,
    kind: DepthKind,
    scale: f64,
    invalid: &'a [f64],
) -> DepthMeaning<'a> {
    let kind = match kind {
        DepthKind::Ndc => hiz_ref::DepthKind::Ndc,
        DepthKind::ReversedNdc => hiz_ref::DepthKind::ReversedNdc,
        DepthKind::Z => hiz_ref::DepthKind::Z,
        DepthKind::Distance => hiz_ref::DepthKind::Distance,
    };
    DepthMeaning { kind, scale, invalid, origin_is_eye: camera.is_posed() }
}

fn refused(error: hiz_ref::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// `count` codes, made a batch at a time.
fn codes<'py>(
    py: Python<'py>,
    count: usize,
    code: impl Fn(usize) -> Result<u8, hiz_ref::Error> + Sync,
) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let mut codes = Vec::with_capacity(count);
    while codes.len() < count {
        let batch = codes.len()..count.min(codes.len() + BATCH);
        let more: Result<Vec<u8>, hiz_ref::Error> = py.detach(|| batch.map(&code).collect());
        codes.extend(more.map_err(refused)?);
        py.check_signals()?;
    }
    Ok(PyArray1::from_vec(py, codes))
}

/// The oracle's code for each instance.
#[expect(clippy::too_many_arguments, reason = "the signature of Python's function")]
#[pyfunction]
pub(crate) fn reference_classify<'py>(
    py: Python<'py>,
    bounds_kind: &str,
    arrays: Vec<FloatArray<'py>>,
    camera: &Camera,
    image: FloatArray<'py>,
    depth_kind: &str,
    scale: f64,
    invalid: Vec<f64>,
    coverage: &str,
    own_depth: &str,
    tolerance: (f64, f64),
) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let volumes = bounds(bounds_kind, &arrays)?;
    let (image, depth_kind) = (image.floats()?, self::depth_kind(depth_kind)?);
    let count = detached(py, || volumes.len())?;
    let view = view_of(&camera.0);
    let options = Options {
        coverage: coverage_of(coverage)?,
        own_depth: match own_depth {
            "nearest" => OwnDepth::Nearest,
            "pixel" => OwnDepth::PerPixel,
            other => {
                return Err(PyValueError::new_err(format!("own_depth: no own depth {other:?}")));
            }
        },
        ..Options::default()
    };
    let meaning = meaning(&camera.0, depth_kind, scale, &invalid);
    let depth = py
        .detach(|| {
            let numbers: Vec<f64> = (0..image.len()).map(|i| image.get(i)).collect();
            let (relative, absolute) = tolerance;
            let tolerance = hiz_ref::Tolerance { relative, absolute };
            hiz_ref::moved_depth_bounds(&view, &numbers, meaning, tolerance)
        })
        .map_err(refused)?;
    codes(py, count, |i| {
        hiz_ref::classify_between(&view, &volume(&volumes, i), &depth, options).map(code)
    })
}

/// Whether each instance is unoccluded: a code of the oracle.
#[expect(clippy::too_many_arguments, reason = "the signature of Python's function")]
#[pyfunction]
pub(crate) fn reference_unoccluded<'py>(
    py: Python<'py>,
    bounds_kind: &str,
    arrays: Vec<FloatArray<'py>>,
    camera: &Camera,
    image: FloatArray<'py>,
    depth_kind: &str,
    scale: f64,
    invalid: Vec<f64>,
    coverage: &str,
) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let volumes = bounds(bounds_kind, &arrays)?;
    let (image, depth_kind) = (image.floats()?, self::depth_kind(depth_kind)?);
    let count = detached(py, || volumes.len())?;
    let (view, coverage) = (view_of(&camera.0), coverage_of(coverage)?);
    let meaning = meaning(&camera.0, depth_kind, scale, &invalid);
    let depth = py
        .detach(|| {
            let numbers: Vec<f64> = (0..image.len()).map(|i| image.get(i)).collect();
            hiz_ref::nearest_depth_bounds(&view, &numbers, meaning)
        })
        .map_err(refused)?;
    codes(py, count, |i| {
        let volume = volume(&volumes, i);
        if !volume.is_valid() {
            return Ok(INVALID);
        }
        Ok(match hiz_ref::unoccluded_between(&view, &volume, &depth, coverage)? {
            Some(true) => UNOCCLUDED,
            Some(false) => COVERED,
            None => UNDECIDED,
        })
    })
}

/// `((height, width), texels)` of every level, finest first.
#[pyfunction]
pub(crate) fn reference_pyramid<'py>(
    py: Python<'py>,
    depth: PyReadonlyArrayDyn<'py, f32>,
    width: u32,
    height: u32,
    reversed_z: bool,
) -> PyResult<Vec<LevelArray<'py>>> {
    in_c_order(depth.is_c_contiguous())?;
    let depth = depth.as_slice()?;
    let levels = py.detach(|| hiz_ref::pyramid(depth, width, height, reversed_z));
    Ok(levels
        .into_iter()
        .map(|level| ((level.height, level.width), PyArray1::from_vec(py, level.texels)))
        .collect())
}

fn code(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Hidden => HIDDEN,
        Verdict::Visible => VISIBLE,
        Verdict::Invalid => INVALID,
        Verdict::Undecided => UNDECIDED,
    }
}

fn numbers<const N: usize>(array: &Floats<'_>, first: usize) -> [f64; N] {
    std::array::from_fn(|k| array.get(first + k))
}

pub(crate) fn volume(bounds: &Bounds<'_>, i: usize) -> Volume {
    match bounds {
        Bounds::Spheres { centers, radii } => {
            Volume::Sphere { center: numbers(centers, 3 * i), radius: radii.get(i) }
        }
        Bounds::Boxes { min, max } => {
            Volume::Box { min: numbers(min, 3 * i), max: numbers(max, 3 * i) }
        }
        Bounds::Points { positions } => {
            Volume::Sphere { center: numbers(positions, 3 * i), radius: 0.0 }
        }
        Bounds::OrientedBoxes { centers, half_sizes, rotations } => {
            let rows: [f64; 9] = numbers(rotations, 9 * i);
            Volume::OrientedBox {
                center: numbers(centers, 3 * i),
                half_sizes: numbers(half_sizes, 3 * i),
                axes: std::array::from_fn(|row| {
                    std::array::from_fn(|column| rows[3 * row + column])
                }),
            }
        }
    }
}
