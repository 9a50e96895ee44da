//! Output: what a cull leaves on the device.
//!
//! - `outputs` says what is asked for: mask, verdicts, indices, draw arguments.
//! - `visible` has the buffers: a mask and verdicts per piece, and what `lists` and `survivors`
//!   hold.
//! - `emit` says how kept instances are listed, and `mesh_table` has the meshes of bins.
//! - `bins` has the buffers of bins, and `emit_passes` fills them from bit planes.
//! - `compact` makes the ordered list and its length from the mask, and `cut` clears the bits that
//!   the list has no room for.
//! - `views` joins the masks of several views.
//! - `readback` copies them to the host, a ring of slots at a time.
//! - `draw`, `counters`, `pixels` and `verdict` have the layouts and codes that the shaders share.
//!
//! This room makes buffers and records commands; it never submits or waits.

pub(crate) mod bins;
pub(crate) mod compact;
pub(crate) mod counters;
pub(crate) mod cut;
pub(crate) mod draw;
pub(crate) mod emit;
pub(crate) mod emit_passes;
pub(crate) mod lists;
pub(crate) mod mesh_table;
pub(crate) mod outputs;
pub(crate) mod pixels;
pub(crate) mod readback;
pub(crate) mod survivors;
pub(crate) mod verdict;
pub(crate) mod views;
pub(crate) mod visible;
