//! Records of points: 16 bytes where float32 holds every position, and 32 where two float32 do.
//!
//! Nothing is rounded into a point, because it has no size that could take it.
//! What two float32 cannot hold of a float64 is covered by the margin (`docs/accuracy.md`).

use crate::instances::volume_record::{ABSENT_CENTER, BEYOND_LIMITS, Position, Record, all_small};

/// A point whose position float32 holds.
///
/// Twin: `shaders/instances/bounds_point.wgsl`, `load_volume`, which reads one texel.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PointRecord {
    position: [f32; 3],
    index: u32,
}

/// A point whose position takes two float32 per axis.
///
/// Twin: `shaders/instances/bounds_wide_point.wgsl`, `load_volume`, which reads two texels.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct WidePointRecord {
    position_hi: [f32; 3],
    index: u32,
    position_lo: [f32; 3],
    padding: f32,
}

const _: () = assert!(size_of::<PointRecord>() == 16 && size_of::<WidePointRecord>() == 32);

/// The position of invalid bounds, beyond every camera's coordinate limit.
/// Absent instances lie on the other side.
const INVALID: [f32; 3] = [BEYOND_LIMITS, 0.0, 0.0];
const ABSENT: [f32; 3] = [ABSENT_CENTER, 0.0, 0.0];

impl PointRecord {
    pub(super) fn of_parts(position: [f32; 3], index: u32) -> Self {
        Self { position, index }
    }

    /// The record of a position of which no coordinate needs two halves.
    pub(super) fn new(position: [f64; 3]) -> Self {
        Self::of_parts(Position::new(position).hi, 0)
    }
}

impl WidePointRecord {
    pub(super) fn of_parts(position_hi: [f32; 3], position_lo: [f32; 3], index: u32) -> Self {
        Self { position_hi, index, position_lo, padding: 0.0 }
    }

    pub(super) fn new(position: [f64; 3]) -> Self {
        let p = Position::new(position);
        Self::of_parts(p.hi, p.lo, 0)
    }
}

impl Record for PointRecord {
    const ABSENT: Self = Self { position: ABSENT, index: 0 };
    const INVALID: Self = Self { position: INVALID, index: 0 };

    fn numbered(self, index: u32) -> Self {
        Self { index, ..self }
    }

    fn is_valid(&self) -> bool {
        all_small(self.position)
    }
}

impl Record for WidePointRecord {
    const ABSENT: Self = Self { position_hi: ABSENT, ..Self::INVALID };
    const INVALID: Self =
        Self { position_hi: INVALID, index: 0, position_lo: [0.0; 3], padding: 0.0 };

    fn numbered(self, index: u32) -> Self {
        Self { index, ..self }
    }

    fn is_valid(&self) -> bool {
        all_small(self.position_hi) && all_small(self.position_lo)
    }
}

#[cfg(test)]
mod tests {
    use crate::input::bounds::{Bounds, BoundsKind, Floats};

    fn kind(numbers: &[f64]) -> BoundsKind {
        Bounds::Points { positions: Floats::F64(numbers) }.kind()
    }

    #[test]
    fn points_are_as_wide_as_their_positions_need() {
        assert_eq!(kind(&[]), BoundsKind::Point);
        assert_eq!(kind(&[0.5, -3.0, 16_777_216.0]), BoundsKind::Point);
        assert_eq!(kind(&[0.5, -3.0, 16_777_217.0]), BoundsKind::WidePoint);
        assert_eq!(kind(&[0.1, 0.0, 0.0]), BoundsKind::WidePoint);
        assert_eq!(kind(&[f64::from(0.1_f32), 0.0, 0.0]), BoundsKind::Point);
        // Less than float32's least normal number, which a device may flush.
        assert_eq!(kind(&[1e-40, 1e-300, -0.0]), BoundsKind::Point);
        // What is invalid anyway takes no room.
        assert_eq!(kind(&[f64::NAN, f64::INFINITY, 1e300]), BoundsKind::Point);
        let positions = Floats::F32(&[0.1, 0.2, 0.3]);
        assert_eq!(Bounds::Points { positions }.kind(), BoundsKind::Point);
        assert_eq!(
            (BoundsKind::Point.record_bytes(), BoundsKind::WidePoint.record_bytes()),
            (16, 32)
        );
    }

    /// Both halves together are the position, to within 2^-48 of it; a narrow one is exact.
    #[test]
    fn records_hold_their_positions() {
        let numbers = [0.1, 1.0e7 + 1.0 / 3.0, -1.0 / 7.0];
        let bounds = Bounds::Points { positions: Floats::F64(&numbers) };
        let mut wide = [0_u8; 32];
        assert!(bounds.write_record(0, 7, &mut wide));
        let words: [f32; 8] = bytemuck::pod_read_unaligned(&wide);
        assert_eq!(words[3].to_bits(), 7);
        for (k, number) in numbers.iter().enumerate() {
            let held = f64::from(words[k]) + f64::from(words[4 + k]);
            assert!((held - number).abs() <= number.abs() * 2.0_f64.powi(-48), "{k}");
        }
        let bounds = Bounds::Points { positions: Floats::F32(&[0.1, -2.0, 3e30]) };
        let mut narrow = [0_u8; 16];
        assert!(!bounds.write_record(0, 9, &mut narrow), "2^60 is beyond");
        let bounds = Bounds::Points { positions: Floats::F32(&[0.1, -2.0, 3e10]) };
        assert!(bounds.write_record(0, 9, &mut narrow));
        let words: [f32; 4] = bytemuck::pod_read_unaligned(&narrow);
        assert_eq!((words[..3].to_vec(), words[3].to_bits()), (vec![0.1, -2.0, 3e10], 9));
    }
}
