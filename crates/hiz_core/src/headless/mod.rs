//! A device of its own, for scripts and tests that have no renderer.
//! The Python package uses this module.
//!
//! The data goes through these files:
//!
//! 1. `adapter` lists the adapters, and `engine` opens a device on one.
//! 2. `uploads` brings instances, updates and occluders to it, and `depth_image` depth images.
//!    `samples` takes the farthest of several samples per pixel.
//! 3. `levels` builds pyramids and reads their levels; `renewal` renews a part of one.
//! 4. `cull` submits a cull into buffers of `answers`; `culling` reads them, through `counts`,
//!    `explanation`, `ranges` and `readback`.
//!    With `ahead`, `in_flight` and `slots` the answer comes while the caller does something else.
//!    `views` culls for several cameras, with buffers of `joined`.
//! 5. `two_passes` does that for the early and the late pass of a frame.
//! 6. `single` does all of that at once, for bounds that are used once.
//!
//! `timing` and `clock` take the times of stages.
//! `answers` and `images` lend what was dropped, and `warm_up` runs a frame before the first one.
//! `process` guards all of them against forks.
//! This is the only room that submits, waits and maps buffers for reading; it decides no geometry.
//!
//! Everything here is `Send + Sync`.
//! An [`Engine`] is cheap to clone and may be used from any thread.
//!
//! # The end of a process
//! **Let go of every device before the process ends.**
//!
//! A driver may still be at work when the last wait for it has returned.
//! Mesa's lavapipe frees pipelines on a thread of its own, and only the destruction of the device
//! joins that thread.
//! A process that ends before that may crash in the driver.
//!
//! The last clone of an [`Engine`] waits until its device is idle.
//! The device is destroyed with the last object on it: instances, pyramids, results, and whatever
//! was made on [`Engine::device`].
//! So follow these rules, also for a device of your own under a [`HizContext`]:
//!
//! - Keep none of these objects in a `static`, which is never dropped.
//!   A local of `main` or a `thread_local!` is dropped.
//! - Return from `main` instead of calling `std::process::exit`, which drops nothing.
//!
//! # Forks
//! No device works in a fork of the process that made it.
//! In a fork, every call of an [`Engine`], [`DepthImage`] or [`Culling`] returns
//! [`Error::OtherProcess`] before it takes any lock.
//! Dropping an [`Engine`] there releases nothing.
//! Forget other objects on the device (instances, pyramids) in the fork instead of dropping them.
//!
//! [`HizContext`]: crate::HizContext
//! [`Error::OtherProcess`]: crate::Error::OtherProcess

mod adapter;
mod ahead;
mod answers;
mod approximate;
mod bins;
mod clock;
mod converted;
mod counts;
mod cull;
mod culling;
mod depth_image;
pub(crate) mod engine;
mod explain;
mod explanation;
mod images;
mod in_flight;
mod joined;
mod kept_depth;
mod levels;
mod mips;
mod pixels;
mod process;
mod ranges;
pub(crate) mod readback;
mod receiver_mask;
mod renewal;
mod samples;
mod single;
mod slots;
mod timing;
mod two_passes;
mod uploads;
mod views;
mod warm_up;

pub use adapter::{ADAPTER_VARIABLE, AdapterSummary, INSTALL_HINT, adapters};
pub use approximate::ApproximateCulling;
pub use bins::NO_LOD;
pub use counts::{Counts, Timings};
pub use cull::CullExtras;
pub use culling::Culling;
pub use depth_image::DepthImage;
pub use engine::Engine;
pub use explanation::Explanation;
pub use single::SingleCull;
pub use slots::CULLS_IN_FLIGHT;
pub use two_passes::{EarlyMask, PassAnswer, TwoPasses};
pub use views::{AmongSource, ViewsCulling};
pub use warm_up::MoreWarmUp;
