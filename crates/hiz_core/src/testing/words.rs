//! The words that the cull shader reads, so that its arithmetic can be done again on the host.

use crate::cull::options::CullOptions;
use crate::cull::view_uniform::ViewUniform;
use crate::error::Result;
use crate::headless::Engine;
use crate::headless::readback;
use crate::input::bounds::{Bounds, BoundsKind};
use crate::input::camera::Camera;
use crate::input::tolerance::DepthTolerance;
use crate::instances::Instances;
use crate::instances::batch::GROUP;
use crate::instances::groups::Groups;
use crate::instances::piece::Piece;
use crate::instances::records::TEXEL_BYTES;

/// The view's uniform (`shaders/cull/view.wgsl`, `View`) as 32-bit words.
/// The number of the reduction is 0, and the default guard is not that of points.
///
/// # Errors
/// As `HizContext::record_cull`, for options and cameras that it refuses.
pub fn view(camera: &Camera, options: &CullOptions) -> Result<Vec<u32>> {
    let kind = BoundsKind::Box;
    let view = ViewUniform::new(camera, kind, 0, options, DepthTolerance::NONE)?;
    Ok(bytemuck::cast_slice(&[view]).to_vec())
}

/// The records of all instances (`shaders/instances/bounds_*.wgsl`) as 32-bit words.
///
/// # Errors
/// As [`Bounds::len`].
pub fn instances(bounds: &Bounds<'_>) -> Result<Vec<u32>> {
    let record_bytes = bounds.kind().record_bytes() as usize;
    let mut bytes = vec![0; bounds.len()? * record_bytes];
    for (i, record) in bytes.chunks_exact_mut(record_bytes).enumerate() {
        bounds.write_record(i, i as u32, record);
    }
    Ok(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}

/// The records of one piece as they lie on the device, as 32-bit words.
#[derive(Debug, Clone, PartialEq)]
pub struct PieceWords {
    /// The caller's index of the instance at each place.
    pub indices: Vec<u32>,
    /// The records of the instances, in stored order.
    pub records: Vec<u32>,
    /// What lies behind them in the last row.
    pub padding: Vec<u32>,
    /// The records of the groups' boxes.
    pub groups: Vec<u32>,
    /// The records of the boxes of each tier above.
    pub tiers: Vec<Vec<u32>>,
}

/// The records of all pieces, after everything that was submitted.
///
/// # Errors
/// [`Error::DeviceLost`](crate::Error::DeviceLost).
pub fn pieces(engine: &Engine, instances: &Instances) -> Result<Vec<PieceWords>> {
    let all_words = |texture: &wgpu::Texture| -> Result<Vec<u32>> {
        let row = u64::from(texture.width()) * TEXEL_BYTES;
        let bytes = readback::read_texture(engine.device(), engine.queue(), texture, row)?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    };
    let words = |texture: &wgpu::Texture, count: usize| -> Result<Vec<u32>> {
        all_words(texture).map(|words| words[..count].to_vec())
    };
    let of_piece = |p: &Piece| {
        let count = p.count() as usize;
        let record_words = |kind: BoundsKind| kind.record_bytes() as usize / 4;
        let mut records = all_words(p.records.texture())?;
        let padding = records.split_off(count * record_words(instances.kind));
        Ok(PieceWords {
            indices: (0..count).map(|i| p.range.start + p.order.index(i) as u32).collect(),
            records,
            padding,
            groups: words(
                p.group_records.texture(),
                p.groups() as usize * record_words(BoundsKind::Box),
            )?,
            tiers: p
                .upper
                .iter()
                .map(|tier| {
                    let count = tier.count as usize * record_words(BoundsKind::Box);
                    words(tier.records.texture(), count)
                })
                .collect::<Result<_>>()?,
        })
    };
    instances.pieces.iter().map(of_piece).collect()
}

/// What is known of a group of 64 instances that are stored one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupWords {
    /// The caller's indices of its members.
    pub members: Vec<u32>,
    /// The least and the greatest corner of the box that the host keeps; none if a member is no
    /// volume.
    pub corners: Option<[[f64; 3]; 2]>,
    /// The box's record on the device.
    pub record: Vec<u32>,
}

/// All groups, in stored order; after all updates that were submitted.
///
/// # Errors
/// [`Error::DeviceLost`](crate::Error::DeviceLost).
pub fn groups(engine: &Engine, instances: &Instances) -> Result<Vec<GroupWords>> {
    let read = |p: &Piece| {
        let texture = p.group_records.texture();
        readback::read_texture(
            engine.device(),
            engine.queue(),
            texture,
            u64::from(texture.width()) * TEXEL_BYTES,
        )
    };
    let bytes = instances.pieces.iter().map(read).collect::<Result<Vec<_>>>()?;
    let changing = instances.changing();
    let pieces = instances.pieces.iter().zip(&changing.groups).zip(bytes);
    let of_piece = |((piece, groups), bytes): ((&Piece, &Groups), Vec<u8>)| -> Vec<GroupWords> {
        let record_words = BoundsKind::Box.record_bytes() as usize / 4;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
        let groups =
            (0..groups.len()).zip(words.chunks_exact(record_words)).map(|(g, record)| GroupWords {
                members: (g * GROUP..(piece.count() as usize).min((g + 1) * GROUP))
                    .map(|place| piece.range.start + piece.order.index(place) as u32)
                    .collect(),
                corners: groups.aabb(g).map(|e| [e.min, e.max]),
                record: record.to_vec(),
            });
        groups.collect()
    };
    Ok(pieces.flat_map(of_piece).collect())
}
