//! The mesh table: the levels of detail (LODs) of each mesh, with their draws and errors.

use std::hash::{Hash, Hasher};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};
use crate::gpu::device::{ContextId, Gpu};
use crate::host::rounding::round_up;
use crate::instances::records::{Records, TEXEL_BYTES, Upload};
use crate::instances::slots::MAX_MESHES;
use crate::instances::volume_record::LARGEST;
use crate::output::draw::{DrawTemplate, VertexDraw};

/// The most levels of detail of one mesh.
pub const MAX_LODS: usize = 8;

/// Texels of a mesh: the number of its LODs, then their errors, four in a texel;
/// `shaders/output/mesh_table.wgsl`.
pub(crate) const MESH_TEXELS: usize = 1 + MAX_LODS / 4;

/// The draw of a level of detail, without its numbers of instances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LodDraw {
    /// With an index buffer: a [`DrawIndexedIndirect`](crate::DrawIndexedIndirect).
    Indexed(DrawTemplate),
    /// Without one: a [`DrawIndirect`](crate::DrawIndirect).
    Vertices(VertexDraw),
}

impl From<DrawTemplate> for LodDraw {
    fn from(draw: DrawTemplate) -> Self {
        Self::Indexed(draw)
    }
}

impl From<VertexDraw> for LodDraw {
    fn from(draw: VertexDraw) -> Self {
        Self::Vertices(draw)
    }
}

/// A level of detail of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lod {
    /// How it is drawn.
    pub draw: LodDraw,
    /// How far its surface is from that of the full mesh at scale 1, at most, in world units.
    pub error: f64,
}

impl Lod {
    /// A level of detail with this draw and this error.
    pub fn new(draw: impl Into<LodDraw>, error: f64) -> Self {
        Self { draw: draw.into(), error }
    }
}

/// The levels of detail of one mesh, from the finest to the coarsest.
#[derive(Debug, Clone, Copy)]
pub struct MeshLods<'a> {
    lods: &'a [Lod],
}

impl<'a> MeshLods<'a> {
    /// A mesh with 1 to [`MAX_LODS`] levels of detail; the first is the full mesh.
    pub fn new(lods: &'a [Lod]) -> Self {
        Self { lods }
    }
}

/// Meshes with their levels of detail, on the device.
///
/// Cheap to clone.
/// Two tables are equal if one is a clone of the other.
///
/// # Examples
/// ```
/// use hiz_core::{DrawTemplate, Lod, MeshLods};
/// # let engine = hiz_core::headless::Engine::new(None)?;
/// # let hiz = engine.context();
///
/// // Both levels of the tree lie in one index buffer, one after the other.
/// let fine = DrawTemplate { index_count: 3600, ..DrawTemplate::default() };
/// let coarse = DrawTemplate { index_count: 300, first_index: 3600, ..DrawTemplate::default() };
/// let tree = [Lod::new(fine, 0.0), Lod::new(coarse, 0.02)];
/// let rock = [Lod::new(DrawTemplate { index_count: 60, ..fine }, 0.0)];
/// let meshes = hiz.create_mesh_table(&[MeshLods::new(&tree), MeshLods::new(&rock)])?;
/// assert_eq!((meshes.len(), meshes.lods(0), meshes.lods(1)), (2, 2, 1));
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct MeshTable(Arc<Table>);

#[derive(Debug)]
struct Table {
    context: ContextId,
    /// Per mesh: how many LODs it has.
    counts: Vec<u8>,
    lods: u32,
    is_indexed: bool,
    /// Per mesh and LOD: a [`TemplateRecord`]; that of a LOD which a mesh lacks is never used.
    templates: wgpu::Buffer,
    template_records: Vec<TemplateRecord>,
    texture: Records,
    upload: Upload,
    /// Whether the copies into the texture have run.
    is_there: Arc<AtomicBool>,
}

/// Twin: `shaders/output/emit.wgsl`, `Template`.
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct TemplateRecord {
    pub(crate) count: u32,
    pub(crate) first: u32,
    pub(crate) base_vertex: i32,
    pub(crate) padding: u32,
}

impl PartialEq for MeshTable {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Eq for MeshTable {}

impl Hash for MeshTable {
    fn hash<H: Hasher>(&self, state: &mut H) {
        Arc::as_ptr(&self.0).hash(state);
    }
}

impl MeshTable {
    pub(crate) fn new(gpu: &Gpu, meshes: &[MeshLods<'_>]) -> Result<Self> {
        check(meshes)?;
        let counts: Vec<u8> = meshes.iter().map(|mesh| mesh.lods.len() as u8).collect();
        let lods = counts.iter().copied().max().unwrap_or(1);
        let template = |lod: Option<&Lod>| match lod.map(|lod| lod.draw) {
            None => TemplateRecord::default(),
            Some(LodDraw::Indexed(draw)) => TemplateRecord {
                count: draw.index_count,
                first: draw.first_index,
                base_vertex: draw.base_vertex,
                padding: 0,
            },
            Some(LodDraw::Vertices(draw)) => TemplateRecord {
                count: draw.vertex_count,
                first: draw.first_vertex,
                ..TemplateRecord::default()
            },
        };
        let templates: Vec<_> = meshes
            .iter()
            .flat_map(|mesh| (0..usize::from(lods)).map(|l| template(mesh.lods.get(l))))
            .collect();
        let texels: Vec<u32> = meshes.iter().flat_map(texels_of).collect();
        let label = "hiz.mesh_table";
        let record_bytes = MESH_TEXELS as u64 * TEXEL_BYTES;
        let (texture, upload, ()) =
            Records::sampled(gpu, label, meshes.len() as u32, record_bytes, |records| {
                let bytes = bytemuck::cast_slice(&texels);
                records.range(0..bytes.len() as u64)?.copy_from_slice(bytes);
                Ok(())
            })?;
        Ok(Self(Arc::new(Table {
            context: gpu.id(),
            counts,
            lods: lods.into(),
            is_indexed: matches!(meshes[0].lods[0].draw, LodDraw::Indexed(_)),
            templates: gpu.filled(
                "hiz.mesh_table.templates",
                bytemuck::cast_slice(&templates),
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            )?,
            template_records: templates,
            texture,
            upload,
            is_there: Arc::default(),
        })))
    }

    /// The number of meshes.
    pub fn len(&self) -> u32 {
        self.0.counts.len() as u32
    }

    /// Whether there are no meshes; never so.
    pub fn is_empty(&self) -> bool {
        self.0.counts.is_empty()
    }

    /// How many levels of detail a mesh has.
    ///
    /// # Panics
    /// If `mesh` is not below [`MeshTable::len`].
    pub fn lods(&self, mesh: u32) -> u32 {
        self.0.counts[mesh as usize].into()
    }

    /// The most levels of detail that a mesh has.
    pub fn most_lods(&self) -> u32 {
        self.0.lods
    }

    /// Whether the draws have an index buffer.
    pub fn is_indexed(&self) -> bool {
        self.0.is_indexed
    }

    pub(crate) fn context(&self) -> ContextId {
        self.0.context
    }

    pub(crate) fn templates(&self) -> &wgpu::Buffer {
        &self.0.templates
    }

    /// The records of [`MeshTable::templates`].
    pub(crate) fn template_records(&self) -> &[TemplateRecord] {
        &self.0.template_records
    }

    pub(crate) fn view(&self) -> &wgpu::TextureView {
        &self.0.texture.view
    }

    /// Records the copies into the texture, unless they are known to have run.
    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        if self.0.is_there.load(Ordering::Acquire) {
            return;
        }
        self.0.upload.record(encoder);
        let is_there = Arc::clone(&self.0.is_there);
        encoder.on_submitted_work_done(move || is_there.store(true, Ordering::Release));
    }
}

/// The texels of a mesh.
fn texels_of(mesh: &MeshLods<'_>) -> [u32; 4 * MESH_TEXELS] {
    let mut words = [0; 4 * MESH_TEXELS];
    words[0] = mesh.lods.len() as u32;
    for (word, lod) in words[4..].iter_mut().zip(mesh.lods) {
        *word = round_up(lod.error).to_bits();
    }
    words
}

fn check(meshes: &[MeshLods<'_>]) -> Result<()> {
    if meshes.is_empty() {
        return Err(Error::invalid("meshes", "expected at least one mesh, got none"));
    }
    if meshes.len() > MAX_MESHES as usize {
        return Err(Error::limit("meshes", meshes.len() as u64, MAX_MESHES.into()));
    }
    let first = meshes[0].lods.first().map(|lod| std::mem::discriminant(&lod.draw));
    for (m, mesh) in meshes.iter().enumerate() {
        if mesh.lods.is_empty() {
            let message = format!("expected 1 to {MAX_LODS} levels of detail, mesh {m} has none");
            return Err(Error::invalid("meshes", message));
        }
        if mesh.lods.len() > MAX_LODS {
            let name = format!("levels of detail of mesh {m}");
            return Err(Error::limit(&name, mesh.lods.len() as u64, MAX_LODS as u64));
        }
        for (l, lod) in mesh.lods.iter().enumerate() {
            if !(0.0..f64::from(LARGEST)).contains(&lod.error) {
                let message = format!(
                    "expected errors from 0 on below 2^60, got {} for LOD {l} of mesh {m}",
                    lod.error
                );
                return Err(Error::invalid("error", message));
            }
            if first != Some(std::mem::discriminant(&lod.draw)) {
                let message = format!(
                    "expected draws of one kind, indexed or not, LOD {l} of mesh {m} has another"
                );
                return Err(Error::invalid("draw", message));
            }
            if let LodDraw::Indexed(DrawTemplate { first_instance: 1.., .. }) = lod.draw {
                let message =
                    format!("expected 0, which the cull replaces, LOD {l} of mesh {m} has another");
                return Err(Error::invalid("first_instance", message));
            }
        }
    }
    Ok(())
}
