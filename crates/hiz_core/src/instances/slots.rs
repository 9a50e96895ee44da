//! Slots: a second order of the instances, by mesh and then by index.
//!
//! The rank of an instance in this order is its *slot*.
//! A bit plane in the order of slots has the instances of each mesh side by side.
//! So the passes in `output/emit_passes.rs` find the length of a mesh's list as a difference of two
//! counts.
//!
//! Each piece has slots of its own.
//! An absent instance has none.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::host::memory;
use crate::host::rounding::round_up;
use crate::input::bounds::Floats;
use crate::instances::batch::GROUP;
use crate::instances::order::PieceOrder;
use crate::instances::records::{Records, TEXEL_BYTES, Upload};
use crate::instances::volume_record::LARGEST;

/// The mesh id of an instance that is not there.
/// It is never kept, it is counted apart, and the box of its group does not contain it.
pub const ABSENT: u32 = u32::MAX;

/// Mesh ids are below this.
pub(crate) const MAX_MESHES: u32 = 1 << 16;

/// What the caller says of each instance besides its bounds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Kinds<'a> {
    mesh_ids: Option<&'a [u32]>,
    scales: Option<Floats<'a>>,
}

impl<'a> Kinds<'a> {
    /// # Errors
    /// - [`Error::Invalid`] for arrays of another length than `n`, and for scales that are not
    ///   finite and at least 0.
    /// - [`Error::Limit`] for mesh ids past [`MAX_MESHES`].
    pub(super) fn checked(
        n: usize,
        mesh_ids: Option<&'a [u32]>,
        scales: Option<Floats<'a>>,
    ) -> Result<Self> {
        let lengths =
            [("mesh_ids", mesh_ids.map(<[u32]>::len)), ("scales", scales.map(|s| s.len()))];
        for (name, length) in lengths {
            if let Some(length) = length.filter(|length| *length != n) {
                let message = format!("expected one per instance, which are {n}, got {length}");
                return Err(Error::invalid(name, message));
            }
        }
        let present = mesh_ids.unwrap_or_default().iter().filter(|id| **id != ABSENT);
        if let Some(id) = present.max().filter(|id| **id >= MAX_MESHES) {
            return Err(Error::limit("mesh_ids", u64::from(*id) + 1, MAX_MESHES.into()));
        }
        let wrong = scales.and_then(|scales| {
            let all = (0..scales.len()).map(|i| (i, scales.get(i)));
            all.into_iter().find(|(_, scale)| !(0.0..f64::from(LARGEST)).contains(scale))
        });
        if let Some((i, scale)) = wrong {
            let message =
                format!("expected numbers from 0 on below 2^60, got {scale} at index {i}");
            return Err(Error::invalid("scales", message));
        }
        Ok(Self { mesh_ids, scales })
    }

    fn mesh(&self, index: usize) -> u32 {
        self.mesh_ids.map_or(0, |ids| ids[index])
    }

    fn scale(&self, index: usize) -> f32 {
        self.scales.map_or(1.0, |scales| round_up(scales.get(index)))
    }

    /// A word per group of the piece `range`, with a bit for each absent member.
    /// No words at all if none is absent.
    pub(super) fn absent(&self, range: &Range<usize>, order: &PieceOrder) -> Result<Vec<u64>> {
        let ids = self.mesh_ids.map_or(&[][..], |ids| &ids[range.clone()]);
        if !ids.contains(&ABSENT) {
            return Ok(Vec::new());
        }
        let groups = range.len().div_ceil(GROUP);
        let word = |group: usize| {
            let places = group * GROUP..range.len().min((group + 1) * GROUP);
            let bit = |place: usize| u64::from(ids[order.index(place)] == ABSENT);
            places.fold(0, |word, place| word | bit(place) << (place % GROUP))
        };
        memory::collected((0..groups).map(word), "mesh_ids")
    }
}

/// The slots of one piece.
#[derive(Debug)]
pub(crate) struct Slots {
    /// Per place: mesh, slot and scale; `shaders/output/bin.wgsl`.
    pub(crate) of_places: Records,
    /// Per slot: the index, relative to the piece's first.
    pub(crate) index_of: wgpu::Buffer,
    /// Per index, relative to the piece's first: the mesh.
    pub(crate) mesh_of: wgpu::Buffer,
    /// Per mesh up to the greatest one that is used: its first slot.
    /// One more says how many slots there are.
    pub(crate) starts: Vec<u32>,
}

impl Slots {
    /// The slots of the piece `range`; `None` if the caller says nothing of its instances.
    pub(super) fn new(
        gpu: &Gpu,
        kinds: &Kinds<'_>,
        range: &Range<usize>,
        order: &PieceOrder,
    ) -> Result<Option<(Self, Upload)>> {
        if kinds.mesh_ids.is_none() && kinds.scales.is_none() {
            return Ok(None);
        }
        let count = range.len();
        let mesh = |index: usize| kinds.mesh(range.start + index);
        let present = || (0..count).filter(|index| mesh(*index) != ABSENT);
        // A counting sort, which is stable: the indices of a mesh ascend.
        let meshes = present().map(mesh).max().map_or(0, |greatest| greatest as usize + 1);
        let mut starts = memory::collected((0..meshes + 1).map(|_| 0_u32), "mesh_ids")?;
        present().for_each(|index| starts[mesh(index) as usize + 1] += 1);
        for m in 0..meshes {
            starts[m + 1] += starts[m];
        }
        let mut next = starts.clone();
        let mut slot_of = memory::collected((0..count).map(|_| 0_u32), "mesh_ids")?;
        let slots = starts[meshes] as usize;
        let mut index_of = memory::collected((0..slots).map(|_| 0_u32), "mesh_ids")?;
        for index in present() {
            let slot = &mut next[mesh(index) as usize];
            slot_of[index] = *slot;
            index_of[*slot as usize] = index as u32;
            *slot += 1;
        }
        let texel = |place: usize| {
            let index = order.index(place);
            let scale = kinds.scale(range.start + index);
            [mesh(index), slot_of[index], scale.to_bits(), 0]
        };
        let (of_places, upload, ()) =
            Records::sampled(gpu, "hiz.instances.slots", count as u32, TEXEL_BYTES, |records| {
                const AT_A_TIME: usize = 4096;
                let mut part = Vec::with_capacity(AT_A_TIME);
                for first in (0..count).step_by(AT_A_TIME) {
                    let places = first..count.min(first + AT_A_TIME);
                    let bytes = first as u64 * TEXEL_BYTES..places.end as u64 * TEXEL_BYTES;
                    part.clear();
                    part.extend(places.map(texel));
                    records.range(bytes)?.copy_from_slice(bytemuck::cast_slice(&part));
                }
                Ok(())
            })?;
        let storage = |label, words: &[u32]| {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
            let words = if words.is_empty() { &[0][..] } else { words };
            gpu.filled(label, bytemuck::cast_slice(words), usage)
        };
        let index_of = storage("hiz.instances.index_of_slot", &index_of)?;
        let meshes = memory::collected((0..count).map(mesh), "mesh_ids")?;
        let mesh_of = storage("hiz.instances.mesh_of_index", &meshes)?;
        Ok(Some((Self { of_places, index_of, mesh_of, starts }, upload)))
    }

    /// Bytes on the device.
    pub(super) fn size(&self) -> u64 {
        self.of_places.size() + self.index_of.size() + self.mesh_of.size()
    }
}
