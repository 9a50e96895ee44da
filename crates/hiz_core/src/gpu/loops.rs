//! How long the loops of shaders may be.
//!
//! Mesa's llvmpipe, which lavapipe runs on, ends all loops of an invocation once they have taken so
//! many iterations together (`LP_MAX_TGSI_LOOP_ITERATIONS` in `lp_bld_limits.h`).
//! It tells nobody, and what the loops had left to do is not done.
//!
//! Eight invocations have one counter, which counts what any of them takes.
//! So what bounds it is the most that each part of an invocation can take.
//! A loop may take one iteration more than it needs.
//!
//! Whatever loops over what a caller brings has a bound that keeps it below this on processors:
//! descents in `cull/descent.rs`, counts of pixels in `cull/pixels.rs`, levels made alone in
//! `shaders/pyramid/reduce_coarse.wgsl`, receivers in `shaders/pyramid/receiver_mask.wgsl`.

/// Iterations of all loops of an invocation, by llvmpipe.
pub(crate) const MOST_ITERATIONS: u32 = 65_535;
