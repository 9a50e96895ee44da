//! Faults that tests plant into tiling without depths.
//!
//! Without the feature `testing` nothing of them is compiled.

/// The fault that is planted, if any.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Planted(#[cfg(feature = "testing")] pub(super) Option<TilingFault>);

/// Whether this fault is planted.
#[cfg(feature = "testing")]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {
        $planted.0 == Some($crate::methods::tiling::fault::TilingFault::$fault)
    };
}

/// False: without the feature no fault can be planted.
#[cfg(not(feature = "testing"))]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {{
        let _: $crate::methods::tiling::fault::Planted = $planted;
        false
    }};
}
pub(super) use is_planted;

/// A way to make tiling without depths wrong.
///
/// A test suite is trusted once a planted fault makes it fail.
#[cfg(feature = "testing")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TilingFault {
    /// The tree is walked back to front.
    BackToFront,
    /// Parts of a split triangle are drawn whole.
    CutsIgnored,
    /// Both parts of a split triangle are its front part.
    OneSideOfCuts,
    /// A square counts as full once one of its 64 parts is.
    FullByOnePart,
    /// The box of a node is that of its near side alone.
    BoxOfOneSide,
    /// Triangles that cross a plane go to its front without being split.
    NeverSplit,
}
