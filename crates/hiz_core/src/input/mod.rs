//! What the caller gives, in float64: nothing is rounded to float32 before the records and rows that
//! the device reads are formed.

pub(crate) mod bounds;
pub(crate) mod camera;
pub(crate) mod depth;
pub(crate) mod image;
pub(crate) mod mesh;
pub(crate) mod projection;
pub(crate) mod tolerance;
pub(crate) mod view;
