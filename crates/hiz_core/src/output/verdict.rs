//! Verdicts.

/// What a cull says of an instance; `shaders/output/verdict.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::NoUninit)]
#[repr(u8)]
pub enum Verdict {
    /// Outside the frustum, or between all pixel centres in sample coverage: not kept.
    Outside = 0,
    /// Hidden by the depth image, and not outside: not kept.
    Occluded = 1,
    /// Possibly visible: kept.
    Visible = 2,
    /// Invalid bounds (NaN, infinite, negative radius, min > max): kept.
    Invalid = 3,
}

/// The bits of a device's word that hold a verdict; flags stand above them.
pub(crate) const VERDICT_MASK: u32 = 3;

impl Verdict {
    /// Whether the instance is kept.
    pub fn is_kept(self) -> bool {
        self >= Self::Visible
    }

    /// The verdict in the low bits of a word of the device.
    pub(crate) fn of_word(word: u32) -> Self {
        match word & VERDICT_MASK {
            0 => Self::Outside,
            1 => Self::Occluded,
            2 => Self::Visible,
            _ => Self::Invalid,
        }
    }
}
