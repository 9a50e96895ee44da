//! The module `hizvk._core`: conversion of arguments, release of the interpreter lock, errors.
//! It contains no algorithm.
//!
//! The Python modules around it check every argument first, so arrays arrive here as float32 or
//! float64 in C order.
//! What is still wrong is refused by `hiz_core` in the same words.
//! Every class is frozen and may be used from any thread.

mod approximate;
mod arguments;
mod camera;
mod containment;
mod culling;
mod device;
mod errors;
mod held;
mod meshes;
mod methods;
mod options;
mod points;
mod reference;
mod two_passes;
#[cfg(feature = "yardstick")]
mod yardstick;

/// The compiled engine of `hizvk`.
/// Not public: use the modules around it.
#[pyo3::pymodule]
mod _core {
    #[pymodule_export]
    use crate::approximate::ApproximateCulling;
    #[pymodule_export]
    use crate::camera::{Camera, frustum_matrix};
    #[pymodule_export]
    use crate::containment::{check_bounds, check_proxy};
    #[pymodule_export]
    use crate::culling::{Counts, Culling, Explanation, ViewsCulling};
    #[pymodule_export]
    use crate::device::{DepthImage, Engine, Instances, Occluders, Pyramid, adapters};
    #[pymodule_export]
    use crate::held::{after_fork, before_fork, let_go};
    #[pymodule_export]
    use crate::meshes::MeshTable;
    #[pymodule_export]
    use crate::methods::hierarchy::HierarchicalVisibility;
    #[pymodule_export]
    use crate::methods::maps::OcclusionMap;
    #[pymodule_export]
    use crate::methods::tiling::{BspTree, DepthTiles, Tiled};
    #[pymodule_export]
    use crate::methods::{MethodLevels, TextCull};
    #[pymodule_export]
    use crate::points::{add_colours, depth_of_points};
    #[pymodule_export]
    use crate::reference::{reference_classify, reference_pyramid, reference_unoccluded};
    #[pymodule_export]
    use crate::two_passes::{PassAnswer, TwoPasses};

    /// For tests.
    #[cfg(feature = "testing")]
    #[pymodule_export]
    use crate::options::options_text;

    /// For benchmarks of single submits.
    #[cfg(feature = "yardstick")]
    #[pymodule_export]
    use crate::yardstick::{
        Yardstick, YardstickCull, YardstickFromBuffer, YardstickRaster, YardstickReduction,
    };

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name is Python's")]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    /// How this module was compiled; host code is slower in a development build.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name is Python's")]
    const __build__: &str = if cfg!(debug_assertions) { "development" } else { "release" };

    /// Whether `HIZVK_PLANTED_FAULT` replaces texts in the shaders.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name is Python's")]
    const takes_planted_faults: bool = cfg!(feature = "testing");

    /// WGSL for shaders of the user's own.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name is Python's")]
    const mip_lookup: &str = hiz_core::MIP_LOOKUP;
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name is Python's")]
    const mip_cull: &str = hiz_core::MIP_CULL;

    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use numpy::PyArrayMethods;
        use pyo3::types::{PyAnyMethods, PyDictMethods};
        crate::errors::prepare(module.py())?;
        // The binding to NumPy fills such cells, too.
        drop(numpy::PyArray1::<f32>::from_vec(module.py(), Vec::new()).readonly());
        let (atexit, os) = (module.py().import("atexit")?, module.py().import("os")?);
        atexit.call_method1("register", (module.getattr("let_go")?,))?;
        if let Ok(register) = os.getattr("register_at_fork") {
            let hooks = pyo3::types::PyDict::new(module.py());
            hooks.set_item("before", module.getattr("before_fork")?)?;
            hooks.set_item("after_in_parent", module.getattr("after_fork")?)?;
            register.call((), Some(&hooks))?;
        }
        Ok(())
    }
}
