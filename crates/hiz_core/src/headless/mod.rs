//! A device of its own: for scripts and tests that have no renderer.
//! This is what the Python package drives.
//!
//! Everything here is `Send + Sync`; an [`Engine`] is cheap to clone and may be used from any
//! thread.
//!
//! # The end of a process
//! A driver may still be at work when the last wait for it has returned: Mesa's lavapipe frees
//! pipelines on a thread of its own, which only the destruction of the device joins.
//! A process that ends meanwhile may crash in the driver.
//! So **let go of every device before the process ends**: the last clone of an [`Engine`] waits
//! until its device is idle, and the device is destroyed with the last object on it (instances,
//! pyramids, results, and whatever was made on [`Engine::device`]).
//! Keep none of them in a `static`, which is never dropped; a local of `main` and a `thread_local!`
//! are.
//! The same goes for a device of your own under a [`HizContext`].
//! `std::process::exit` drops nothing: return from `main` instead.
//!
//! # Forks
//! No device works in a fork of the process that made it.
//! There every call of an [`Engine`], [`DepthImage`] or [`Culling`] is [`Error::OtherProcess`],
//! before it takes any lock; dropping an [`Engine`] there lets go of nothing.
//! Other objects on the device (instances, pyramids) are better forgotten in the fork than dropped.
//!
//! [`HizContext`]: crate::HizContext
//! [`Error::OtherProcess`]: crate::Error::OtherProcess

mod adapter;
mod counts;
mod cull;
mod culling;
mod depth_image;
pub(crate) mod engine;
mod explanation;
mod levels;
mod process;
pub(crate) mod readback;
mod uploads;

pub use adapter::{ADAPTER_VARIABLE, AdapterSummary, INSTALL_HINT, adapters};
pub use counts::{Counts, Timings};
pub use culling::Culling;
pub use depth_image::DepthImage;
pub use engine::Engine;
pub use explanation::Explanation;
