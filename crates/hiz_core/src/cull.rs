//! The cull pass: one camera, one pyramid, one set of instances; and the explanation of a single verdict.

use crate::camera::Camera;
use crate::compact;
use crate::error::{Error, Result};
use crate::gpu::{CullKey, Gpu};
use crate::instances::{Instances, Piece};
use crate::layout::CULL_WORKGROUP;
use crate::pyramid::{Built, Pyramid, entry};
use crate::renumber;
use crate::view::{EPS, Row, ViewRows};
use crate::visible::Visible;

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
            statistics: true,
        }
    }
}

/// `shaders/shared/view.wgsl`, `View`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ViewUniform {
    pub(crate) x: Row,
    pub(crate) y: Row,
    pub(crate) z: Row,
    pub(crate) w: Row,
    pub(crate) eye_hi: [f32; 3],
    pub(crate) z_slope: f32,
    pub(crate) eye_lo: [f32; 3],
    pub(crate) coordinate_limit: f32,
    pub(crate) half_size: [f32; 2],
    pub(crate) reach: f32,
    pub(crate) depth_factor: f32,
    pub(crate) size: [i32; 2],
    pub(crate) runtime_zero: u32,
    pub(crate) reduction: u32,
    pub(crate) descent_budget: u32,
    pub(crate) depth_offset: f32,
    pub(crate) padding_0: u32,
    pub(crate) padding_1: u32,
}

const _: () = assert!(size_of::<ViewUniform>() == 208);

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
        Ok(Self {
            x: rows.x,
            y: rows.y,
            z: rows.z,
            w: rows.w,
            eye_hi: rows.eye_hi,
            z_slope: rows.z_slope,
            eye_lo: rows.eye_lo,
            coordinate_limit: rows.coordinate_limit,
            half_size: [size.width as f32 / 2.0, size.height as f32 / 2.0],
            reach: reach as f32,
            depth_factor,
            size: [size.width as i32, size.height as i32],
            runtime_zero: 0,
            reduction,
            descent_budget: options.descent,
            depth_offset,
            padding_0: 0,
            padding_1: 0,
        })
    }
}

/// Everything that the shader knows of one cull, bound.
struct Bound {
    view: wgpu::BindGroup,
    key: CullKey,
}

/// What a cull reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CullInputs<'a> {
    pub(crate) instances: &'a Instances,
    pub(crate) camera: &'a Camera,
    pub(crate) pyramid: &'a Pyramid,
    pub(crate) options: &'a CullOptions,
}

fn bind(gpu: &Gpu, inputs: &CullInputs<'_>) -> Result<Bound> {
    let CullInputs { instances, camera, pyramid, options } = *inputs;
    gpu.check_context("instances", instances.context)?;
    gpu.check_context("pyramid", pyramid.context)?;
    let Built { reduction, source, source_kind, .. } = pyramid.built_for(camera)?;
    let view = gpu.uniform("hiz.cull.view", &ViewUniform::new(camera, reduction, options)?)?;
    let view = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("hiz.cull.view"),
        layout: gpu.layouts().cull(source_kind),
        entries: &[
            entry(0, wgpu::BindingResource::TextureView(&source)),
            entry(2, pyramid.uniform.as_entire_binding()),
            entry(3, pyramid.chunk(gpu, 0).as_entire_binding()),
            entry(4, pyramid.chunk(gpu, 1).as_entire_binding()),
            entry(5, pyramid.chunk(gpu, 2).as_entire_binding()),
            entry(6, view.as_entire_binding()),
        ],
    });
    let key = CullKey {
        source: source_kind,
        kind: instances.kind,
        reversed: camera.convention().is_reversed(),
        chunks: pyramid.chunks.len(),
        sample_coverage: options.coverage == Coverage::Sample,
        footprint_log2: options.footprint.log2(),
        descent: options.descent > 0,
        fit_volume: options.fit == Fit::Volume,
        append: options.order == Order::Any,
        statistics: options.statistics,
    };
    Ok(Bound { view, key })
}

fn bind_piece(gpu: &Gpu, uniform: &wgpu::Buffer, piece: &Piece) -> wgpu::BindGroup {
    gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("hiz.cull.instances"),
        layout: &gpu.layouts().instances,
        entries: &[entry(0, uniform.as_entire_binding()), entry(1, piece.records.as_entire_binding())],
    })
}

pub(crate) fn record(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    visible: &Visible,
) -> Result<()> {
    let CullInputs { instances, options, .. } = *inputs;
    gpu.check_context("visible", visible.context)?;
    if !visible.counts().iter().copied().eq(instances.pieces.iter().map(Piece::count)) {
        return Err(Error::mismatch("visible", "expected buffers that were created for these instances, got others"));
    }
    let bound = bind(gpu, inputs)?;
    encoder.copy_buffer_to_buffer(&visible.draws_template, 0, &visible.draws, 0, visible.draws.size());
    encoder.clear_buffer(&visible.counters, 0, None);
    for output in visible.pieces.iter().filter(|output| output.stored_planes.is_some()) {
        encoder.clear_buffer(&output.planes, 0, None);
    }
    let mut pass = encoder
        .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("hiz.cull.pass"), timestamp_writes: None });
    pass.set_pipeline(&gpu.cull_pipeline(bound.key));
    pass.set_bind_group(0, &bound.view, &[]);
    for (piece, output) in instances.pieces.iter().zip(&visible.pieces) {
        let outputs = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("hiz.cull.visible"),
            layout: &gpu.layouts().visible,
            entries: &[
                entry(0, output.stored_planes.as_ref().unwrap_or(&output.planes).as_entire_binding()),
                entry(1, output.list.as_entire_binding()),
                entry(2, visible.draws.as_entire_binding()),
                entry(3, visible.counters.as_entire_binding()),
                entry(4, visible.capacity_uniform.as_entire_binding()),
            ],
        });
        pass.set_bind_group(1, &bind_piece(gpu, &piece.uniform, piece), &[]);
        pass.set_bind_group(2, &outputs, &[]);
        pass.dispatch_workgroups(piece.count().div_ceil(CULL_WORKGROUP), 1, 1);
    }
    renumber::record(gpu, &mut pass, instances, visible, options.order);
    if options.order == Order::Stable {
        compact::record(gpu, &mut pass, instances, visible);
    }
    Ok(())
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
    let Bound { view, key } = bind(gpu, inputs)?;
    let place = piece.order.place((index - piece.range.start) as usize) as u32;
    let which = gpu.uniform("hiz.explain.which", &[place, 0, 0, 0])?;
    let output = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("hiz.explain.target"),
        layout: &gpu.layouts().one_storage,
        entries: &[entry(0, target.as_entire_binding())],
    });
    let mut pass = encoder
        .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("hiz.explain.pass"), timestamp_writes: None });
    pass.set_pipeline(&gpu.explain_pipeline(CullKey { append: false, statistics: false, ..key }));
    pass.set_bind_group(0, &view, &[]);
    pass.set_bind_group(1, &bind_piece(gpu, &which, piece), &[]);
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
