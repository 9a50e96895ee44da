//! Whatever the format of a depth image rounds counts as slack in every cull.
//!
//! A format may store a wall nearer than it is.
//! An instance between the stored depth and the wall is visible, and must not be culled.
//!
//! Expectations are worked out from the definitions of the formats.
//! They are in Vulkan 1.3, "Fixed-Point Data Conversions" and "Floating-Point Format Conversions".
//! A number between two that can be stored may become either.

mod common;

use std::sync::Arc;

use common::{CONVENTIONS, camera_along_z, depth_descriptor, engine};
use hiz_core::headless::Engine;
use hiz_core::wgpu::TextureFormat as Format;
use hiz_core::{
    AtlasUse, Bounds, Camera, CullOptions, DepthConvention, DepthTolerance, Fit, Floats, Hierarchy,
    ImageSize, InstanceOptions, Outputs, Pose, Projection, Pyramid, PyramidOptions, Verdict, wgpu,
};

const OCCLUDED: Verdict = Verdict::Occluded;
const VISIBLE: Verdict = Verdict::Visible;
const SIDE: u32 = 16;

fn texture(engine: &Engine, format: Format, usage: wgpu::TextureUsages) -> wgpu::Texture {
    let usage = usage | wgpu::TextureUsages::TEXTURE_BINDING;
    engine.device().create_texture(&depth_descriptor((SIDE, SIDE), format, usage))
}

/// Walls that fill the image, rasterised into a texture of a depth format.
struct Walls {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    format: Format,
}

impl Walls {
    const SHADER: &str = "
        @group(0) @binding(0) var<uniform> depth: vec4<f32>;
        @vertex fn wall(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
            return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), depth.x, 1.0);
        }";

    fn new(engine: &Engine, format: Format) -> Self {
        let device = engine.device();
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("test.wall"),
            source: wgpu::ShaderSource::Wgsl(Self::SHADER.into()),
        });
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("test.wall"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("test.wall"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("test.wall"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("wall"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: None,
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline, layout, format }
    }

    /// Draws a wall of NDC depth `depth`.
    fn draw(&self, engine: &Engine, depth: f32) -> wgpu::Texture {
        let device = engine.device();
        let texture = texture(engine, self.format, wgpu::TextureUsages::RENDER_ATTACHMENT);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("test.wall"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        engine.queue().write_buffer(&uniform, 0, &depth.to_le_bytes());
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("test.wall"),
            layout: &self.layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let clear = |value| {
            Some(wgpu::Operations { load: wgpu::LoadOp::Clear(value), store: wgpu::StoreOp::Store })
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("test.wall"),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &view,
                depth_ops: clear(0.5),
                stencil_ops: self.format.has_stencil_aspect().then_some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0),
                    store: wgpu::StoreOp::Store,
                }),
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        engine.queue().submit([encoder.finish()]);
        texture
    }
}

/// A texture filled with one number, given as its bits.
fn filled(engine: &Engine, format: Format, bits: u16) -> wgpu::Texture {
    let texture =
        texture(engine, format, wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC);
    let bytes: Vec<u8> =
        std::iter::repeat_n(bits.to_le_bytes(), (SIDE * SIDE) as usize).flatten().collect();
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(2 * SIDE),
        rows_per_image: None,
    };
    engine.queue().write_texture(texture.as_image_copy(), &bytes, layout, texture.size());
    texture
}

/// The view that a bind group accepts.
fn depth_view(texture: &wgpu::Texture) -> wgpu::TextureView {
    let aspect = if texture.format().has_stencil_aspect() {
        wgpu::TextureAspect::DepthOnly
    } else {
        wgpu::TextureAspect::All
    };
    texture.create_view(&wgpu::TextureViewDescriptor { aspect, ..Default::default() })
}

fn reduced(
    engine: &Engine,
    texture: &wgpu::Texture,
    camera: &Camera,
    atlas: AtlasUse,
) -> Arc<Pyramid> {
    let options = PyramidOptions { atlas, ..PyramidOptions::default() };
    let pyramid = engine.context().create_pyramid(camera.size(), &options).unwrap();
    let mut encoder =
        engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    engine.context().record_reduce(&mut encoder, &depth_view(texture), camera, &pyramid).unwrap();
    engine.queue().submit([encoder.finish()]);
    Arc::new(pyramid)
}

/// The verdicts of flat boxes at these depths, in the middle of the image.
/// There are 64 of each, so that a group holds only one depth.
/// They are five pixels wide.
/// With an atlas they are less than one pixel wide, so that the image itself is read.
fn verdicts(
    engine: &Engine,
    depths: &[f64],
    camera: &Camera,
    (pyramid, atlas): (&Arc<Pyramid>, AtlasUse),
    options: &CullOptions,
) -> Vec<Verdict> {
    let (mut min, mut max) = (Vec::new(), Vec::new());
    let half = if atlas == AtlasUse::Always { 0.02 } else { 0.3 };
    for z in depths {
        for _ in 0..64 {
            min.extend([-half * z, -half * z, *z]);
            max.extend([half * z, half * z, *z]);
        }
    }
    let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
    let order = hiz_core::StoredOrder::Given;
    let list = engine
        .instances(&bounds, &InstanceOptions { order, ..InstanceOptions::default() })
        .unwrap();
    let culling = engine.cull(&list, camera, pyramid, options, &Outputs::default()).unwrap();
    let all = culling.verdicts().unwrap();
    for (i, verdict) in all.iter().enumerate().step_by(64) {
        assert!(all[i..i + 64].iter().all(|v| v == verdict), "one depth, one verdict");
        if options.fit == Fit::Rectangle {
            assert_eq!(culling.explain(i as u64).unwrap().verdict, *verdict, "explained");
        }
    }
    if options.hierarchy == Hierarchy::Always {
        let hidden = all.iter().filter(|v| **v == OCCLUDED).count() as u64;
        assert_eq!(
            culling.counts().unwrap().tested_instances,
            all.len() as u64 - hidden,
            "groups decided"
        );
    }
    all.into_iter().step_by(64).collect()
}

/// Every kind of test that compares depth.
fn ways() -> Vec<CullOptions> {
    let plain =
        CullOptions { depth_slack: 0.0, hierarchy: Hierarchy::Never, ..CullOptions::default() };
    vec![
        plain.clone(),
        CullOptions { hierarchy: Hierarchy::Always, ..plain.clone() },
        CullOptions { descent: 4096, fit: Fit::Volume, hierarchy: Hierarchy::Always, ..plain },
    ]
}

/// The view depth of NDC depth `ndc` for [`camera_along_z`].
fn view_depth(ndc: f64, convention: DepthConvention) -> f64 {
    if convention.is_reversed() { 1.0 / ndc } else { 1.0 / (1.0 - ndc) }
}

/// The view depth that is `steps` steps of `step` behind `stored`.
fn behind(stored: f64, steps: f64, step: f64, convention: DepthConvention) -> f64 {
    view_depth(
        if convention.is_reversed() { stored - steps * step } else { stored + steps * step },
        convention,
    )
}

/// A wall may be anywhere up to one step behind the number that is stored.
/// So an instance 0.95 steps behind that number may be visible, and one 1.1 steps behind cannot be.
/// This holds for every kind of test.
/// Half a step of slack would hide the first, and so would no slack, or none for groups.
#[test]
fn a_step_of_the_format_decides() {
    let engine = &engine();
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        // The bits, the number that they encode, and the step at that number.
        let unorm = |c: u16| (Format::Depth16Unorm, c, f64::from(c) / 65_535.0, 1.0 / 65_535.0);
        let half =
            |bits, value: f64| (Format::R16Float, bits, value, value / 1024.0 + 2.0_f64.powi(-24));
        let cases = if convention.is_reversed() {
            // 2^-5; ten of the least subnormal steps.
            [unorm(2000), unorm(9), half(0x2800, 1.0 / 32.0), half(10, 10.0 / 16_777_216.0)]
        } else {
            [unorm(63_000), unorm(65_526), half(0x3B00, 0.875), half(0x3BF0, 2032.0 / 2048.0)]
        };
        for (format, bits, stored, step) in cases {
            let texture = filled(engine, format, bits);
            // An atlas holds float32, so culls read such an image in place.
            for (atlas, ways) in [(AtlasUse::Never, &ways()[..]), (AtlasUse::Always, &ways()[..1])]
            {
                let pyramid = reduced(engine, &texture, &camera, atlas);
                assert_eq!(pyramid.tolerance(), DepthTolerance::of(format));
                for options in ways {
                    // The shader's own roundings take 2^-23.
                    // That is two steps of subnormal halves.
                    let far = if stored < 1e-6 { 4.0 } else { 1.1 };
                    let depths =
                        [0.55, 0.95, far, 8.0].map(|k| behind(stored, k, step, convention));
                    let got = verdicts(engine, &depths, &camera, (&pyramid, atlas), options);
                    let what = format!("{convention:?} {format:?} {stored} {atlas:?} {options:?}");
                    assert_eq!(got, [VISIBLE, VISIBLE, OCCLUDED, OCCLUDED], "{what}");
                    // The caller's slack is added: here half a step.
                    let options = CullOptions { depth_slack_abs: 0.5 * step, ..options.clone() };
                    let depths = [1.45, far + 0.5].map(|k| behind(stored, k, step, convention));
                    let got = verdicts(engine, &depths, &camera, (&pyramid, atlas), &options);
                    assert_eq!(got, [VISIBLE, OCCLUDED], "{what} and half a step");
                }
            }
        }
    }
}

/// The same for depth in 24 bits, or in the float32 that a driver uses instead.
/// Formats of float32 bring no slack.
/// The wall is drawn with reversed Z and far away, where a step is large beside float32's.
#[test]
fn depth_of_24_bits_brings_its_step_and_float32_none() {
    let engine = &engine();
    let step = 1.0 / 16_777_215.0;
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Reversed);
    for format in [Format::Depth24Plus, Format::Depth24PlusStencil8, Format::Depth32Float] {
        let walls = Walls::new(engine, format);
        let stored = 3001.0 * step;
        let texture = walls.draw(engine, stored as f32);
        let pyramid = reduced(engine, &texture, &camera, AtlasUse::Never);
        assert_eq!(pyramid.tolerance(), DepthTolerance::of(format));
        let expected = if format == Format::Depth32Float { OCCLUDED } else { VISIBLE };
        for options in ways() {
            // Beside the step, the shader's own roundings take 2^-23, which is two steps.
            // Another tenth is float32's margin.
            let depths =
                [0.55, 0.95, 3.3, 10.0].map(|k| behind(stored, k, step, DepthConvention::Reversed));
            let got = verdicts(engine, &depths, &camera, (&pyramid, AtlasUse::Never), &options);
            assert_eq!(got, [expected, expected, OCCLUDED, OCCLUDED], "{format:?} {options:?}");
        }
    }
}

/// Spheres one to three centimetres in front of a rasterised wall 10 to 30 metres away.
/// In a bug report 4,200 of 10,000 such spheres were hidden.
/// Near planes are chosen so that a step of the format is 6 cm at 20 m.
/// Spheres twenty steps behind the wall are hidden.
/// With 24 bits the slack of float32 alone, relative to a depth near 1, is eight steps.
#[test]
fn nothing_that_stands_before_a_wall_is_hidden() {
    let engine = &engine();
    let formats = [
        (Format::Depth16Unorm, 0.1),
        (Format::Depth24Plus, 4e-4),
        (Format::Depth24PlusStencil8, 4e-4),
    ];
    for (format, near) in formats {
        let walls = Walls::new(engine, format);
        for convention in CONVENTIONS {
            let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, 1.0], up: [0.0, 1.0, 0.0] };
            let far = 100.0;
            let projection =
                Projection::Perspective { fov_y: 1.0, near, far: Some(far), convention };
            let camera = Camera::look_at(&pose, &projection, ImageSize::new(SIDE, SIDE)).unwrap();
            let steps = if format == Format::Depth16Unorm { 65_535.0 } else { 16_777_215.0 };
            let mut hidden = 0;
            for k in 0..40 {
                let z = 10.0 + 0.5 * f64::from(k);
                let standard = far / (far - near) * (1.0 - near / z);
                let ndc = if convention.is_reversed() { 1.0 - standard } else { standard };
                let pyramid =
                    reduced(engine, &walls.draw(engine, ndc as f32), &camera, AtlasUse::Never);
                // 125 spheres whose farthest points are 1 to 3 cm in front of the wall.
                // Then 125 that are more than twenty steps behind it.
                let step = z * z / near / steps;
                let (mut centers, mut radii) = (Vec::new(), Vec::new());
                for i in 0..125 {
                    let (u, v) = (f64::from(i % 5) / 4.0 - 0.5, f64::from(i / 5) / 24.0 - 0.5);
                    let before = 0.01 + 0.02 * f64::from(i) / 124.0;
                    centers.extend([0.5 * z * u, 0.5 * z * v, z - before - 0.005]);
                    radii.push(0.005);
                }
                for i in 0..125 {
                    let (u, v) = (f64::from(i % 5) / 4.0 - 0.5, f64::from(i / 5) / 24.0 - 0.5);
                    centers.extend([0.5 * z * u, 0.5 * z * v, z + 20.0 * step + 0.005]);
                    radii.push(0.005);
                }
                let bounds =
                    Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
                let list = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
                for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
                    let options = CullOptions { hierarchy, ..CullOptions::default() };
                    let culling = engine
                        .cull(&list, &camera, &pyramid, &options, &Outputs::default())
                        .unwrap();
                    let got = culling.verdicts().unwrap();
                    hidden += got[..125].iter().filter(|v| **v != VISIBLE).count();
                    let kept = got[125..].iter().filter(|v| **v != OCCLUDED).count();
                    assert_eq!(
                        kept, 0,
                        "{format:?} {convention:?} {z}: kept twenty steps behind the wall"
                    );
                }
            }
            assert_eq!(hidden, 0, "{format:?} {convention:?}: of 10,000 spheres before their wall");
        }
    }
}

/// Half floats that were uploaded as float32.
/// The image knows its step, and so do the pyramid and every cull, with an atlas, too.
#[test]
fn uploaded_halves_bring_their_step() {
    let engine = &engine();
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        let stored = if convention.is_reversed() { 1.0 / 32.0 } else { 0.875 };
        let step = stored / 1024.0;
        let wall = [stored as f32; (SIDE * SIDE) as usize];
        for atlas in [AtlasUse::Never, AtlasUse::Always] {
            let options = PyramidOptions { atlas, ..PyramidOptions::default() };
            let depths = [0.55, 0.95, 1.1, 8.0].map(|k| behind(stored, k, step, convention));
            let image = engine.upload_depth_within(&wall, &camera, DepthTolerance::HALF).unwrap();
            assert_eq!(image.tolerance(), DepthTolerance::HALF);
            let pyramid = engine.pyramid_with(&image, &options).unwrap();
            assert_eq!(pyramid.tolerance(), Some(DepthTolerance::HALF));
            let exact = engine
                .pyramid_with(&engine.upload_depth(&wall, &camera).unwrap(), &options)
                .unwrap();
            for options in ways() {
                let got = verdicts(engine, &depths, &camera, (&pyramid, atlas), &options);
                assert_eq!(
                    got,
                    [VISIBLE, VISIBLE, OCCLUDED, OCCLUDED],
                    "{convention:?} {atlas:?} {options:?}"
                );
                let got = verdicts(engine, &depths, &camera, (&exact, atlas), &options);
                assert_eq!(got, [OCCLUDED; 4], "{convention:?} {atlas:?} {options:?}");
            }
        }
        let wrong = DepthTolerance { relative: 0.6, absolute: 0.0 };
        let error = engine.upload_depth_within(&wall, &camera, wrong).unwrap_err().to_string();
        assert_eq!(error, "tolerance.relative: expected a number in 0..=0.5, got 0.6");
    }
}

/// Level 0 of such an image is not float32, so it cannot be read back; the levels above can.
#[test]
fn level_0_of_other_bits_is_not_read() {
    let engine = &engine();
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Standard);
    let pyramid =
        reduced(engine, &filled(engine, Format::Depth16Unorm, 32_768), &camera, AtlasUse::Never);
    let error = engine.read_level(&pyramid, 0).unwrap_err().to_string();
    assert!(
        error.starts_with("level: expected a level above 0 of a pyramid of Depth16Unorm"),
        "{error}"
    );
    let read = engine.read_level(&pyramid, 1).unwrap();
    assert!(read.iter().all(|d| (f64::from(*d) * 65_535.0 - 32_768.0).abs() < 0.01), "{read:?}");
}
