//! Numbers of reductions, and of drawings whose levels are copied: a pyramid's header holds one.

use std::sync::atomic::{AtomicU32, Ordering};

/// A new number, never 0.
pub(super) fn next_number() -> u32 {
    static NEXT: AtomicU32 = AtomicU32::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed).max(1)
}
