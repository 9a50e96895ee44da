//! The passes that fill a mip texture: `shaders/pyramid/mips.wgsl`, then a copy per level.

use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::numbers::Copy;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::stage_pass;
use crate::input::image::DepthConvention;
use crate::pyramid::ends::Depths;
use crate::pyramid::layout::{BLOCK_ALIGNMENT, PIXELS};
use crate::pyramid::levels::Level;
use crate::pyramid::mips::{MipDepths, MipLookup, MipTexture};
use crate::pyramid::mips_bindings::{MipsUniform, STEP_BINDINGS};
use crate::pyramid::mips_plan::MipStep;
use crate::pyramid::source::{DepthSource, Part, Sampling};
use crate::pyramid::sources::Binds;

/// Invocations of a workgroup; twin: `shaders/pyramid/mips.wgsl`, `WORKGROUP`.
pub(crate) const WORKGROUP: u32 = 64;

/// The bindings of the depth image and the list.
const fn bindings(source: SourceKind) -> [(u32, Binding); 4] {
    use Binding::{Depth, Sampler, Uniform, Write};
    [(0, Depth(source)), (1, Sampler), (2, Uniform), (3, Write)]
}

/// The shader module; `both`: its texels hold two depths.
pub(crate) fn mips_module(source: SourceKind, both: bool) -> Source {
    let ends = if both {
        [wgsl!("gpu/ends_both"), wgsl!("pyramid/mips_both")]
    } else {
        [wgsl!("gpu/ends_one"), wgsl!("pyramid/mips_one")]
    };
    let rows = if source == SourceKind::Bits {
        wgsl!("pyramid/mips_bits")
    } else {
        wgsl!("pyramid/mips_sampled")
    };
    Source::of(&[
        &[wgsl!("gpu/depth_bits")],
        source.files(),
        &ends,
        &[wgsl!("pyramid/pyramid"), rows, wgsl!("pyramid/mips")],
    ])
}

/// What a pipeline does: a step, or level 0.
#[derive(Debug, Clone, Copy)]
enum Work<'a> {
    Step(&'a MipStep),
    LevelZero,
}

fn pipeline(
    gpu: &Gpu,
    source: SourceKind,
    reversed: bool,
    mips: &MipTexture,
    work: Work<'_>,
) -> Result<wgpu::ComputePipeline> {
    let options = mips.options;
    let both = options.depths == MipDepths::Both;
    let (entry_point, from_source, levels, odd) = match work {
        Work::LevelZero => ("mip_level_0", true, 1, [false; 2]),
        // The tail asks each level for its sizes.
        Work::Step(step) if step.is_tail => ("mip_tail", false, 1, [false; 2]),
        Work::Step(step) => ("mip_blocks", step.source == 0, step.last - step.source, step.odd),
    };
    // Nearest depths alone are the farthest in the other convention.
    let reversed = reversed != (options.depths == MipDepths::Nearest);
    let constants = [
        ("REVERSED", flag(reversed)),
        ("RECEIVERS", flag(false)),
        ("CHUNKS", 1.0),
        ("FROM_SOURCE", flag(from_source)),
        ("LEVELS", f64::from(levels)),
        ("ODD_X", flag(odd[0])),
        ("ODD_Y", flag(odd[1])),
        ("EDGE_TEXEL", flag(options.lookup == MipLookup::EdgeTexel)),
    ];
    gpu.compute_pipeline(&Compute {
        label: "hiz.mips.pipeline",
        source: mips_module(source, both),
        entry_point,
        layouts: &[
            gpu.layout("hiz.mips.layout", &bindings(source))?,
            gpu.layout("hiz.mips.step_layout", STEP_BINDINGS)?,
        ],
        constants: &constants,
    })
}

/// A dispatch: its pipeline, what it binds, and its workgroups.
struct Dispatch<'a> {
    pipeline: wgpu::ComputePipeline,
    bound: &'a wgpu::BindGroup,
    workgroups: [u32; 2],
}

impl Dispatch<'_> {
    fn record(&self, pass: &mut wgpu::ComputePass<'_>) {
        let [columns, rows] = self.workgroups;
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, self.bound, &[]);
        pass.dispatch_workgroups(columns, rows, 1);
    }
}

/// The ends that are read of `depth`; both are those of one image.
///
/// # Errors
/// [`Error::Invalid`] for both ends of several samples per pixel.
fn ends_of(depth: &DepthSource<'_>, mips: &MipTexture) -> Result<Depths> {
    match mips.options.depths {
        MipDepths::Farthest => Ok(Depths::Farthest),
        MipDepths::Nearest => Ok(Depths::Nearest),
        MipDepths::Both if depth.samples > 1 => Err(Error::invalid(
            "depths",
            format!(
                "expected MipDepths::Farthest or Nearest for {} samples per pixel, got Both; make \
                 a mip texture of each",
                depth.samples
            ),
        )),
        MipDepths::Both => Ok(Depths::Farthest),
    }
}

/// Records the passes that fill `mips` from `depth`.
///
/// # Errors
/// As [`HizContext::record_mips`](crate::HizContext::record_mips).
pub(crate) fn record_mips(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthSource<'_>,
    convention: DepthConvention,
    mips: &MipTexture,
) -> Result<()> {
    gpu.check_context("mips", mips.context)?;
    let part =
        Part::new(depth, Sampling::Single, (mips.size, "mip texture"), ends_of(depth, mips)?)?;
    // Everything that can fail comes before the first command is recorded.
    let source = bind_source(gpu, &part, mips)?;
    let (plan, reversed) = (&mips.plan, convention.is_reversed());
    let make = |work| pipeline(gpu, part.kind, reversed, mips, work);
    let in_rows = |columns: u32, rows: u32| [columns.div_ceil(WORKGROUP), rows];
    let bands = plan.bands.iter().zip(&mips.bindings.bands).map(|(band, bound)| {
        let pipeline = make(Work::LevelZero)?;
        let columns = mips.size.width.div_ceil(PIXELS);
        let workgroups = in_rows(columns, band.rows.div_ceil(2));
        Ok((band, Dispatch { pipeline, bound, workgroups }))
    });
    let bands = bands.collect::<Result<Vec<_>>>()?;
    let steps = plan.steps.iter().zip(&mips.bindings.steps).map(|(step, bound)| {
        let pipeline = make(Work::Step(step))?;
        let half = &plan.levels[step.source as usize + 1];
        let [x, y] = [half.width, half.height].map(|n| n.div_ceil(BLOCK_ALIGNMENT));
        let workgroups = if step.is_tail { [1, 1] } else { in_rows(x, y) };
        Ok(Dispatch { pipeline, bound, workgroups })
    });
    let steps = steps.collect::<Result<Vec<_>>>()?;
    let origin = gpu.numbers(bytemuck::bytes_of(&part.origin))?;
    gpu.recorded(|| {
        let to = std::mem::offset_of!(MipsUniform, origin) as u64;
        let (target, size) = (&mips.bindings.uniform, origin.len());
        origin.record(encoder, &[Copy { from: 0, target, to, size }]);
        for (band, dispatch) in &bands {
            let mut pass = stage_pass(encoder, "hiz.mips.pass", "mips");
            pass.set_bind_group(0, &source, &[]);
            dispatch.record(&mut pass);
            drop(pass);
            copy(encoder, mips, 0, band.first, Level { height: band.rows, ..plan.levels[0] });
        }
        if !steps.is_empty() {
            let mut pass = stage_pass(encoder, "hiz.mips.pass", "mips");
            pass.set_bind_group(0, &source, &[]);
            steps.iter().for_each(|dispatch| dispatch.record(&mut pass));
        }
        for (k, level) in (0..).zip(&plan.levels).skip(1) {
            copy(encoder, mips, k, 0, *level);
        }
        Ok(())
    })
}

/// Records the copy of rows of a level, from row `first` on, into the texture.
fn copy(
    encoder: &mut wgpu::CommandEncoder,
    mips: &MipTexture,
    level: u32,
    first: u32,
    rows: Level,
) {
    let Some(mut place) = mips.place_of(level) else { return };
    place.origin.y += first;
    let texel = mips.texture.format().block_copy_size(None).unwrap_or(4);
    encoder.copy_buffer_to_texture(
        wgpu::TexelCopyBufferInfo {
            buffer: &mips.bindings.list,
            layout: wgpu::TexelCopyBufferLayout {
                offset: u64::from(rows.offset) * u64::from(texel),
                bytes_per_row: Some(rows.stride * texel),
                rows_per_image: None,
            },
        },
        place,
        wgpu::Extent3d { width: rows.width, height: rows.height, depth_or_array_layers: 1 },
    );
}

/// The bind group of the depth image.
fn bind_source(gpu: &Gpu, part: &Part, mips: &MipTexture) -> Result<wgpu::BindGroup> {
    let binds = Binds {
        label: "hiz.mips.source",
        layout: "hiz.mips.layout",
        bindings: &bindings(part.kind),
        rest: &[
            entry(1, wgpu::BindingResource::Sampler(gpu.sampler())),
            entry(2, mips.bindings.uniform.as_entire_binding()),
            entry(3, mips.bindings.list.as_entire_binding()),
        ],
    };
    mips.sources.bind(gpu, part, part.kind, &binds)
}
