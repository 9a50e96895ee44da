//! `hizvk.CullOptions` and `hizvk.Outputs` as the engine's options: a line per field.
//!
//! The struct expressions name every field, so that an option without its line does not compile.

use std::sync::{Mutex, PoisonError};

use hiz_core::{
    Coverage, CullOptions, DirectionalLight, DrawTemplate, Fit, Footprint, Hierarchy, LodRule,
    MeshTable, MipDepths, MipLookup, MipOptions, Order, Outputs,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyAny;

use crate::meshes::emit;

/// What a cull is asked, taken whole from the two Python objects.
#[derive(Clone)]
pub(crate) struct Request {
    pub(crate) options: CullOptions,
    pub(crate) outputs: Outputs,
}

impl Request {
    /// `meshes`: the table that the outputs speak of.
    pub(crate) fn new(
        options: &Bound<'_, PyAny>,
        outputs: &Bound<'_, PyAny>,
        meshes: Option<&MeshTable>,
    ) -> PyResult<Self> {
        let options = cull_options(options)?;
        let outputs = self::outputs(outputs, options.order, meshes)?;
        Ok(Self { options, outputs })
    }
}

/// The last request without meshes, and the objects that it was taken from.
///
/// Culls in a row mostly have the same two objects, which are frozen and have two dozen fields.
/// A lock, which is held only together with the interpreter lock.
#[derive(Default)]
pub(crate) struct LastRequest(Mutex<Option<Answered>>);

/// A request with its options and outputs.
struct Answered {
    options: Py<PyAny>,
    outputs: Py<PyAny>,
    request: Request,
}

impl LastRequest {
    /// [`Request::new`] without meshes, which the last one may answer.
    pub(crate) fn or_new(
        &self,
        options: &Bound<'_, PyAny>,
        outputs: &Bound<'_, PyAny>,
    ) -> PyResult<Request> {
        // The lock is taken twice, because reading a field may let another thread run.
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(last) = &*lock()
            && last.options.is(options)
            && last.outputs.is(outputs)
        {
            return Ok(last.request.clone());
        }
        let request = Request::new(options, outputs, None)?;
        let [options, outputs] = [options, outputs].map(|object| object.clone().unbind());
        let before = lock().replace(Answered { options, outputs, request: request.clone() });
        // Without the lock, because objects that are let go of may run code of theirs.
        drop(before);
        Ok(request)
    }
}

pub(crate) fn cull_options(given: &Bound<'_, PyAny>) -> PyResult<CullOptions> {
    Ok(CullOptions {
        order: match word(given, "order")?.as_ref() {
            "stable" => Order::Stable,
            "any" => Order::Any,
            other => return Err(unknown("order", other)),
        },
        coverage: match word(given, "coverage")?.as_ref() {
            "area" => Coverage::Area,
            "sample" => Coverage::Sample,
            other => return Err(unknown("coverage", other)),
        },
        guard_px: given.getattr("guard_px")?.extract()?,
        depth_slack: given.getattr("depth_slack")?.extract()?,
        depth_slack_abs: given.getattr("depth_slack_abs")?.extract()?,
        transform_slack: given.getattr("transform_slack")?.extract()?,
        footprint: match given.getattr("footprint")?.extract()? {
            1 => Footprint::One,
            2 => Footprint::Two,
            4 => Footprint::Four,
            8 => Footprint::Eight,
            other => return Err(unknown("footprint", other)),
        },
        descent: given.getattr("descent")?.extract()?,
        fit: match word(given, "fit")?.as_ref() {
            "rectangle" => Fit::Rectangle,
            "volume" => Fit::Volume,
            other => return Err(unknown("fit", other)),
        },
        hierarchy: hierarchy(&given.getattr("hierarchy")?)?,
        statistics: given.getattr("statistics")?.extract()?,
        lod: lod_rule(&given.getattr("lod")?)?,
        shadow: light(&given.getattr("shadow")?)?,
    })
}

/// None, a bool, or a number of tiers.
fn hierarchy(given: &Bound<'_, PyAny>) -> PyResult<Hierarchy> {
    if given.is_none() {
        return Ok(Hierarchy::Auto);
    }
    Ok(match given.extract::<bool>() {
        Ok(true) => Hierarchy::Always,
        Ok(false) => Hierarchy::Never,
        Err(_) => Hierarchy::Tiers(given.extract()?),
    })
}

/// A `hizvk.DirectionalLight`, or None.
fn light(given: &Bound<'_, PyAny>) -> PyResult<Option<DirectionalLight>> {
    if given.is_none() {
        return Ok(None);
    }
    let (receivers_min, receivers_max) = given.getattr("receivers")?.extract()?;
    Ok(Some(DirectionalLight {
        direction: given.getattr("direction")?.extract()?,
        receivers_min,
        receivers_max,
        angular_radius: given.getattr("angular_radius_deg")?.extract::<f64>()?.to_radians(),
        filter_radius: given.getattr("filter_radius")?.extract()?,
    }))
}

/// Mip textures have level 0 here, since Python sees arrays alone.
pub(crate) fn mip_options(depths: &str, lookup: &str) -> PyResult<MipOptions> {
    let depths = match depths {
        "farthest" => MipDepths::Farthest,
        "nearest" => MipDepths::Nearest,
        "both" => MipDepths::Both,
        other => return Err(unknown("depths", other)),
    };
    let lookup = match lookup {
        "normalized" => MipLookup::Normalized,
        "edge_texel" => MipLookup::EdgeTexel,
        other => return Err(unknown("lookup", other)),
    };
    Ok(MipOptions { depths, lookup, level_0: true, ..MipOptions::default() })
}

fn lod_rule(given: &Bound<'_, PyAny>) -> PyResult<LodRule> {
    if given.is_none() {
        return Ok(LodRule::Finest);
    }
    match given.get_type().name()?.to_cow()?.as_ref() {
        "LodByError" => Ok(LodRule::Error { pixels: given.getattr("pixels")?.extract()? }),
        "LodByDistance" => {
            Ok(LodRule::Distance { thresholds: given.getattr("thresholds")?.extract()? })
        }
        "LodBySize" => Ok(LodRule::Size { pixels: given.getattr("pixels")?.extract()? }),
        other => Err(unknown("lod", other)),
    }
}

fn outputs(
    given: &Bound<'_, PyAny>,
    order: Order,
    meshes: Option<&MeshTable>,
) -> PyResult<Outputs> {
    // An ordered list can be made from the mask later.
    // One in the order of the device cannot, and bins cannot.
    let by_default = order == Order::Any || meshes.is_some();
    let listed = |name| -> PyResult<bool> {
        Ok(given.getattr(name)?.extract::<Option<bool>>()?.unwrap_or(by_default))
    };
    Ok(Outputs {
        mask: given.getattr("mask")?.extract()?,
        verdicts: given.getattr("verdicts")?.extract()?,
        indices: listed("indices")?,
        draws: listed("draws")?,
        pixels: given.getattr("pixels")?.extract()?,
        pixel_budget: given.getattr("pixel_budget")?.extract()?,
        capacity: given.getattr("capacity")?.extract()?,
        draw: draw_template(&given.getattr("draw")?)?,
        emit: emit(given, meshes)?,
    })
}

fn draw_template(given: &Bound<'_, PyAny>) -> PyResult<DrawTemplate> {
    if given.is_none() {
        return Ok(DrawTemplate::default());
    }
    Ok(DrawTemplate {
        index_count: given.getattr("index_count")?.extract()?,
        first_index: given.getattr("first_index")?.extract()?,
        base_vertex: given.getattr("base_vertex")?.extract()?,
        first_instance: given.getattr("first_instance")?.extract()?,
    })
}

fn word(given: &Bound<'_, PyAny>, name: &str) -> PyResult<String> {
    given.getattr(name)?.extract()
}

fn unknown(name: &str, value: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(format!("{name}: expected another value, got {value}"))
}

/// The engine's options in Rust's debug format: of the given objects, or with None its defaults.
/// Tests compare them with Python's.
#[cfg(feature = "testing")]
#[pyfunction]
pub(crate) fn options_text(
    options: Option<&Bound<'_, PyAny>>,
    outputs: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, String)> {
    let options = options.map_or_else(|| Ok(CullOptions::default()), cull_options)?;
    let outputs = outputs.map_or_else(
        || Ok(Outputs::default()),
        |given| self::outputs(given, options.order, None),
    )?;
    Ok((format!("{options:?}"), format!("{outputs:?}")))
}
