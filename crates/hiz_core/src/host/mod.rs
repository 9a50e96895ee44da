//! Arithmetic, memory and threads of the host.

pub(crate) mod inverse;
pub(crate) mod linear;
pub(crate) mod memory;
pub(crate) mod rounding;
pub(crate) mod threads;
