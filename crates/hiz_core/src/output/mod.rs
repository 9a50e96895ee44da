//! What a cull leaves behind: the mask, verdicts, and the packed list with its draw arguments.

pub(crate) mod compact;
pub(crate) mod counters;
pub(crate) mod draw;
pub(crate) mod lists;
pub(crate) mod outputs;
pub(crate) mod survivors;
pub(crate) mod verdict;
pub(crate) mod visible;
