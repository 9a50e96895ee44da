//! The cull: one camera, one pyramid, one set of instances.

#[cfg(feature = "headless")]
pub(crate) mod count;
#[cfg(feature = "headless")]
pub(crate) mod explain;
pub(crate) mod groups;
pub(crate) mod inputs;
pub(crate) mod options;
pub(crate) mod pipelines;
pub(crate) mod record;
#[cfg(feature = "headless")]
pub(crate) mod refine;
pub(crate) mod view_uniform;
