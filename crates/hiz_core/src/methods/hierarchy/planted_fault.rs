//! Faults that tests plant into the hierarchy.
//!
//! Without the feature `testing` nothing of them is compiled.

/// The fault that is planted, if any.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Planted(#[cfg(feature = "testing")] pub(super) Option<HierarchyFault>);

/// Whether this fault is planted.
#[cfg(feature = "testing")]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {
        $planted.0 == Some($crate::methods::hierarchy::planted_fault::HierarchyFault::$fault)
    };
}

/// False: without the feature no fault can be planted.
#[cfg(not(feature = "testing"))]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {{
        let _: $crate::methods::hierarchy::planted_fault::Planted = $planted;
        false
    }};
}
pub(super) use is_planted;

/// A way to make [`HierarchicalVisibility`](super::HierarchicalVisibility) wrong.
#[cfg(feature = "testing")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HierarchyFault {
    /// A depth that changes is not told to the coarsest level.
    PropagationStopsEarly,
    /// The box of a node leaves out its last child.
    ParentMissesChild,
    /// The farthest depth of a tile is taken for that of its nearest pixel.
    TileTooNear,
}
