//! The check of a device's timestamps: two passes of known work behind a render pass.

use crate::error::Result;
use crate::gpu::buffers::{STORAGE, entry};
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::{StageTime, TimedPass, stage_pass, timed_pass};

/// Invocations of a workgroup; `shaders/gpu/clock_check.wgsl`.
pub(crate) const WORKGROUP: u32 = 64;
const WORKGROUPS: u32 = 16;

/// Steps of the short pass and of the long one.
const STEPS: [u32; 2] = [10_000, 40_000];
/// The long pass takes four times as long as the short one, but for what begins and ends a pass.
const RATIO: std::ops::RangeInclusive<f64> = 2.0..=8.0;
/// What the host may see of the passes at least, in relation to their sum.
const OF_WALL: f64 = 1.05;

const LAYOUT: &str = "hiz.clock_check.layout";
const BINDINGS: &[(u32, Binding)] = &[(0, Binding::Write)];

/// The shader of the known work.
pub(crate) fn clock_check_module() -> Source {
    Source::of(&[&[wgsl!("gpu/clock_check")]])
}

/// What the check records.
pub(crate) struct ClockCheck {
    depth: wgpu::TextureView,
    bindings: wgpu::BindGroup,
    pipelines: Vec<wgpu::ComputePipeline>,
}

impl ClockCheck {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self> {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let format = wgpu::TextureFormat::Depth32Float;
        let depth = gpu.view(&gpu.texture("hiz.clock_check.depth", (64, 64), format, usage)?)?;
        let size = 4 * u64::from(WORKGROUP * WORKGROUPS);
        let numbers = gpu.empty("hiz.clock_check.numbers", size, STORAGE)?;
        let layout = gpu.layout(LAYOUT, BINDINGS)?;
        let bindings = gpu.bind_group(
            "hiz.clock_check.bindings",
            &layout,
            &[entry(0, numbers.as_entire_binding())],
        )?;
        let pipelines = STEPS.map(|steps| {
            gpu.compute_pipeline(&Compute {
                label: "hiz.clock_check.pipeline",
                source: clock_check_module(),
                entry_point: "spin",
                layouts: std::slice::from_ref(&layout),
                constants: &[("STEPS", f64::from(steps))],
            })
        });
        Ok(Self { depth, bindings, pipelines: pipelines.into_iter().collect::<Result<_>>()? })
    }

    /// Records a render pass and the two passes of known work.
    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        let timed = timed_pass("render");
        drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("hiz.clock_check.render"),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: timed.as_ref().and_then(TimedPass::of_render_pass),
            ..Default::default()
        }));
        for (pipeline, stage) in self.pipelines.iter().zip(["short", "long"]) {
            let mut pass = stage_pass(encoder, "hiz.clock_check.pass", stage);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            pass.dispatch_workgroups(WORKGROUPS, 1, 1);
        }
    }
}

/// Whether these times can be those of the check, which the host saw to take `wall_ms`.
pub(crate) fn are_plausible(stages: &[StageTime], wall_ms: f64) -> bool {
    let times: Option<Vec<f64>> = stages.iter().map(|stage| stage.gpu_ms).collect();
    let Some([render, short, long]) = times.as_deref() else { return false };
    *short > 0.0 && RATIO.contains(&(long / short)) && render + short + long <= OF_WALL * wall_ms
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_plausible_if_they_show_the_work() {
        let check = |times: [Option<f64>; 3], wall_ms| {
            let stage = |(stage, gpu_ms)| StageTime { stage, passes: 1, gpu_ms };
            let names = ["render", "short", "long"];
            are_plausible(&names.into_iter().zip(times).map(stage).collect::<Vec<_>>(), wall_ms)
        };
        assert!(check([Some(0.0), Some(1.0), Some(4.0)], 5.0));
        assert!(check([Some(0.1), Some(1.5), Some(4.2)], 9.0));
        assert!(!check([Some(0.1), Some(1.0), Some(4.0)], 4.0), "more than the host saw");
        assert!(!check([Some(0.1), Some(0.0), Some(0.0)], 5.0), "all at one time");
        assert!(!check([Some(0.1), Some(2.0), Some(2.0)], 5.0), "no work shows");
        assert!(!check([Some(0.1), Some(1.0), None], 5.0));
        assert!(!are_plausible(&[], 5.0));
    }
}
