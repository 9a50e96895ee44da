//! Output: what a cull leaves on the device.
//!
//! - `outputs` says what is asked for: mask, verdicts, indices, draw arguments.
//! - `visible` has the buffers: a mask and verdicts per piece, and what `lists` and `survivors`
//!   hold.
//! - `compact` makes the ordered list and its length from the mask, and `cut` clears the bits that
//!   the list has no room for.
//! - `draw`, `counters` and `verdict` have the layouts and codes that the shaders share.
//!
//! This room makes buffers and records commands; it never submits or waits.

pub(crate) mod compact;
pub(crate) mod counters;
pub(crate) mod cut;
pub(crate) mod draw;
pub(crate) mod lists;
pub(crate) mod outputs;
pub(crate) mod survivors;
pub(crate) mod verdict;
pub(crate) mod visible;
