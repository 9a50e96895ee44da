//! Vector algebra, the Morton curve, joined sets, rounding, memory, threads and wide vectors.
//!
//! This room knows numbers alone: no camera, no instance, no device.
//! Every other room may use it.

pub(crate) mod curve;
pub(crate) mod forest;
pub(crate) mod inverse;
pub(crate) mod linear;
pub(crate) mod memory;
#[cfg(test)]
pub(crate) mod random;
pub(crate) mod rounding;
pub(crate) mod threads;
pub(crate) mod vectors;
