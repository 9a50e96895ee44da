//! Faults that tests plant into conservative depth.
//!
//! Without the feature `testing` nothing of them is compiled.

/// The fault that is planted, if any.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Planted(#[cfg(feature = "testing")] pub(crate) Option<PlantedFault>);

/// Whether this fault is planted.
#[cfg(feature = "testing")]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {
        $planted.0 == Some($crate::occluders::surface::planted_fault::PlantedFault::$fault)
    };
}

/// False: without the feature no fault can be planted.
#[cfg(not(feature = "testing"))]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {{
        let _: $crate::occluders::surface::planted_fault::Planted = $planted;
        false
    }};
}
pub(super) use is_planted;

/// A way to make conservative depth wrong.
///
/// See [`conservative_depth`](crate::OccluderSurface::conservative_depth).
/// A test suite is trusted once a planted fault makes it fail.
#[cfg(feature = "testing")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlantedFault {
    /// A border that meets a pixel does not spoil its sheet.
    ContoursIgnored,
    /// A triangle's depth at the pixel's centre counts for the whole pixel.
    DepthAtCentre,
    /// Projected vertices count as exact.
    NoWidening,
    /// Triangles on the same side of their edge count as if they were on different sides.
    FoldsIgnored,
    /// Depths are rounded to the nearest float32.
    RoundedToNearest,
    /// Triangles slightly in front of the near plane count, too.
    BeforeNear,
    /// A point counts as behind the near plane if float64 says so, without a proof.
    NearPointsUnproved,
    /// Projected depths count as exact.
    DepthsExact,
    /// The depths of a triangle's corners count as exact, but not those of its plane.
    CornerDepthsExact,
    /// Points where edges are cut at the near plane count as exact.
    CutPointsExact,
    /// The side along the near plane counts as the edge that was cut.
    CutSidesJoined,
    /// A triangle faces the camera if float64 says so, without a proof.
    FacingUnproved,
    /// In the proof by thresholds, edges that remain do not leave a pixel open.
    BordersIgnored,
    /// There, a triangle's depth at the pixel's centre counts for the whole pixel.
    PlaneWithoutReach,
    /// There, triangles on the same side of their edge count as if they were on different sides.
    FoldsCancel,
    /// There, an edge that misses a pixel misses it, however it was rounded.
    NoEdgeMargin,
    /// There, a triangle that covers a pixel's centre covers the pixel.
    CentreForSquare,
    /// One side of the outline of a solid does not count.
    SideOfOutlineIgnored,
    /// One of the planes of a solid bounds its depth.
    OnePlaneOfSolid,
    /// In the search, a triangle that covers the centre of a quarter covers the quarter.
    CentreForQuarter,
    /// In the proof, edges to triangles that were left out are no borders.
    LeftOutNeighboursIgnored,
    /// There and in the search, the box of a triangle's pixels has the first of them alone.
    BoxesTooSmall,
    /// There, the pass over edges decides what is in a slab with planes in float32.
    MembershipInFloat32,
    /// Vertices are rounded to float32, and to the eye, before they are projected.
    VerticesInFloat32,
}
