//! What a loop over the instances expects of lists, draws and masks.

use hiz_core::testing::CANARY_WORDS;
use hiz_core::{CullOptions, Emit, Hierarchy, MeshTable, Outputs, Placement};

use crate::common::Random;
use crate::{Crowd, World};

/// Instances of a block of 1024 words; `shaders/output/emit_planes.wgsl`.
const BLOCK_INSTANCES: usize = 32 * 1024;

/// A list of 0xFFFFFFFF into which bins are written, and the bins.
struct Expected {
    list: Vec<u32>,
    draws: Vec<u32>,
    count: u32,
    written: usize,
}

/// The words of a draw record of `World::table`.
pub(crate) fn record(
    indexed: bool,
    (mesh, lod): (u32, u32),
    count: usize,
    first_instance: usize,
) -> Vec<u32> {
    let (total, first) = (100 * mesh + lod + 1, 7 * mesh + lod);
    let (count, first_instance) = (count as u32, first_instance as u32);
    if indexed {
        vec![total, count, first, (-(mesh as i32) - 1).cast_unsigned(), first_instance]
    } else {
        vec![total, count, first, first_instance]
    }
}

/// One piece of ten blocks of words: a row of a workgroup adds up eight.
pub(crate) fn large_crowd(world: &World, lods: &[usize]) -> Crowd {
    let made = Crowd::random(9 * BLOCK_INSTANCES + 77, lods, 0.3, 0.1, &mut Random(8));
    Crowd::new(world, made, None, true)
}

/// What `crowd` should leave of one piece, with room for `room` more indices.
fn expected(
    crowd: &Crowd,
    piece: &std::ops::Range<usize>,
    lods: &[usize],
    (emit, indexed): (&Emit, bool),
    (capacity, room): (usize, usize),
) -> Expected {
    let most = lods.iter().copied().max().unwrap();
    let words = if indexed { 5 } else { 4 };
    let size = match emit {
        Emit::Binned { placement: Placement::Reserved, .. } => most * piece.len(),
        _ => piece.len().min(capacity),
    };
    let mut list = vec![u32::MAX; size + CANARY_WORDS as usize];
    if let Emit::Instances { .. } = emit {
        let largest = crowd.pieces().iter().map(std::iter::ExactSizeIterator::len).max().unwrap();
        let kept = piece.clone().filter(|i| crowd.made[*i].is_kept());
        let kept: Vec<_> = kept.take(room).collect();
        let mut draws = Vec::new();
        for (k, i) in kept.iter().enumerate() {
            list[k] = *i as u32;
            draws.extend(record(indexed, (crowd.made[*i].mesh, crowd.made[*i].lod), 1, k));
        }
        draws.resize(largest.min(capacity).max(1) * words, 0);
        return Expected { list, draws, count: kept.len() as u32, written: kept.len() };
    }
    // Where each bin lies, and what of it is written: LOD 0 of all meshes first.
    let mut written = 0;
    let mut bins = std::collections::BTreeMap::new();
    for lod in 0..most as u32 {
        let mut slot = 0;
        for mesh in 0..lods.len() as u32 {
            let all = crowd.bin(piece, mesh, lod);
            let part = &all[..all.len().min(room - written)];
            let is_of_mesh = |i: &usize| crowd.made[*i].mesh == mesh;
            let members = piece.clone().filter(is_of_mesh).count();
            let begin = match emit {
                Emit::Binned { placement: Placement::Reserved, .. } => {
                    lod as usize * piece.len() + slot
                }
                _ => written,
            };
            list[begin..begin + part.len()].copy_from_slice(part);
            bins.insert((mesh, lod), (begin, part.len()));
            written += part.len();
            slot += members;
        }
    }
    let mut draws = Vec::new();
    let mut count = 0;
    for mesh in 0..lods.len() as u32 {
        for lod in 0..most as u32 {
            let (begin, len) = bins[&(mesh, lod)];
            match emit {
                Emit::Binned { placement: Placement::Reserved, .. } => {
                    let exists = (lod as usize) < lods[mesh as usize];
                    let record = record(indexed, (mesh, lod), len, 0);
                    draws.extend(if exists { record } else { vec![0; words] });
                }
                _ if len > 0 => {
                    draws.extend(record(indexed, (mesh, lod), len, begin));
                    count += 1;
                }
                _ => {}
            }
        }
    }
    draws.resize(lods.len() * most * words, 0);
    Expected { list, draws, count, written }
}

/// Culls `crowd`, and compares everything that the cull leaves with `expected`.
pub(crate) fn check(
    world: &World,
    crowd: &Crowd,
    lods: &[usize],
    emit: &Emit,
    capacity: Option<u32>,
    indexed: bool,
) -> Result<(), String> {
    let outputs = Outputs {
        mask: true,
        indices: true,
        draws: true,
        capacity,
        emit: emit.clone(),
        ..Outputs::NONE
    };
    let visible = world.engine.context().create_visible(&crowd.instances, &outputs).unwrap();
    let draws = visible.draw_arguments().unwrap();
    // The second cull finds what the first one left.
    for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
        let garbage = vec![0xFF_u8; draws.size() as usize];
        world.engine.queue().write_buffer(draws, 0, &garbage);
        let options = CullOptions { hierarchy, ..CullOptions::default() };
        world.cull(crowd, &visible, &options).unwrap();
        let limit = capacity.map_or(crowd.made.len(), |c| c as usize);
        let mut room = limit;
        let (all_draws, counts) =
            (world.words(draws), visible.draw_count().map(|b| world.words(b)));
        for (p, piece) in crowd.pieces().iter().enumerate() {
            let want = expected(crowd, piece, lods, (emit, indexed), (limit, room));
            room -= want.written;
            let what = format!(
                "{n} instances, {m} meshes, piece {p}, capacity {capacity:?}, {hierarchy:?}",
                n = crowd.made.len(),
                m = lods.len(),
            );
            let list = world.words(visible.list(p).unwrap());
            if list != want.list {
                let at = list.iter().zip(&want.list).position(|(a, b)| a != b);
                return Err(format!("{what}: the lists differ at {at:?}"));
            }
            let at = visible.draw_offset(p) as usize / 4;
            let got = &all_draws[at..at + want.draws.len()];
            if got != want.draws {
                let at = got.iter().zip(&want.draws).position(|(a, b)| a != b);
                return Err(format!("{what}: the draws differ at word {at:?}"));
            }
            assert_eq!(
                visible.max_draws() as usize * if indexed { 5 } else { 4 },
                want.draws.len()
            );
            if let Some(counts) = &counts {
                let at = visible.draw_count_offset(p) as usize / 4;
                if counts[at] != want.count {
                    return Err(format!("{what}: {} draws, not {}", counts[at], want.count));
                }
            }
            let mask = world.words(visible.mask(p).unwrap());
            for (k, i) in piece.clone().enumerate() {
                if (mask[k / 32] >> (k % 32) & 1 == 1) != crowd.made[i].is_kept() {
                    return Err(format!("{what}: the mask of {i}"));
                }
            }
        }
    }
    Ok(())
}

pub(crate) fn emits(meshes: &MeshTable) -> [Emit; 3] {
    let binned = |placement| Emit::Binned { meshes: meshes.clone(), placement };
    [
        binned(Placement::Packed),
        binned(Placement::Reserved),
        Emit::Instances { meshes: meshes.clone() },
    ]
}
