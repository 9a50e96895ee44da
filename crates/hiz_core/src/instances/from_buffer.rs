//! Bounds from a buffer: a shader of the caller's writes them, and they never visit the host.
//!
//! One dispatch per piece validates all bounds, writes their records, and makes the boxes of their
//! groups anew.
//! Nothing of it depends on earlier bounds.
//! So such a recording may be dropped or overtaken by another one, and the boxes still contain
//! their members.
//!
//! The host does not know these bounds, so it cannot form boxes for its own updates any more.
//! Those are refused from then on.
//! One that was recorded before, but runs later, makes the group boxes that it writes invalid
//! (`shaders/instances/update.wgsl`).

use std::num::NonZero;
use std::ops::Range;

use crate::error::{Error, Result};
use crate::gpu::buffers::{check_alive, entry, made};
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::stage_pass;
use crate::input::bounds::BoundsKind;
use crate::instances::Instances;
use crate::instances::forming::Forming;
use crate::instances::piece::Piece;

/// Invocations of one workgroup, each of which takes a group; `shaders/instances/from_buffer.wgsl`.
pub(crate) const WORKGROUP: u32 = 64;

/// The kinds of bounds that a buffer may hold.
#[cfg(feature = "testing")]
pub(crate) const FROM_BUFFER_KINDS: [BoundsKind; 3] =
    [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::Point];

/// Bounds that lie in a storage buffer, where a shader of the caller's writes them.
///
/// Each instance has a record of float32 numbers, in the order of the instances:
///
/// | kind | words | numbers |
/// |---|---|---|
/// | [`BoundsKind::Sphere`] | 4 | x, y and z of the centre, radius |
/// | [`BoundsKind::Box`] | 6 | x, y and z of the least corner, then of the greatest |
/// | [`BoundsKind::Point`] | 3 | x, y and z |
///
/// In WGSL, `array<vec4<f32>>` holds spheres, and `array<array<f32, 6>>` holds boxes.
/// `array<array<f32, 3>>` holds points.
///
/// Positions are world coordinates, in the world of the camera.
/// In a large world, let both be relative to a point near the eye: float32 is finest there.
///
/// # Examples
/// ```
/// # use hiz_core::headless::Engine;
/// use hiz_core::{BoundsBuffer, wgpu};
///
/// # let engine = Engine::new(None)?;
/// # let device = engine.device();
/// # let descriptor = wgpu::BufferDescriptor {
/// #     label: None,
/// #     size: 4800,
/// #     usage: wgpu::BufferUsages::STORAGE,
/// #     mapped_at_creation: false,
/// # };
/// # let buffer = device.create_buffer(&descriptor);
/// // Packed, from the beginning of the buffer.
/// let packed = BoundsBuffer::from(&buffer);
/// // Each the first numbers of a particle of 48 bytes, behind a header of 16.
/// let particles = BoundsBuffer { offset: 16, stride: Some(48), ..packed };
/// # assert_eq!(particles.stride, Some(48));
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct BoundsBuffer<'a> {
    /// The buffer, with the usage `STORAGE`.
    pub buffer: &'a wgpu::Buffer,
    /// Where the first record begins: bytes, a multiple of 4.
    pub offset: u64,
    /// Bytes from one record to the next one: a multiple of 4, and at least a record's.
    /// `None`: the records are packed.
    pub stride: Option<u64>,
}

impl<'a> From<&'a wgpu::Buffer> for BoundsBuffer<'a> {
    fn from(buffer: &'a wgpu::Buffer) -> Self {
        Self { buffer, offset: 0, stride: None }
    }
}

/// Twin: `shaders/instances/from_buffer.wgsl`, `FromBuffer`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct FromBufferUniform {
    pub(crate) count: u32,
    pub(crate) first: u32,
    pub(crate) stride: u32,
    pub(crate) runtime_zero: u32,
}

const BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Uniform),
    (1, Binding::Read),
    (2, Binding::Read),
    (3, Binding::WriteQuads),
    (4, Binding::WriteQuads),
    (5, Binding::Write),
];

/// The shader that takes bounds of this kind, a sphere, a box or a point.
pub(crate) fn from_buffer_module(kind: BoundsKind) -> Source {
    Source::of(&[&[
        wgsl!("instances/record_layout"),
        wgsl!("instances/groups"),
        wgsl!("instances/sequence"),
        wgsl!("instances/corners"),
        wgsl!("instances/from_buffer"),
        match kind {
            BoundsKind::Sphere => wgsl!("instances/from_buffer_sphere"),
            BoundsKind::Point => wgsl!("instances/from_buffer_point"),
            _ => wgsl!("instances/from_buffer_box"),
        },
    ]])
}

/// Bytes of the bounds of one instance in a buffer.
fn given_bytes(kind: BoundsKind) -> Result<u64> {
    match kind {
        BoundsKind::Sphere => Ok(4 * 4),
        BoundsKind::Box => Ok(6 * 4),
        BoundsKind::Point => Ok(3 * 4),
        BoundsKind::OrientedBox => Err(Error::invalid(
            "kind",
            "expected Sphere, Box or Point, got OrientedBox: a buffer may hold a sphere or a box \
             around each oriented box",
        )),
        BoundsKind::WidePoint => Err(Error::invalid(
            "kind",
            "expected Sphere, Box or Point, got WidePoint: a buffer holds float32, so upload the \
             points as Point",
        )),
    }
}

/// Checks the caller's buffer for `count` instances.
/// Returns the bytes from one to the next.
fn checked(source: &BoundsBuffer<'_>, kind: BoundsKind, count: u32) -> Result<u64> {
    let BoundsBuffer { buffer, offset, stride } = *source;
    let given = given_bytes(kind)?;
    let stride = stride.unwrap_or(given);
    if !buffer.usage().contains(wgpu::BufferUsages::STORAGE) {
        return Err(Error::invalid(
            "buffer",
            format!("expected a buffer with the usage STORAGE, got {:?}", buffer.usage()),
        ));
    }
    let word = wgpu::COPY_BUFFER_ALIGNMENT;
    if !offset.is_multiple_of(word) {
        return Err(Error::invalid("offset", format!("expected a multiple of 4, got {offset}")));
    }
    if stride < given || !stride.is_multiple_of(word) {
        return Err(Error::invalid(
            "stride",
            format!("expected a multiple of 4 from {given} on for a {kind:?}, got {stride}"),
        ));
    }
    let needed = end_of(offset, stride, given, count);
    if needed.is_none_or(|needed| needed > buffer.size()) {
        let needed = needed.map_or("more than 2^64".to_owned(), |needed| needed.to_string());
        return Err(Error::invalid(
            "buffer",
            format!(
                "expected {needed} bytes for {count} instances (offset {offset}, stride \
                 {stride}), got {}",
                buffer.size()
            ),
        ));
    }
    check_alive(buffer).map_err(|why| unusable(&why))?;
    Ok(stride)
}

/// Where the bounds of `count` instances end; `None` if that is beyond every address.
fn end_of(offset: u64, stride: u64, given: u64, count: u32) -> Option<u64> {
    match count {
        0 => Some(offset),
        _ => stride.checked_mul(u64::from(count) - 1)?.checked_add(given)?.checked_add(offset),
    }
}

fn unusable(why: &Error) -> Error {
    Error::mismatch(
        "buffer",
        format!("expected a buffer of this device that has not been destroyed, but {why}"),
    )
}

/// Makes instances of the bounds in a buffer, stored in the caller's order.
pub(crate) fn record_instances_from(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    source: &BoundsBuffer<'_>,
    kind: BoundsKind,
    count: u32,
) -> Result<Instances> {
    checked(source, kind, count)?;
    let instances = Instances::unwritten(gpu, kind, count)?;
    record_update_from(gpu, encoder, &instances, source, |_| Ok(()))?;
    Ok(instances)
}

/// Records that all bounds of `instances` are taken from a buffer.
///
/// `before` records the work that has to read the old bounds.
pub(crate) fn record_update_from(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    instances: &Instances,
    source: &BoundsBuffer<'_>,
    before: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
) -> Result<()> {
    gpu.check_context("instances", instances.context)?;
    if instances.num_absent() > 0 {
        return Err(Error::mismatch(
            "instances",
            format!(
                "expected instances of which none is absent, got {} absent ones: their records \
                 would be overwritten; give them a mesh, and bounds outside of the view",
                instances.num_absent()
            ),
        ));
    }
    let kind = instances.kind;
    let stride = checked(source, kind, instances.len())?;
    let pieces = instances.pieces.iter().filter(|piece| piece.count() > 0);
    // Everything is made before anything is recorded.
    let prepared = pieces
        .map(|piece| {
            let is_sorted = !piece.order.is_given();
            let bindings = bind(gpu, instances, piece, source, stride)?;
            let workgroups = piece.groups().div_ceil(WORKGROUP);
            let forming = Forming::all(gpu, piece)?;
            Ok((pipeline(gpu, kind, is_sorted)?, bindings, workgroups, forming))
        })
        .collect::<Result<Vec<_>>>()?;
    if prepared.is_empty() {
        return Ok(());
    }
    before(encoder)?;
    instances.bounds_are_on_device();
    gpu.recorded(|| {
        let mut pass = stage_pass(encoder, "hiz.instances.from_buffer", "update");
        for (pipeline, bindings, workgroups, forming) in &prepared {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(*workgroups, 1, 1);
            if let Some(forming) = forming {
                forming.record(&mut pass);
            }
        }
        Ok(())
    })
}

fn pipeline(gpu: &Gpu, kind: BoundsKind, is_sorted: bool) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.instances.from_buffer.pipeline",
        source: from_buffer_module(kind),
        entry_point: "take_bounds",
        layouts: &[gpu.layout("hiz.instances.from_buffer.layout", BINDINGS)?],
        constants: &[("SORTED", flag(is_sorted))],
    })
}

/// The part of the buffer that a piece binds, and where its first record lies there.
fn part(
    gpu: &Gpu,
    piece: &Piece,
    source: &BoundsBuffer<'_>,
    (stride, given): (u64, u64),
) -> Result<(Range<u64>, u64)> {
    let limits = gpu.limits();
    let first = source.offset + u64::from(piece.range.start) * stride;
    let end = first + u64::from(piece.count() - 1) * stride + given;
    let begin = first - first % u64::from(limits.min_storage_buffer_offset_alignment);
    let allowed = limits.max_storage_buffer_binding_size;
    if end - begin > allowed {
        return Err(Error::limit("max_storage_buffer_binding_size", end - begin, allowed));
    }
    Ok((begin..end, first - begin))
}

fn bind(
    gpu: &Gpu,
    instances: &Instances,
    piece: &Piece,
    source: &BoundsBuffer<'_>,
    stride: u64,
) -> Result<wgpu::BindGroup> {
    let key = (source.buffer.clone(), source.offset, stride);
    piece.from_buffer.bindings.get(key, || {
        let (part, first) = part(gpu, piece, source, (stride, given_bytes(instances.kind)?))?;
        let uniform = FromBufferUniform {
            count: piece.count(),
            // Below 2^30, because a binding is below 2^32 bytes.
            first: (first / 4) as u32,
            stride: (stride / 4) as u32,
            runtime_zero: 0,
        };
        let uniform = gpu.uniform("hiz.instances.from_buffer.uniform", &uniform)?;
        let given = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: source.buffer,
            offset: part.start,
            size: NonZero::new(part.end - part.start),
        });
        let indices = if piece.order.is_given() {
            gpu.stand_in("hiz.no_indices")?
        } else {
            made(&piece.from_buffer.indices, || indices_of(gpu, piece))?.clone()
        };
        let layout = gpu.layout("hiz.instances.from_buffer.layout", BINDINGS)?;
        let entries = [
            entry(0, uniform.as_entire_binding()),
            entry(1, given),
            entry(2, indices.as_entire_binding()),
            entry(3, wgpu::BindingResource::TextureView(&piece.records.view)),
            entry(4, wgpu::BindingResource::TextureView(&piece.group_records.view)),
            entry(5, instances.sequence.as_entire_binding()),
        ];
        gpu.bind_group("hiz.instances.from_buffer.bindings", &layout, &entries).map_err(|error| {
            match error {
                Error::Device(_) => unusable(&error),
                other => other,
            }
        })
    })
}

/// The index of the instance at each place of a sorted piece, on the device.
fn indices_of(gpu: &Gpu, piece: &Piece) -> Result<wgpu::Buffer> {
    let indices = piece.order.indices();
    let usage = wgpu::BufferUsages::STORAGE;
    gpu.filled("hiz.instances.indices", bytemuck::cast_slice(indices), usage)
}
