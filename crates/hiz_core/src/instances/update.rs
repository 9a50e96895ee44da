//! Updates: they replace the bounds of some instances.
//!
//! The instances keep their places.
//! Their records are replaced, and the boxes of their groups follow.
//!
//! A group's box must contain its members, and the host forms it without knowing all of their
//! bounds.
//! If a recorded update is dropped or reordered, the host's group boxes may no longer contain their
//! members.
//! So updates are numbered, and the device counts those that ran.
//! On a mismatch the device invalidates every group box that is written afterwards.
//! The members of such a group are always tested one by one.
//!
//! The boxes of upper tiers are formed on the device from those of the groups (`tiers`).

use std::ops::Range;

use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::stage_pass;
use crate::host::memory;
use crate::input::bounds::{Bounds, BoundsKind};
use crate::instances::batch::GROUP;
use crate::instances::batch::Origin;
use crate::instances::forming::Forming;
use crate::instances::piece::{CULL_WORKGROUP, write_boxes};
use crate::instances::records::Records;
use crate::instances::volume_record::BoxRecord;
use crate::instances::{Instances, refuse_bad};

/// Invocations of one workgroup; `shaders/instances/update.wgsl`.
/// It equals the cull's, whose pieces fit one dispatch.
pub(crate) const WORKGROUP: u32 = CULL_WORKGROUP;

/// Twin: `shaders/instances/update.wgsl`, `Update`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct UpdateUniform {
    pub(crate) count: u32,
    pub(crate) texels: u32,
    pub(crate) number: u32,
    pub(crate) padding: u32,
}

/// The bindings of a replacement.
const BINDINGS: &[(u32, Binding)] = &[
    (0, Binding::Uniform),
    (1, Binding::Read),
    (2, Binding::Read),
    (3, Binding::WriteQuads),
    (4, Binding::Write),
];

/// The shader that replaces records and group boxes.
pub(crate) fn update_module() -> Source {
    Source::of(&[&[
        wgsl!("instances/record_layout"),
        wgsl!("instances/sequence"),
        wgsl!("instances/update"),
    ]])
}

fn update_pipeline(gpu: &Gpu, entry_point: &'static str) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.update.pipeline",
        source: update_module(),
        entry_point,
        layouts: &[gpu.layout("hiz.update.layout", BINDINGS)?],
        constants: &[],
    })
}

/// Records that replace those at `places` of one texture.
struct Replacement<'a> {
    places: &'a [u32],
    fresh: wgpu::Buffer,
    target: &'a Records,
}

/// Records an update.
///
/// `before` is called if any instances are updated.
/// It learns which ones, and records the work that has to read their old bounds.
pub(crate) fn record_update(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    instances: &Instances,
    first: u32,
    bounds: &Bounds<'_>,
    strict: bool,
    before: impl FnOnce(&mut wgpu::CommandEncoder, Range<u32>) -> Result<()>,
) -> Result<()> {
    gpu.check_context("instances", instances.context)?;
    let n = bounds.len()?;
    if instances.changing().on_device {
        return Err(Error::mismatch(
            "instances",
            "expected instances whose bounds come from the host, got some whose bounds \
             `record_update_from` takes from a buffer: write the buffer instead",
        ));
    }
    let kind = bounds.kind();
    if kind == BoundsKind::WidePoint && instances.kind == BoundsKind::Point {
        return Err(Error::mismatch(
            "bounds",
            "expected positions that float32 holds, as all were when these points were uploaded, \
             got positions that need two float32: round them to float32, or upload all of them \
             again",
        ));
    }
    if !instances.kind.holds(kind) {
        return Err(Error::mismatch(
            "bounds",
            format!("expected the instances' kind, {:?}, got {kind:?}", instances.kind),
        ));
    }
    let room = instances.len().checked_sub(first).ok_or_else(|| {
        Error::invalid(
            "first",
            format!("expected a number in 0..={}, got {first}", instances.len()),
        )
    })?;
    if n > room as usize {
        return Err(Error::invalid(
            "bounds",
            format!("expected at most {room} from instance {first} on, got {n}"),
        ));
    }
    if strict {
        let mut record = vec![0; instances.kind.record_bytes() as usize];
        let changing = instances.changing();
        let mut bad = (0..n).filter(|i| {
            let is_absent = instances.is_absent(&changing, first as usize + i);
            !is_absent && !bounds.write_record(*i, 0, &mut record)
        });
        let first_bad = bad.next();
        refuse_bad(n, usize::from(first_bad.is_some()) + bad.count(), first_bad.map(|i| i as u64))?;
    }
    if n == 0 {
        return Ok(());
    }
    let range = first..first + n as u32;
    before(encoder, range.clone())?;

    let begin = update_pipeline(gpu, "begin")?;
    let mut changing = instances.changing();
    let number = changing.next_update;
    changing.next_update = number.wrapping_add(1);
    let result = gpu.recorded(|| {
        let mut pass = stage_pass(encoder, "hiz.update.pass", "update");
        let mut begun = false;
        let mut dispatch = |pass: &mut wgpu::ComputePass<'_>,
                            replacement: &Replacement<'_>,
                            entry_point|
         -> Result<()> {
            let (bind_group, pipeline) =
                (bind(gpu, instances, replacement, number)?, update_pipeline(gpu, entry_point)?);
            pass.set_bind_group(0, &bind_group, &[]);
            if !std::mem::replace(&mut begun, true) {
                pass.set_pipeline(&begin);
                pass.dispatch_workgroups(1, 1, 1);
            }
            pass.set_pipeline(&pipeline);
            pass.dispatch_workgroups((replacement.places.len() as u32).div_ceil(WORKGROUP), 1, 1);
            Ok(())
        };
        instances.pieces.iter().enumerate().try_for_each(|(p, piece)| {
            let here = range.start.max(piece.range.start)..range.end.min(piece.range.end);
            if here.is_empty() {
                return Ok(());
            }
            let base = piece.range.start;
            let places =
                piece.order.places((here.start - base) as usize..(here.end - base) as usize)?;
            let offset = base as usize;
            let source = |place: usize| {
                let index = piece.order.index(place);
                Origin { bounds: offset + index - first as usize, index: index as u32 }
            };
            let record_bytes = instances.kind.record_bytes();
            let groups = &mut changing.groups[p];
            let mut all_touched = Vec::new();
            let staging = wgpu::BufferUsages::STORAGE;
            for places in bands(&places, record_bytes, gpu.limits()) {
                let (fresh, touched) = gpu.written(
                    "hiz.update.records",
                    places.len() as u64 * record_bytes,
                    staging,
                    |records| groups.replace((bounds, instances.kind), places, source, records),
                )?;
                dispatch(
                    &mut pass,
                    &Replacement { places, fresh, target: &piece.records },
                    "replace_records",
                )?;
                let bytes = (touched.len() * size_of::<BoxRecord>()) as u64;
                let (fresh, ()) = gpu.written("hiz.update.groups", bytes, staging, |boxes| {
                    write_boxes(boxes, touched.iter().map(|group| groups.record(*group as usize)))
                })?;
                dispatch(
                    &mut pass,
                    &Replacement { places: &touched, fresh, target: &piece.group_records },
                    "replace_groups",
                )?;
                memory::reserve(&mut all_touched, touched.len(), "update")?;
                all_touched.extend(touched);
            }
            if let Some(forming) = Forming::around(gpu, piece, &all_touched)? {
                forming.record(&mut pass);
            }
            Ok(())
        })
    });
    if result.is_err() {
        // The host may have taken part of the update.
        // A number that is skipped makes the device find a mismatch from now on.
        changing.next_update = changing.next_update.wrapping_add(1);
    }
    result
}

/// Records the dispatches of an update without workgroups, which update nothing.
/// They make what an update needs, and a driver that compiles at the first dispatch does so.
pub(crate) fn record_idle_update(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    instances: &Instances,
) -> Result<()> {
    gpu.check_context("instances", instances.context)?;
    let entry_points = ["begin", "replace_records", "replace_groups"];
    let pipelines =
        entry_points.iter().map(|entry| update_pipeline(gpu, entry)).collect::<Result<Vec<_>>>()?;
    let fresh = gpu.stand_in("hiz.no_update")?;
    let target = &instances.pieces[0].records;
    let bind_group = bind(gpu, instances, &Replacement { places: &[0], fresh, target }, 0)?;
    let forming = Forming::idle(gpu, &instances.pieces[0])?;
    gpu.recorded(|| {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("hiz.update.warm_up"),
            timestamp_writes: None,
        });
        pass.set_bind_group(0, &bind_group, &[]);
        for pipeline in &pipelines {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(0, 1, 1);
        }
        if let Some(forming) = &forming {
            forming.record(&mut pass);
        }
        Ok(())
    })
}

/// Splits ascending `places` into bands whose new records fit one storage binding.
///
/// A piece may be larger than that, because its own records lie in a texture.
/// No group is in two bands.
fn bands<'a>(
    places: &'a [u32],
    record_bytes: u64,
    limits: &wgpu::Limits,
) -> impl Iterator<Item = &'a [u32]> {
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let most = u32::try_from(bytes / record_bytes).unwrap_or(u32::MAX);
    let step = (most / GROUP as u32).max(1).saturating_mul(GROUP as u32);
    let mut rest = places;
    std::iter::from_fn(move || {
        let first = rest.first()? / step;
        let (band, behind) = rest.split_at(rest.partition_point(|place| place / step == first));
        rest = behind;
        Some(band)
    })
}

fn bind(
    gpu: &Gpu,
    instances: &Instances,
    replacement: &Replacement<'_>,
    number: u32,
) -> Result<wgpu::BindGroup> {
    let Replacement { places, fresh, target } = replacement;
    let uniform =
        UpdateUniform { count: places.len() as u32, texels: target.texels(), number, padding: 0 };
    let uniform = gpu.uniform("hiz.update.uniform", &uniform)?;
    let places =
        gpu.filled("hiz.update.places", bytemuck::cast_slice(places), wgpu::BufferUsages::STORAGE)?;
    gpu.bind_group(
        "hiz.update.piece",
        &gpu.layout("hiz.update.layout", BINDINGS)?,
        &[
            entry(0, uniform.as_entire_binding()),
            entry(1, places.as_entire_binding()),
            entry(2, fresh.as_entire_binding()),
            entry(3, wgpu::BindingResource::TextureView(&target.view)),
            entry(4, instances.sequence.as_entire_binding()),
        ],
    )
}
