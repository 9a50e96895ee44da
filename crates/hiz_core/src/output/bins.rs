//! The buffers of bins: bit planes, lists and draw arguments by mesh and level of detail.

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::gpu::buffers::STORAGE;
use crate::gpu::device::Gpu;
use crate::instances::piece::Piece;
use crate::instances::{Instances, InstancesId};
use crate::output::draw::{DrawIndexedIndirect, DrawIndirect};
use crate::output::emit::{Emit, Placement};
use crate::output::lists::{CANARY_WORDS, filled_list};
use crate::output::mesh_table::{MeshTable, TemplateRecord};

/// Words of a set of planes that one workgroup of `emit_block` counts;
/// `shaders/output/emit_planes.wgsl`.
pub(crate) const BLOCK_WORDS: u32 = 1024;

/// How many bit planes lie side by side in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum PlaneSet {
    /// `shaders/output/planes_one.wgsl`.
    One,
    /// `shaders/output/planes_four.wgsl`.
    Four,
}

impl PlaneSet {
    /// For meshes of up to this many levels of detail.
    pub(crate) fn of_lods(lods: u32) -> Self {
        if lods == 1 { Self::One } else { Self::Four }
    }

    /// Planes of a set.
    pub(crate) fn planes(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Four => 4,
        }
    }

    /// The number of sets for so many levels of detail.
    pub(crate) fn sets(self, lods: u32) -> u32 {
        lods.div_ceil(self.planes())
    }

    /// Words of the counts of a set, which are below 2^16; `Packed` in the shaders.
    fn packed_words(self) -> u32 {
        self.planes().div_ceil(2)
    }

    /// Where a word of a plane stands, if planes have `words` words.
    pub(crate) fn word_at(self, words: usize, lod: usize, word: usize) -> usize {
        let planes = self.planes() as usize;
        (lod / planes * words + word) * planes + lod % planes
    }
}

/// Twin: `shaders/output/emit.wgsl`, `Emit`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct EmitUniform {
    pub(crate) base: u32,
    pub(crate) count: u32,
    pub(crate) words: u32,
    pub(crate) lods: u32,
    pub(crate) piece: u32,
    pub(crate) capacity: u32,
    pub(crate) records: u32,
    pub(crate) draws_begin: u32,
}

/// Twin: `shaders/output/emit.wgsl`, `Total`.
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct TotalRecord {
    pub(crate) demand: u32,
    pub(crate) written: u32,
}

/// Twin: `shaders/output/emit.wgsl`, `BinRange`.
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct BinRecord {
    pub(crate) begin: u32,
    pub(crate) count: u32,
    pub(crate) shift: u32,
    pub(crate) filled: u32,
}

/// How the kept instances are arranged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Arrangement {
    Packed,
    Reserved,
    /// A record for each instance, in the order of indices.
    Instances,
}

/// The buffers of one piece.
#[derive(Debug)]
pub(crate) struct PieceBins {
    /// `None` if no list was asked for.
    pub(crate) list: Option<wgpu::Buffer>,
    /// A plane per LOD, each with a bit per slot or per index, in sets ([`PlaneSet`]).
    pub(crate) planes: wgpu::Buffer,
    /// Scratch: how many bits are set before each word, and before each block of words.
    pub(crate) before: wgpu::Buffer,
    pub(crate) blocks: wgpu::Buffer,
    /// A [`BinRecord`] per mesh and LOD.
    pub(crate) bins: wgpu::Buffer,
    /// The first slot of each mesh, and the number of all.
    pub(crate) starts: Vec<u32>,
    pub(crate) starts_buffer: wgpu::Buffer,
    pub(crate) uniform: wgpu::Buffer,
    /// Words of a plane.
    pub(crate) words: u32,
    pub(crate) count: u32,
    /// What culls bind of the instances, and what each pass binds; made by the first of each.
    pub(crate) records_bindings: OnceLock<wgpu::BindGroup>,
    pub(crate) passes: [OnceLock<wgpu::BindGroup>; 4],
}

/// Lists and draw arguments of all bins of all pieces.
#[derive(Debug)]
pub(crate) struct Bins {
    pub(crate) meshes: MeshTable,
    pub(crate) arrangement: Arrangement,
    pub(crate) instances: InstancesId,
    pub(crate) pieces: Vec<PieceBins>,
    pub(crate) draws: wgpu::Buffer,
    /// The draws before a cull that counts in them; `None` if none can.
    pub(crate) template: Option<wgpu::Buffer>,
    pub(crate) draw_counts: wgpu::Buffer,
    /// A [`TotalRecord`] per piece.
    pub(crate) totals: wgpu::Buffer,
    /// The records of a piece that are drawn.
    pub(crate) records: u32,
    /// The records of a piece, with one that counts all instances of a cull in any order.
    pub(crate) stride: u32,
}

impl Bins {
    /// Makes room for `capacity` indices in all lists together.
    /// Without `listed`, only the draws are kept.
    pub(crate) fn new(
        gpu: &Gpu,
        instances: &Instances,
        emit: &Emit,
        listed: bool,
        capacity: u32,
    ) -> Result<Option<Self>> {
        let (meshes, arrangement) = match emit {
            Emit::List | Emit::Copy { .. } => return Ok(None),
            Emit::Binned { meshes, placement: Placement::Packed } => (meshes, Arrangement::Packed),
            Emit::Binned { meshes, placement: Placement::Reserved } => {
                (meshes, Arrangement::Reserved)
            }
            Emit::Instances { meshes } => (meshes, Arrangement::Instances),
        };
        gpu.check_context("meshes", meshes.context())?;
        check_features(gpu, arrangement)?;
        let used =
            |piece: &Piece| piece.slots.as_ref().map_or(1, |slots| slots.starts.len() as u32 - 1);
        let most_used = instances.pieces.iter().map(used).max().unwrap_or(0);
        if most_used > meshes.len() {
            return Err(Error::invalid(
                "mesh_ids",
                format!(
                    "expected ids below {}, the number of meshes, got {}",
                    meshes.len(),
                    most_used - 1
                ),
            ));
        }
        let bins = meshes.len() * meshes.most_lods();
        let largest = instances.pieces.iter().map(Piece::count).max().unwrap_or(0);
        let records = match arrangement {
            Arrangement::Instances => largest.min(capacity).max(1),
            Arrangement::Packed | Arrangement::Reserved => bins,
        };
        let can_append = arrangement == Arrangement::Reserved && meshes.len() == 1;
        let stride = records + u32::from(can_append);
        let record_words = (record_bytes(meshes) / 4) as u32;
        let bytes = instances.num_pieces() as u64 * u64::from(stride) * record_bytes(meshes);
        let pieces = (0..).zip(&instances.pieces).map(|(p, piece)| {
            let list_words = match arrangement {
                Arrangement::Reserved => u64::from(meshes.most_lods()) * u64::from(piece.count()),
                _ => piece.count().min(capacity).into(),
            };
            let uniform = EmitUniform {
                base: piece.range.start,
                count: piece.count(),
                words: piece.words(),
                lods: meshes.most_lods(),
                piece: p,
                capacity,
                records,
                draws_begin: p * stride * record_words,
            };
            PieceBins::new(gpu, piece, meshes, &uniform, listed.then_some(list_words))
        });
        let pieces = pieces.collect::<Result<_>>()?;
        let indirect = STORAGE | wgpu::BufferUsages::INDIRECT;
        let n = instances.num_pieces() as u64;
        Ok(Some(Self {
            pieces,
            draws: gpu.empty("hiz.bins.draws", bytes, indirect)?,
            template: can_append
                .then(|| template_of(gpu, meshes, instances.num_pieces(), stride))
                .transpose()?,
            draw_counts: gpu.empty("hiz.bins.draw_counts", 4 * n, indirect)?,
            totals: gpu.empty("hiz.bins.totals", n * size_of::<TotalRecord>() as u64, STORAGE)?,
            meshes: meshes.clone(),
            arrangement,
            instances: instances.id,
            records,
            stride,
        }))
    }

    /// How the planes lie in memory.
    pub(crate) fn plane_set(&self) -> PlaneSet {
        PlaneSet::of_lods(self.meshes.most_lods())
    }

    /// How many sets of planes there are.
    pub(crate) fn sets(&self) -> u32 {
        self.plane_set().sets(self.meshes.most_lods())
    }

    /// Bytes from one piece's draw records to the next.
    pub(crate) fn piece_bytes(&self) -> u64 {
        u64::from(self.stride) * record_bytes(&self.meshes)
    }

    /// Bytes of a draw record.
    pub(crate) fn record_bytes(&self) -> u64 {
        record_bytes(&self.meshes)
    }

    /// Whether a cull may count in the draw arguments, in any order.
    pub(crate) fn can_append(&self) -> bool {
        self.template.is_some()
    }

    /// Where the bin of a mesh and LOD begins in a piece's list, and how many words it has.
    /// `None` unless each bin has a place of its own.
    pub(crate) fn reserved(&self, piece: usize, mesh: u32, lod: u32) -> Option<(u32, u32)> {
        if self.arrangement != Arrangement::Reserved {
            return None;
        }
        let piece = &self.pieces[piece];
        let [begin, end] = [0, 1].map(|k| piece.starts[mesh as usize + k]);
        Some((lod * piece.count + begin, end - begin))
    }

    /// Records the reset of the draw arguments, so that nothing is drawn.
    ///
    /// A cull that makes bins of planes writes every record anyway, unless it is idle.
    pub(crate) fn record_clear(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        appends: bool,
        idle: bool,
    ) {
        match &self.template {
            Some(template) if appends => {
                encoder.copy_buffer_to_buffer(template, 0, &self.draws, 0, self.draws.size());
            }
            _ if idle || self.arrangement == Arrangement::Instances => {
                encoder.clear_buffer(&self.draws, 0, None);
            }
            _ => {}
        }
        if idle {
            encoder.clear_buffer(&self.draw_counts, 0, None);
        }
    }

    /// Records the clearing of the planes.
    pub(crate) fn record_clear_planes(&self, encoder: &mut wgpu::CommandEncoder) {
        for piece in &self.pieces {
            encoder.clear_buffer(&piece.planes, 0, None);
        }
    }

    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        let pieces = self.pieces.iter().map(|p| {
            let scratch = [&p.planes, &p.before, &p.blocks, &p.bins, &p.starts_buffer];
            let scratch: u64 = scratch.into_iter().map(wgpu::Buffer::size).sum();
            scratch + p.list.as_ref().map_or(0, wgpu::Buffer::size)
        });
        let template = self.template.as_ref().map_or(0, wgpu::Buffer::size);
        pieces.sum::<u64>()
            + self.draws.size()
            + template
            + self.draw_counts.size()
            + self.totals.size()
    }
}

impl PieceBins {
    fn new(
        gpu: &Gpu,
        piece: &Piece,
        meshes: &MeshTable,
        uniform: &EmitUniform,
        list_words: Option<u64>,
    ) -> Result<Self> {
        let set = PlaneSet::of_lods(uniform.lods);
        let sets = set.sets(uniform.lods);
        let words = u64::from(uniform.words.max(1) * sets);
        let blocks = u64::from((uniform.words.div_ceil(BLOCK_WORDS) + 1) * sets);
        let of_set = 4 * u64::from(set.planes());
        let bins = u64::from(meshes.len() * meshes.most_lods());
        // Meshes that no instance has, at the end of the table, begin where the last one ends.
        let mut starts = match &piece.slots {
            Some(slots) => slots.starts.clone(),
            None => vec![0, piece.count()],
        };
        let end = starts.last().copied().unwrap_or(0);
        starts.resize(meshes.len() as usize + 1, end);
        let list = list_words.map(|n| filled_list(gpu, n + CANARY_WORDS)).transpose()?;
        let bins_bytes = bins * size_of::<BinRecord>() as u64;
        Ok(Self {
            list,
            planes: gpu.empty("hiz.bins.planes", of_set * words, STORAGE)?,
            before: gpu.empty(
                "hiz.bins.before",
                4 * u64::from(set.packed_words()) * words,
                STORAGE,
            )?,
            blocks: gpu.empty("hiz.bins.blocks", of_set * blocks, STORAGE)?,
            bins: gpu.empty("hiz.bins.ranges", bins_bytes, STORAGE)?,
            starts_buffer: gpu.filled(
                "hiz.bins.starts",
                bytemuck::cast_slice(&starts),
                wgpu::BufferUsages::STORAGE,
            )?,
            starts,
            uniform: gpu.uniform("hiz.bins.uniform", uniform)?,
            words: uniform.words,
            count: uniform.count,
            records_bindings: OnceLock::new(),
            passes: Default::default(),
        })
    }
}

/// Bytes of a draw record of these meshes.
fn record_bytes(meshes: &MeshTable) -> u64 {
    let bytes = if meshes.is_indexed() {
        size_of::<DrawIndexedIndirect>()
    } else {
        size_of::<DrawIndirect>()
    };
    bytes as u64
}

fn check_features(gpu: &Gpu, arrangement: Arrangement) -> Result<()> {
    let feature = wgpu::Features::INDIRECT_FIRST_INSTANCE;
    if arrangement == Arrangement::Reserved || gpu.device().features().contains(feature) {
        return Ok(());
    }
    let (parameter, got, way_out) = match arrangement {
        Arrangement::Instances => ("emit", "Emit::Instances", ""),
        _ => ("placement", "Placement::Packed", ", or use Placement::Reserved"),
    };
    Err(Error::invalid(
        parameter,
        format!(
            "expected a device with the feature INDIRECT_FIRST_INSTANCE for {got}; ask for the \
             feature where the device is requested{way_out}"
        ),
    ))
}

/// The draws of one mesh for `pieces` pieces, each with a record that counts all instances.
fn template_of(gpu: &Gpu, meshes: &MeshTable, pieces: usize, stride: u32) -> Result<wgpu::Buffer> {
    let words = |t: &TemplateRecord| {
        if meshes.is_indexed() {
            vec![t.count, 0, t.first, t.base_vertex.cast_unsigned(), 0]
        } else {
            vec![t.count, 0, t.first, 0]
        }
    };
    let mut piece: Vec<u32> = meshes.template_records().iter().flat_map(words).collect();
    piece.resize(stride as usize * (record_bytes(meshes) / 4) as usize, 0);
    let all = piece.repeat(pieces);
    gpu.filled("hiz.bins.template", bytemuck::cast_slice(&all), wgpu::BufferUsages::COPY_SRC)
}
