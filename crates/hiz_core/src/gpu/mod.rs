//! The device and what is made on it.
//!
//! No stage is known here: pipelines, bindings and buffers are described by the stage that asks for
//! them.

pub(crate) mod buffers;
mod checked;
pub(crate) mod depth_source;
pub(crate) mod device;
pub(crate) mod kept;
pub(crate) mod layouts;
pub(crate) mod pipelines;
pub(crate) mod shader;
