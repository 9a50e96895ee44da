//! The verdict of a cull on one instance.

/// The verdict of a cull on an instance; twin: `shaders/output/verdict.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::NoUninit)]
#[repr(u8)]
pub enum Verdict {
    /// Not kept: outside the frustum, or in sample coverage between all pixel centres.
    Outside = 0,
    /// Not kept: hidden by the depth image, and not outside.
    Occluded = 1,
    /// Kept: possibly visible, or surely visible where the pyramid has one end alone.
    Visible = 2,
    /// Kept: invalid bounds (NaN, infinite, negative radius, min > max).
    Invalid = 3,
    /// Kept: surely visible as a whole.
    ///
    /// All of the bounds lie inside the six planes of the frustum.
    /// Every pixel that they touch holds a depth farther than all of them.
    /// So nothing in the depth image hides any part, and a test of each pixel may be skipped.
    ///
    /// Only with a pyramid of both ends ([`Depths::Both`](crate::Depths::Both)).
    Unoccluded = 4,
}

/// The bits of a device's word that hold a verdict; flags stand above them.
pub(crate) const VERDICT_MASK: u32 = 7;

impl Verdict {
    /// Whether the instance is kept.
    pub fn is_kept(self) -> bool {
        self >= Self::Visible
    }

    /// The verdict in the lowest bits of a word from the device.
    pub(crate) fn of_word(word: u32) -> Self {
        match word & VERDICT_MASK {
            0 => Self::Outside,
            1 => Self::Occluded,
            2 => Self::Visible,
            4 => Self::Unoccluded,
            _ => Self::Invalid,
        }
    }
}
