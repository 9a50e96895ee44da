//! Culls of some of the instances: those of a mask, or those that an earlier cull has kept.
//!
//! A mask numbers the instances as the caller does.
//! A small pass brings its bits into stored order first, and culls read them there.
//! So whole groups without a member that is asked for are skipped, and so are single members.

use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::device::{ContextId, Gpu};
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::stage_pass;
use crate::input::bounds::BoundsKind;
use crate::instances::Instances;
use crate::instances::batch::GROUP;
use crate::instances::piece::{Piece, bind_records_among};
use crate::instances::records::TEXEL_BYTES;
use crate::output::visible::Visible;

/// Invocations of a workgroup; `shaders/cull/among_order.wgsl`.
pub(crate) const WORKGROUP: u32 = 64;

/// Words in a row of the texture; `shaders/cull/among_layout.wgsl`.
pub(crate) const WORDS_PER_ROW: u32 = 4096;

const LAYOUT: &str = "hiz.among.layout";

const BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Uniform),
    (1, Binding::ReadQuads),
    (2, Binding::Read),
    (3, Binding::WriteTexels),
];

/// The shader that brings a mask into stored order.
pub(crate) fn among_order_module() -> Source {
    Source::of(&[&[
        wgsl!("instances/piece"),
        wgsl!("instances/record_layout"),
        wgsl!("cull/among_layout"),
        wgsl!("cull/among_order"),
    ]])
}

fn pipeline(gpu: &Gpu, kind: BoundsKind) -> Result<wgpu::ComputePipeline> {
    let texels = (kind.record_bytes() / TEXEL_BYTES) as u32;
    // The bounds' shader files say which texel holds the caller's index.
    let of_index = match kind {
        BoundsKind::Point | BoundsKind::WidePoint => 0,
        BoundsKind::Sphere | BoundsKind::Box => 1,
        BoundsKind::OrientedBox => texels - 1,
    };
    gpu.compute_pipeline(&Compute {
        label: "hiz.among.pipeline",
        source: among_order_module(),
        entry_point: "among_order",
        layouts: &[gpu.layout(LAYOUT, BINDINGS)?],
        constants: &[("TEXELS", f64::from(texels)), ("INDEX_TEXEL", f64::from(of_index))],
    })
}

/// The instances that a cull is restricted to.
/// [`HizContext::create_among`](crate::HizContext::create_among) makes it, empty at first, and
/// [`HizContext::record_among`](crate::HizContext::record_among) fills it.
///
/// An instance that is not among them is not kept, and its verdict is
/// [`Outside`](crate::Verdict::Outside).
/// That holds for invalid bounds, too.
#[derive(Debug)]
pub struct Among {
    context: ContextId,
    pieces: Vec<AmongPiece>,
    counts: Vec<u32>,
}

#[derive(Debug)]
struct AmongPiece {
    bits: wgpu::TextureView,
    /// What culls of instances bind, and culls of groups.
    records: wgpu::BindGroup,
    group_records: wgpu::BindGroup,
}

/// Which instances: see [`HizContext::record_among`](crate::HizContext::record_among).
#[derive(Debug, Clone, Copy)]
pub enum AmongMask<'a> {
    /// A bit per instance in the caller's numbering, lowest first: `len().div_ceil(32)` words.
    Bits(&'a [u32]),
    /// What an earlier cull of the same instances has kept; it must have been asked for a mask.
    Kept(&'a Visible),
}

impl Among {
    pub(crate) fn new(gpu: &Gpu, instances: &Instances) -> Result<Self> {
        gpu.check_context("instances", instances.context)?;
        let pieces = instances.pieces.iter().map(|piece| {
            let words = piece.groups().max(1) * (GROUP as u32 / u32::BITS);
            let size = (words.min(WORDS_PER_ROW), words.div_ceil(WORDS_PER_ROW));
            let usage = wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::COPY_SRC;
            let format = wgpu::TextureFormat::R32Uint;
            let bits = gpu.view(&gpu.texture("hiz.among.bits", size, format, usage)?)?;
            let Piece { uniform, group_uniform, records, group_records, .. } = piece;
            Ok(AmongPiece {
                records: bind_records_among(gpu, uniform, records, &bits)?,
                group_records: bind_records_among(gpu, group_uniform, group_records, &bits)?,
                bits,
            })
        });
        Ok(Self {
            context: gpu.id(),
            pieces: pieces.collect::<Result<_>>()?,
            counts: instances.pieces.iter().map(Piece::count).collect(),
        })
    }

    /// Checks that it was made for these instances, or for others that lie in the same pieces.
    pub(crate) fn check(&self, gpu: &Gpu, instances: &Instances) -> Result<()> {
        gpu.check_context("among", self.context)?;
        same_counts("among", &self.counts, instances)
    }

    /// The texture with the bits of piece `p`: a word per 32 places, in rows of
    /// [`WORDS_PER_ROW`].
    #[cfg(feature = "headless")]
    pub(crate) fn bits(&self, p: usize) -> &wgpu::Texture {
        self.pieces[p].bits.texture()
    }

    /// The bits of piece `p`.
    pub(super) fn view(&self, p: usize) -> &wgpu::TextureView {
        &self.pieces[p].bits
    }

    /// What a cull of the instances of piece `p` binds.
    pub(super) fn records(&self, p: usize) -> &wgpu::BindGroup {
        &self.pieces[p].records
    }

    /// What a cull of the groups of piece `p` binds.
    pub(super) fn group_records(&self, p: usize) -> &wgpu::BindGroup {
        &self.pieces[p].group_records
    }
}

fn same_counts(parameter: &str, counts: &[u32], instances: &Instances) -> Result<()> {
    if counts.iter().copied().eq(instances.pieces.iter().map(Piece::count)) {
        return Ok(());
    }
    Err(Error::mismatch(
        parameter,
        format!(
            "expected one of these {} instances, got one of {}",
            instances.len(),
            counts.iter().map(|n| u64::from(*n)).sum::<u64>()
        ),
    ))
}

/// The buffers of a mask, one per piece.
fn masks(gpu: &Gpu, instances: &Instances, mask: &AmongMask<'_>) -> Result<Vec<wgpu::Buffer>> {
    match mask {
        AmongMask::Bits(bits) => {
            let expected = instances.len().div_ceil(32) as usize;
            if bits.len() != expected {
                return Err(Error::invalid(
                    "mask",
                    format!(
                        "expected {expected} words for {} instances, got {}",
                        instances.len(),
                        bits.len()
                    ),
                ));
            }
            let of_piece = |piece: &Piece| {
                // Pieces begin at multiples of a word.
                let begin = piece.range.start as usize / 32;
                let words = &bits[begin..begin + piece.words() as usize];
                let words = if words.is_empty() { &[0] } else { words };
                let usage = wgpu::BufferUsages::STORAGE;
                gpu.filled("hiz.among.mask", bytemuck::cast_slice(words), usage)
            };
            instances.pieces.iter().map(of_piece).collect()
        }
        AmongMask::Kept(visible) => {
            gpu.check_context("mask", visible.context)?;
            same_counts("mask", visible.counts(), instances)?;
            let of_piece = |p| {
                visible.mask(p).cloned().ok_or_else(|| {
                    Error::mismatch(
                        "mask",
                        format!(
                            "expected a cull that was asked for mask, got {}",
                            visible.outputs()
                        ),
                    )
                })
            };
            (0..visible.num_pieces()).map(of_piece).collect()
        }
    }
}

/// Records the pass that fills `among` with a mask.
pub(crate) fn record_among(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    instances: &Instances,
    mask: &AmongMask<'_>,
    among: &Among,
) -> Result<()> {
    gpu.check_context("instances", instances.context)?;
    among.check(gpu, instances)?;
    let pipeline = pipeline(gpu, instances.kind)?;
    let bindings = instances
        .pieces
        .iter()
        .zip(masks(gpu, instances, mask)?)
        .zip(&among.pieces)
        .map(|((piece, mask), target)| {
            gpu.bind_group(
                "hiz.among.piece",
                &gpu.layout(LAYOUT, BINDINGS)?,
                &[
                    entry(0, piece.uniform.as_entire_binding()),
                    entry(1, wgpu::BindingResource::TextureView(&piece.records.view)),
                    entry(2, mask.as_entire_binding()),
                    entry(3, wgpu::BindingResource::TextureView(&target.bits)),
                ],
            )
        })
        .collect::<Result<Vec<_>>>()?;
    gpu.recorded(|| {
        let mut pass = stage_pass(encoder, "hiz.among.pass", "among");
        pass.set_pipeline(&pipeline);
        for (piece, bindings) in instances.pieces.iter().zip(&bindings) {
            let words = piece.groups().max(1) * (GROUP as u32 / u32::BITS);
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(words.div_ceil(WORKGROUP), 1, 1);
        }
        Ok(())
    })
}
