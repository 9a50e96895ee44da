//! From the caller's bounds of any kind to the bytes of their records.

use crate::input::bounds::{Bounds, BoundsKind};
use crate::instances::point::{PointRecord, WidePointRecord};
use crate::instances::volume_record::{BoxRecord, OrientedBoxRecord, Record, SphereRecord};

impl BoundsKind {
    /// Bytes of one record on the device.
    ///
    /// They are 32 for a sphere, 48 for a box, 64 for an oriented box.
    /// A point takes 16, and 32 if its position needs two float32.
    pub fn record_bytes(self) -> u64 {
        (match self {
            Self::Sphere => size_of::<SphereRecord>(),
            Self::Box => size_of::<BoxRecord>(),
            Self::OrientedBox => size_of::<OrientedBoxRecord>(),
            Self::Point => size_of::<PointRecord>(),
            Self::WidePoint => size_of::<WidePointRecord>(),
        }) as u64
    }
}

impl Bounds<'_> {
    /// Writes the record of instance `i` with the caller's `index`.
    /// The length of `out` is that of a record, and says how wide a point's is.
    /// Returns false for invalid bounds.
    pub(crate) fn write_record(&self, i: usize, index: u32, out: &mut [u8]) -> bool {
        match *self {
            Self::Spheres { centers, radii } => {
                write(out, index, SphereRecord::new(centers.array(i), radii.get(i)))
            }
            Self::Boxes { min, max } => {
                write(out, index, BoxRecord::new(min.array(i), max.array(i)))
            }
            Self::OrientedBoxes { centers, half_sizes, rotations } => write(
                out,
                index,
                OrientedBoxRecord::new(centers.array(i), half_sizes.array(i), rotations.array(i)),
            ),
            Self::Points { positions } if out.len() == size_of::<PointRecord>() => {
                write(out, index, PointRecord::new(positions.array(i)))
            }
            Self::Points { positions } => {
                write(out, index, WidePointRecord::new(positions.array(i)))
            }
        }
    }
}

/// Writes the record of an absent instance of a kind into `out`, with the caller's `index`.
pub(super) fn write_absent(kind: BoundsKind, index: u32, out: &mut [u8]) {
    fn write<R: Record>(out: &mut [u8], index: u32) {
        out.copy_from_slice(bytemuck::bytes_of(&R::ABSENT.numbered(index)));
    }
    match kind {
        BoundsKind::Sphere => write::<SphereRecord>(out, index),
        BoundsKind::Box => write::<BoxRecord>(out, index),
        BoundsKind::OrientedBox => write::<OrientedBoxRecord>(out, index),
        BoundsKind::Point => write::<PointRecord>(out, index),
        BoundsKind::WidePoint => write::<WidePointRecord>(out, index),
    }
}

fn write<R: Record>(out: &mut [u8], index: u32, record: R) -> bool {
    let is_valid = record.is_valid();
    let record = if is_valid { record } else { R::INVALID };
    out.copy_from_slice(bytemuck::bytes_of(&record.numbered(index)));
    is_valid
}
