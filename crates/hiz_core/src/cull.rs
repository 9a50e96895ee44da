//! The cull pass: one camera, one pyramid, one set of instances; and the explanation of a single verdict.

use crate::bounds::BoundsKind;
use crate::camera::Camera;
use crate::compact;
use crate::error::{Error, Result};
use crate::gpu::{CullKey, Gpu, ReportKey, StandIn};
use crate::instances::{Instances, Piece, bind_records};
use crate::layout::CULL_WORKGROUP;
use crate::pyramid::{Built, Pyramid, entry};
use crate::shader::TexelStore;
use crate::view::{EPS, ViewRows};
use crate::visible::{PieceOutput, Visible};

/// In which order the indices of the kept instances are listed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Order {
    /// Ascending: the same list from every run and driver.
    #[default]
    Stable,
    /// As invocations arrive: one pass fewer.
    Any,
}

/// Where a volume must not be seen to be culled.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Coverage {
    /// Anywhere in the closed pixel squares that its projection meets.
    #[default]
    Area,
    /// At pixel centres alone, for one sample a pixel and the same viewport and jitter.
    Sample,
}

/// How many texels of one level a test may read, as N x N. More texels mean a finer level: less is kept, more is read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Footprint {
    /// 2 x 2.
    #[default]
    Two,
    /// 4 x 4.
    Four,
    /// 8 x 8.
    Eight,
}

impl Footprint {
    fn log2(self) -> u32 {
        match self {
            Self::Two => 1,
            Self::Four => 2,
            Self::Eight => 3,
        }
    }
}

/// As what a volume is compared with the depth image.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Fit {
    /// The rectangle around its projection, at its nearest depth.
    #[default]
    Rectangle,
    /// Where the rectangle cannot decide: its own outline, and in each texel its own depth there. Less is kept, more is computed; with
    /// a descent it comes down to single pixels.
    Volume,
}

/// Whether whole groups of 64 instances are tested before their members.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Hierarchy {
    /// Where there are enough instances for it to pay.
    #[default]
    Auto,
    /// Whatever their number.
    Always,
    /// Each instance by itself.
    Never,
}

/// How instances are culled.
#[derive(Debug, Clone, PartialEq)]
pub struct CullOptions {
    /// The order of the packed list.
    pub order: Order,
    /// Area or sample coverage.
    pub coverage: Coverage,
    /// Extra distance in pixels, a multiple of 1/256 in 0..=16, that a projection must keep from what it does not touch. `None`: 0 in area
    /// coverage, 1/64 in sample coverage (what a rasteriser's snapping may move a sample).
    pub guard_px: Option<f64>,
    /// Relative slack of the stored depth, 0..=0.5: 2^-23 covers depth that was rounded to nearest.
    pub depth_slack: f64,
    /// Absolute slack of the stored depth, 0..=0.5, in units of NDC depth and beside the relative one: the rasteriser of an
    /// orthographic camera errs by the same amount near and far. Anything above 0 counts 2^-23 more.
    pub depth_slack_abs: f64,
    /// kappa, 0..=1e6: how many eps of `sum |M| |p|` the transform of the depth image's renderer may have cost; 0 for depth that
    /// is exact for the camera's matrices, about 4 for a renderer that transforms world coordinates in float32.
    pub transform_slack: f64,
    /// How many texels a test reads.
    pub footprint: Footprint,
    /// How many texels of finer levels a test may read where the footprint cannot decide, 0..=65536; 0: none. With enough of
    /// them the answer is that of a rectangle test at full resolution.
    pub descent: u32,
    /// What stands for a volume.
    pub fit: Fit,
    /// Whether groups are tested first. What a group's test hides, its members' own tests would have hidden but for the level that they
    /// read: what is kept differs by next to nothing.
    pub hierarchy: Hierarchy,
    /// Count the depth tests of each level and the texels read.
    pub statistics: bool,
}

impl Default for CullOptions {
    fn default() -> Self {
        Self {
            order: Order::Stable,
            coverage: Coverage::Area,
            guard_px: None,
            depth_slack: EPS,
            depth_slack_abs: 0.0,
            transform_slack: 0.0,
            footprint: Footprint::Two,
            descent: 0,
            fit: Fit::Rectangle,
            hierarchy: Hierarchy::Auto,
            statistics: false,
        }
    }
}

/// `shaders/shared/view.wgsl`, `View`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ViewUniform {
    pub(crate) x: [f32; 4],
    pub(crate) y: [f32; 4],
    pub(crate) z: [f32; 4],
    pub(crate) w: [f32; 4],
    pub(crate) magnitudes: [f32; 4],
    pub(crate) constant_magnitudes: [f32; 4],
    pub(crate) eye_hi: [f32; 3],
    pub(crate) z_slope: f32,
    pub(crate) eye_lo: [f32; 3],
    pub(crate) halves_size: f32,
    pub(crate) half_size: [f32; 2],
    pub(crate) reach: f32,
    pub(crate) depth_factor: f32,
    pub(crate) size: [i32; 2],
    pub(crate) runtime_zero: u32,
    pub(crate) reduction: u32,
    pub(crate) descent_budget: u32,
    pub(crate) depth_offset: f32,
    pub(crate) coordinate_limit: f32,
    pub(crate) padding: u32,
}

const _: () = assert!(size_of::<ViewUniform>() == 176);

impl ViewUniform {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "multiples of 2^-8 and sizes below 2^15 are exact, the factor is rounded towards far"
    )]
    pub(crate) fn new(camera: &Camera, reduction: u32, options: &CullOptions) -> Result<Self> {
        let range = |name: &str, value: f64, most: f64| {
            if (0.0..=most).contains(&value) {
                Ok(value)
            } else {
                Err(Error::invalid(name, format!("expected a number in 0..={most}, got {value}")))
            }
        };
        let slack = range("depth_slack", options.depth_slack, 0.5)?;
        let slack_abs = range("depth_slack_abs", options.depth_slack_abs, 0.5)?;
        range("descent", f64::from(options.descent), 65_536.0)?;
        let kappa = range("transform_slack", options.transform_slack, 1e6)?;
        let guard = match (options.guard_px, options.coverage) {
            (Some(g), _) => range("guard_px", g, 16.0)?,
            (None, Coverage::Area) => 0.0,
            (None, Coverage::Sample) => 1.0 / 64.0,
        };
        if (guard * 256.0).fract() != 0.0 {
            return Err(Error::invalid("guard_px", format!("expected a multiple of 1/256, got {guard}")));
        }
        let reach = match options.coverage {
            Coverage::Area => guard,
            Coverage::Sample => guard - 0.5,
        };
        // Rounded towards far; what the product itself rounds away stays (docs/accuracy.md).
        let depth_factor = if camera.convention().is_reversed() {
            -crate::view::round_up(slack - 1.0)
        } else {
            crate::view::round_up(1.0 + slack)
        };
        // The product and the sum in the shader lose less than 2^-24 each where the depth stays below 1: that is added here. 0
        // adds nothing and loses nothing.
        let depth_offset = if slack_abs > 0.0 { crate::view::round_up(slack_abs + EPS) } else { 0.0 };
        let depth_offset = if camera.convention().is_reversed() { -depth_offset } else { depth_offset };
        let rows = ViewRows::new(camera, kappa)?;
        let size = camera.size();
        let all = [rows.x, rows.y, rows.z, rows.w];
        Ok(Self {
            x: rows.x.m,
            y: rows.y.m,
            z: rows.z.m,
            w: rows.w.m,
            magnitudes: all.map(|row| row.a[..3].iter().copied().fold(0.0, f32::max)),
            constant_magnitudes: all.map(|row| row.a[3]),
            eye_hi: rows.eye_hi,
            z_slope: rows.z_slope,
            eye_lo: rows.eye_lo,
            halves_size: crate::view::round_up(halves_size(&rows)),
            half_size: [size.width as f32 / 2.0, size.height as f32 / 2.0],
            reach: reach as f32,
            depth_factor,
            size: [size.width as i32, size.height as i32],
            runtime_zero: 0,
            reduction,
            descent_budget: options.descent,
            depth_offset,
            coordinate_limit: rows.coordinate_limit,
            padding: 0,
        })
    }
}

/// What low halves of positions near the eye come to, all axes added: those of the eye, and twice 2^-24 of the high halves, for theirs
/// and for what both cannot hold; and a little, for the roundings of this sum.
fn halves_size(rows: &ViewRows) -> f64 {
    let sum = |v: [f32; 3]| v.iter().map(|v| f64::from(v.abs())).sum::<f64>();
    sum(rows.eye_lo) * (1.0 + EPS) + EPS * (1.0 + 1.0 / 256.0) * sum(rows.eye_hi)
}

/// What a cull reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CullInputs<'a> {
    pub(crate) instances: &'a Instances,
    pub(crate) camera: &'a Camera,
    pub(crate) pyramid: &'a Pyramid,
    pub(crate) options: &'a CullOptions,
    /// False: the yardstick, for boxes and the flat cull alone.
    pub(crate) certified: bool,
}

/// What the shader knows of camera and pyramid, and the pipeline that asks for it.
struct Seen {
    built: Built,
    /// The stored levels in a texture, where that pays.
    texels: Option<wgpu::TextureView>,
    key: CullKey,
}

impl Seen {
    /// For `encoder`, which takes the copy of the levels where one is needed; without it there is none.
    fn new(gpu: &Gpu, inputs: &CullInputs<'_>, encoder: Option<&mut wgpu::CommandEncoder>) -> Result<Self> {
        let CullInputs { instances, camera, pyramid, options, .. } = *inputs;
        gpu.check_context("instances", instances.context)?;
        gpu.check_context("pyramid", pyramid.context)?;
        let built = pyramid.built_for(camera)?;
        let texels = encoder
            .filter(|_| pyramid.texture_pays(gpu, instances.len()))
            .map(|encoder| pyramid.record_texture(gpu, encoder, built.reduction));
        let key = CullKey {
            source: built.source_kind,
            texels: if texels.is_some() { TexelStore::Texture } else { TexelStore::Buffer },
            kind: instances.kind,
            reversed: camera.convention().is_reversed(),
            chunks: if texels.is_some() { 1 } else { pyramid.chunks.len() },
            sample_coverage: options.coverage == Coverage::Sample,
            footprint_log2: options.footprint.log2(),
            descent: options.descent > 0,
            fit_volume: options.fit == Fit::Volume,
        };
        Ok(Self { built, texels, key })
    }

    /// The bindings for these options; those of the last cull, if it asked for the same.
    fn bind(&self, gpu: &Gpu, camera: &Camera, pyramid: &Pyramid, options: &CullOptions) -> Result<wgpu::BindGroup> {
        let uniform = ViewUniform::new(camera, self.built.reduction, options)?;
        let key = (self.key.texels, bytemuck::cast(uniform));
        pyramid.bindings(key, || self.create(gpu, pyramid, &uniform))
    }

    fn create(&self, gpu: &Gpu, pyramid: &Pyramid, uniform: &ViewUniform) -> Result<wgpu::BindGroup> {
        let view = gpu.uniform("hiz.cull.view", uniform)?;
        let mut entries = vec![
            entry(0, wgpu::BindingResource::TextureView(&self.built.source)),
            entry(1, wgpu::BindingResource::Sampler(gpu.sampler())),
            entry(2, pyramid.uniform.as_entire_binding()),
            entry(6, view.as_entire_binding()),
        ];
        match &self.texels {
            Some(texels) => entries.push(entry(3, wgpu::BindingResource::TextureView(texels))),
            None => entries.extend((0..3).map(|c| entry(3 + c, pyramid.chunk(gpu, c as usize).as_entire_binding()))),
        }
        Ok(gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("hiz.cull.view"),
            layout: gpu.layouts().cull(self.key.source, self.key.texels),
            entries: &entries,
        }))
    }
}

fn bind_output(gpu: &Gpu, piece: &Piece, visible: &Visible, p: usize, statistics: bool) -> wgpu::BindGroup {
    let lists = visible.lists.as_ref();
    let list = lists.map_or(gpu.stand_in(StandIn::List), |lists| lists.pieces[p].bound());
    let draws = lists.map_or(gpu.stand_in(StandIn::Draws), |lists| &lists.draws);
    // Any uniform will do where nothing is listed.
    let capacity = lists.map_or(&piece.uniform, |lists| &lists.capacity_uniform);
    let statistics = if statistics { visible.statistics_or_new(gpu) } else { gpu.stand_in(StandIn::Statistics) };
    gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("hiz.cull.visible"),
        layout: &gpu.layouts().visible,
        entries: &[
            entry(0, visible.pieces[p].mask.as_entire_binding()),
            entry(1, list.as_entire_binding()),
            entry(2, draws.as_entire_binding()),
            entry(3, statistics.as_entire_binding()),
            entry(4, capacity.as_entire_binding()),
        ],
    })
}

pub(crate) fn record(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    visible: &Visible,
) -> Result<()> {
    let CullInputs { instances, camera, pyramid, options, .. } = *inputs;
    gpu.check_context("visible", visible.context)?;
    if !visible.counts().iter().copied().eq(instances.pieces.iter().map(Piece::count)) {
        return Err(Error::mismatch("visible", "expected buffers that were created for these instances, got others"));
    }
    let seen = Seen::new(gpu, inputs, Some(encoder))?;
    let key = seen.key;
    let view = seen.bind(gpu, camera, pyramid, options)?;
    let group_view = if instances.pieces.iter().any(|piece| is_grouped(piece, options)) {
        let options = CullOptions { descent: options.descent.max(GROUP_DESCENT), ..options.clone() };
        Some(seen.bind(gpu, camera, pyramid, &options)?)
    } else {
        None
    };
    let outputs = visible.outputs();
    let listed = outputs.indices || outputs.draws;
    let ordered = listed && options.order == Order::Stable;
    let report = ReportKey {
        mask: outputs.mask || ordered,
        verdicts: outputs.verdicts,
        append: listed && !ordered,
        list: outputs.indices && !ordered,
        capped: visible.is_capped(),
        statistics: options.statistics,
    };
    if let Some(lists) = &visible.lists {
        lists.record_clear(encoder);
    }
    if report.statistics {
        encoder.clear_buffer(visible.statistics_or_new(gpu), 0, None);
    }
    for (piece, output) in instances.pieces.iter().zip(&visible.pieces) {
        if report.mask {
            encoder.clear_buffer(&output.mask, 0, Some(4 * u64::from(piece.words().max(1))));
        }
        if is_grouped(piece, options) {
            let (from, to) = (gpu.no_survivors()?, &output.groups_or_new(gpu, piece).survivors);
            encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
        }
    }
    let mut pass = encoder
        .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("hiz.cull.pass"), timestamp_writes: None });
    pass.set_bind_group(0, &view, &[]);
    for (p, (piece, output)) in instances.pieces.iter().zip(&visible.pieces).enumerate() {
        let groups = group_view.as_ref().filter(|_| is_grouped(piece, options));
        if let Some(group_view) = groups {
            pass.set_bind_group(0, group_view, &[]);
            record_groups(gpu, &mut pass, key, piece, output);
            pass.set_bind_group(0, &view, &[]);
        }
        pass.set_bind_group(1, &piece.bindings, &[]);
        pass.set_bind_group(2, &bind_output(gpu, piece, visible, p, report.statistics), &[]);
        if groups.is_some() {
            let groups = output.groups_or_new(gpu, piece);
            let survivors = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("hiz.cull.survivors"),
                layout: &gpu.layouts().members,
                entries: &[
                    entry(0, groups.survivors.as_entire_binding()),
                    entry(1, wgpu::BindingResource::TextureView(&groups.survivor_list)),
                ],
            });
            pass.set_bind_group(3, &survivors, &[]);
            pass.set_pipeline(&gpu.cull_members_pipeline(key, report));
            pass.dispatch_workgroups_indirect(&groups.survivors, 0);
        } else {
            let pipeline = if inputs.certified { Gpu::cull_pipeline } else { Gpu::yardstick_cull_pipeline };
            pass.set_pipeline(&pipeline(gpu, key, report));
            pass.dispatch_workgroups(piece.groups().div_ceil(GROUPS_OF_RUN), 1, 1);
        }
    }
    if let Some(lists) = visible.lists.as_ref().filter(|_| ordered) {
        compact::record(gpu, &mut pass, instances, visible, lists);
    }
    Ok(())
}

/// Groups whose members one workgroup tests; `shaders/shared/survivors.wgsl`, `RUN`.
pub(crate) const GROUPS_OF_RUN: u32 = 8;

/// Texels of finer levels that a group's test may read: a box around 64 instances is large, so its footprint is coarse
/// (`docs/performance.md`).
const GROUP_DESCENT: u32 = 32;

/// From how many instances on groups are culled first: fewer are tested one by one before the groups' own dispatches have begun
/// (`docs/performance.md`).
const GROUPS_PAY_FROM: u32 = 16_384;

/// Whether the groups of a piece are culled before its instances.
pub(crate) fn is_grouped(piece: &Piece, options: &CullOptions) -> bool {
    match options.hierarchy {
        Hierarchy::Never => false,
        Hierarchy::Always => piece.count() > 0,
        Hierarchy::Auto => piece.count() >= GROUPS_PAY_FROM,
    }
}

/// The boxes of a piece's groups, and what is left of them.
fn record_groups(gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, key: CullKey, piece: &Piece, output: &PieceOutput) {
    let groups = output.groups_or_new(gpu, piece);
    let survivors = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("hiz.cull.groups"),
        layout: &gpu.layouts().survivors,
        entries: &[
            entry(0, groups.survivors.as_entire_binding()),
            entry(1, groups.verdicts.as_entire_binding()),
            entry(2, wgpu::BindingResource::TextureView(&groups.survivor_list)),
        ],
    });
    pass.set_pipeline(&gpu.cull_groups_pipeline(CullKey { kind: BoundsKind::Box, descent: true, ..key }));
    pass.set_bind_group(1, &piece.group_bindings, &[]);
    pass.set_bind_group(2, &survivors, &[]);
    pass.dispatch_workgroups(piece.groups().div_ceil(CULL_WORKGROUP), 1, 1);
}

/// `shaders/explain.wgsl`, `Explanation`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ExplanationRecord {
    pub(crate) verdict: u32,
    pub(crate) stage: u32,
    pub(crate) level: u32,
    pub(crate) farthest_bits: u32,
    pub(crate) pixels: [i32; 4],
    pub(crate) texels: [u32; 4],
    pub(crate) texel_bits: [u32; 4],
    pub(crate) depths: [f32; 2],
    pub(crate) padding: [f32; 2],
}

/// Records the explanation of instance `index` into `target`, `size_of::<ExplanationRecord>()` bytes of storage.
pub(crate) fn record_explain(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    index: u32,
    target: &wgpu::Buffer,
) -> Result<()> {
    let instances = inputs.instances;
    let piece = instances.pieces.iter().find(|p| p.range.contains(&index)).ok_or_else(|| {
        Error::invalid("index", format!("expected an instance below {}, got {index}", instances.len()))
    })?;
    let seen = Seen::new(gpu, inputs, None)?;
    let view = seen.bind(gpu, inputs.camera, inputs.pyramid, inputs.options)?;
    let place = piece.order.place((index - piece.range.start) as usize) as u32;
    let which = gpu.uniform("hiz.explain.which", &[place, 0, 0, 0])?;
    let output = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("hiz.explain.target"),
        layout: &gpu.layouts().one_storage,
        entries: &[entry(0, target.as_entire_binding())],
    });
    let mut pass = encoder
        .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("hiz.explain.pass"), timestamp_writes: None });
    pass.set_pipeline(&gpu.explain_pipeline(seen.key));
    pass.set_bind_group(0, &view, &[]);
    pass.set_bind_group(1, &bind_records(gpu, &which, &piece.records), &[]);
    pass.set_bind_group(2, &output, &[]);
    pass.dispatch_workgroups(1, 1, 1);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{DepthConvention, ImageSize};

    /// Slack is never less than what was asked for: a factor rounded to nearest would be, half of the time.
    #[test]
    fn the_depth_factor_is_rounded_towards_far() {
        for (convention, z) in
            [(DepthConvention::Standard, [0.0, 0.0, 1.0, -1.0]), (DepthConvention::Reversed, [0.0, 0.0, 0.0, 1.0])]
        {
            let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, [0.0, 0.0, 1.0, 0.0]];
            let camera = Camera::from_clip_from_world(rows, ImageSize::new(8, 8), convention).unwrap();
            for k in 0..100 {
                let depth_slack = 0.5 * 10.0_f64.powf(-f64::from(k) / 8.0);
                let options = CullOptions { depth_slack, ..CullOptions::default() };
                let factor = f64::from(ViewUniform::new(&camera, 0, &options).unwrap().depth_factor);
                let moved = if convention.is_reversed() { 1.0 - factor } else { factor - 1.0 };
                assert!(moved >= depth_slack && moved <= depth_slack + EPS, "{convention:?} {depth_slack}: {factor}");
            }
        }
    }
}
