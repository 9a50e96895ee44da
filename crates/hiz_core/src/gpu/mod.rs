//! The device, and the objects that are made on it.
//!
//! This room knows no stage: each stage describes the pipelines, bindings and buffers it needs.
//! Every object is made in an error scope of its own (`checked`), which returns wgpu's errors.
//! Nothing here submits, waits or reads back.

pub(crate) mod buffers;
mod checked;
pub(crate) mod clock_check;
pub(crate) mod copies;
pub(crate) mod depth_source;
pub(crate) mod device;
pub(crate) mod kept;
pub(crate) mod layouts;
pub(crate) mod loops;
pub(crate) mod made;
pub(crate) mod numbers;
pub(crate) mod pipelines;
pub(crate) mod recorded_uniform;
pub(crate) mod row_staging;
pub(crate) mod shader;
pub(crate) mod stage_times;
