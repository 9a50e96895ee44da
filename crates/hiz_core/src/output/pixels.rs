//! Counts of pixels: how much of an instance a depth image hides.

/// In how many pixels of the depth image an instance is hidden, and in how many it may show.
///
/// They are written for each instance by a cull with [`Outputs::pixels`](crate::Outputs::pixels).
/// All of them are about the pixels that are counted in `touched`.
///
/// - Every pixel that the volume can touch is counted, and few others: `touched` is an upper bound.
/// - In a pixel that counts as hidden, the surface is surely in front of every point that the volume
///   has there; so [`most_shown`](Self::most_shown) bounds the pixels that can show it.
/// - In a pixel that counts as open, the surface is surely behind every such point.
///
/// An instance that is outside of the view touches nothing.
/// One that crosses the plane of the eye, or has invalid bounds, counts as inside in all pixels of
/// the image, and none of them is decided.
///
/// # Examples
/// A box whose left half is behind a wall, which is in the depth image:
///
/// ```
/// use hiz_core::PixelCounts;
///
/// let counts = PixelCounts { touched: 64, hidden: 32, inside: 0, open: 32, undecided: 0 };
/// assert_eq!((counts.most_shown(), counts.is_decided()), (32, true));
/// assert_eq!(counts.fraction_of_others(), 0.5);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PixelCounts {
    /// Pixels that the volume may touch: the sum of the next three.
    pub touched: u32,
    /// Of these, pixels whose surface is surely in front of all of the volume there.
    pub hidden: u32,
    /// Pixels whose surface lies in the volume, or where float32 cannot tell.
    pub inside: u32,
    /// Pixels whose surface is surely behind all of the volume there.
    pub open: u32,
    /// Of those inside, pixels that were not looked at: the budget had ended, or nothing can be said
    /// about the instance.
    pub undecided: u32,
}

impl PixelCounts {
    /// The most pixels in which the instance can show.
    pub fn most_shown(&self) -> u32 {
        self.touched - self.hidden
    }

    /// Whether every pixel was decided.
    pub fn is_decided(&self) -> bool {
        self.undecided == 0
    }

    /// The visible fraction of an object that is in the depth image itself:
    /// `inside / (inside + hidden)`.
    ///
    /// 0 where both are 0: it touches nothing, or one looks through all of it.
    pub fn fraction_of_itself(&self) -> f64 {
        share(self.inside, self.inside + self.hidden)
    }

    /// The visible fraction of an object that is not in the depth image: `1 - hidden / touched`.
    ///
    /// 0 where it touches no pixel.
    pub fn fraction_of_others(&self) -> f64 {
        share(self.most_shown(), self.touched)
    }
}

fn share(part: u32, all: u32) -> f64 {
    if all == 0 { 0.0 } else { f64::from(part) / f64::from(all) }
}
