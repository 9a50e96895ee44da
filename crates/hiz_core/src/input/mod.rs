//! What the caller gives, checked and converted in float64, without a device.
//!
//! Nothing is rounded to float32 before the records and rows that the device reads are formed.
//! Cameras and depth images become float32 here (`view`, `depth`); bounds do so in the room
//! `instances`.

pub(crate) mod bounds;
pub(crate) mod camera;
pub(crate) mod depth;
pub(crate) mod depth_kind;
pub(crate) mod depth_numbers;
mod discs;
pub(crate) mod far_pixels;
pub(crate) mod image;
mod lens;
pub(crate) mod light;
pub(crate) mod mesh;
pub(crate) mod near_slack;
pub(crate) mod projection;
mod quick;
pub(crate) mod seen_points;
pub(crate) mod stretch;
mod tell_apart;
pub(crate) mod tolerance;
pub(crate) mod view;
#[cfg(feature = "headless")]
pub(crate) mod view_depth;
pub(crate) mod world_tolerance;
