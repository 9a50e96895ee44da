//! The levels of a pyramid, and which of them are stored.

use crate::error::{Error, Result};

/// The most levels that a pyramid has; images of 32768 pixels a side have all of them.
pub const MAX_LEVELS: usize = 16;

/// Where a level lies in the list of texels; twin of `Level` in `shaders/pyramid/pyramid.wgsl`.
///
/// Offset, stride, width and height are in texels.
/// Offset and stride are 0 for levels that are not stored, such as level 0, the depth texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Level {
    pub(crate) offset: u32,
    pub(crate) stride: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// Which levels of a pyramid are stored.
///
/// Level 0, the depth image itself, is always there.
/// Fewer levels are built faster, but culls keep more.
/// A test reads the next coarser level where the one it wants is not stored.
/// A rectangle too large for the coarsest stored level stays visible, unless a descent is allowed.
///
/// Numbers past the coarsest level of an image mean that level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoredLevels {
    /// The finest stored level, 1..=15.
    pub first: u32,
    /// The coarsest stored level, `first..=15`.
    pub last: u32,
}

impl StoredLevels {
    /// All levels.
    pub const ALL: Self = Self { first: 1, last: MAX_LEVELS as u32 - 1 };

    /// Level `first` and all coarser ones.
    ///
    /// Without level 1 the reduction writes a quarter as much, without level 2 a sixteenth.
    #[must_use]
    pub const fn from(first: u32) -> Self {
        Self { first, ..Self::ALL }
    }

    /// One level alone, made in one dispatch.
    #[must_use]
    pub const fn only(level: u32) -> Self {
        Self { first: level, last: level }
    }

    pub(super) fn checked(self) -> Result<Self> {
        let most = Self::ALL.last;
        if (1..=most).contains(&self.first) && (self.first..=most).contains(&self.last) {
            return Ok(self);
        }
        let (first, last) = (self.first, self.last);
        Err(Error::invalid(
            "levels",
            format!("expected 1 <= first <= last <= {most}, got first {first} and last {last}"),
        ))
    }
}

impl Default for StoredLevels {
    fn default() -> Self {
        Self::ALL
    }
}

/// The stored ones of `levels`, with their numbers.
pub(crate) fn stored_levels(
    levels: &[Level],
    stored: StoredLevels,
) -> impl Iterator<Item = (usize, &Level)> {
    let is_stored = move |k: usize| (stored.first..=stored.last).contains(&(k as u32));
    levels.iter().enumerate().filter(move |(k, _)| is_stored(*k))
}
