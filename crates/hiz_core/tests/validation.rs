//! What wgpu's validation would find wrong in the library's own calls is returned as an error.
//! That error names the parameter.
//! Devices here have wgpu's own error handler, which ends the process.
//! So an error that reaches it fails the test.
//! After each error the same encoder is finished and submitted.
//! The same device then culls as before.

mod common;

use common::{camera_along_z, depth_descriptor};
use hiz_core::DrawOptions;
use hiz_core::wgpu::{self, TextureFormat as Format, TextureUsages as Usages};
use hiz_core::{
    AtlasUse, Bounds, BoundsKind, Camera, CullOptions, DepthConvention, DrawTemplate, Error,
    FaceCull, Floats, Footprint, Hierarchy, HizContext, ImageSize, InstanceOptions, Instances,
    MeshData, OccluderOptions, Occluders, Order, Outputs, Pyramid, PyramidOptions, Result,
    StoredLevels, StoredOrder, Visible,
};

const SIDE: u32 = 16;
const STANDARD: DepthConvention = DepthConvention::Standard;

fn adapter() -> wgpu::Adapter {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
        .expect("the device tests need a Vulkan driver")
}

fn open(
    adapter: &wgpu::Adapter,
    features: wgpu::Features,
    limits: &wgpu::Limits,
) -> (wgpu::Device, wgpu::Queue) {
    let descriptor = wgpu::DeviceDescriptor {
        required_features: features,
        required_limits: limits.clone(),
        ..Default::default()
    };
    pollster::block_on(adapter.request_device(&descriptor)).expect("a device")
}

/// A device and one of everything on it.
/// A wall is 4 away, and there is one box in front of it and one behind it.
struct World {
    device: wgpu::Device,
    queue: wgpu::Queue,
    context: HizContext,
    camera: Camera,
    instances: Instances,
    occluders: Occluders,
    pyramid: Pyramid,
    visible: Visible,
}

const TWO_BOXES: Bounds<'static> = Bounds::Boxes {
    min: Floats::F32(&[-1.0, -1.0, 2.0, -1.0, -1.0, 8.0]),
    max: Floats::F32(&[1.0, 1.0, 3.0, 1.0, 1.0, 9.0]),
};

const WALL: MeshData<'static> = MeshData {
    vertices: Floats::F32(&[-9.0, -9.0, 4.0, 9.0, -9.0, 4.0, 9.0, 9.0, 4.0, -9.0, 9.0, 4.0]),
    triangles: &[0, 1, 2, 0, 2, 3],
    transforms: None,
};

impl World {
    fn new() -> Self {
        let [world, _] = Self::two();
        world
    }

    /// Two devices of one wgpu instance.
    /// With two instances wgpu mixes up their objects.
    fn two() -> [Self; 2] {
        let adapter = adapter();
        let open =
            || Self::on(open(&adapter, wgpu::Features::empty(), &HizContext::required_limits()));
        [open(), open()]
    }

    fn on((device, queue): (wgpu::Device, wgpu::Queue)) -> Self {
        let context = HizContext::new(&device).unwrap();
        let camera = camera_along_z(SIDE, SIDE, STANDARD);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let instances = context
            .record_instances(&mut encoder, &TWO_BOXES, &InstanceOptions::default())
            .unwrap();
        let occluders = context
            .create_occluders(&[WALL], &OccluderOptions { cull_mode: FaceCull::None })
            .unwrap();
        let pyramid = context.create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
        let visible = context.create_visible(&instances, &Outputs::default()).unwrap();
        queue.submit([encoder.finish()]);
        Self { device, queue, context, camera, instances, occluders, pyramid, visible }
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    fn bounds_buffer(&self, size: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("test.bounds"),
            size,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        })
    }

    /// A texture of the image's size, with what `change` makes different.
    fn texture_but(
        &self,
        format: Format,
        usage: Usages,
        change: impl FnOnce(&mut wgpu::TextureDescriptor<'_>),
    ) -> wgpu::Texture {
        let mut descriptor = depth_descriptor((SIDE, SIDE), format, usage);
        change(&mut descriptor);
        self.device.create_texture(&descriptor)
    }

    fn texture(&self, format: Format, usage: Usages) -> wgpu::Texture {
        self.texture_but(format, usage, |_| ())
    }

    /// The depth image of the wall, rasterised.
    fn wall(&self, encoder: &mut wgpu::CommandEncoder) -> wgpu::Texture {
        let usage = Usages::RENDER_ATTACHMENT | Usages::TEXTURE_BINDING | Usages::COPY_SRC;
        let wall = self.texture(Format::Depth32Float, usage);
        self.context
            .record_occluders(
                encoder,
                &self.occluders,
                &self.camera,
                &plain(&wall),
                &DrawOptions::default(),
            )
            .unwrap();
        wall
    }

    fn reduce(&self, encoder: &mut wgpu::CommandEncoder, view: &wgpu::TextureView) -> Result<()> {
        self.context.record_reduce(encoder, view, &self.camera, &self.pyramid)
    }

    fn cull(&self, encoder: &mut wgpu::CommandEncoder, options: &CullOptions) -> Result<()> {
        let Self { instances, camera, pyramid, visible, .. } = self;
        self.context.record_cull(encoder, instances, camera, pyramid, visible, options)
    }

    /// The first bits of a mask, copied after what is already in `encoder`.
    fn mask(&self, mut encoder: wgpu::CommandEncoder, visible: &Visible) -> u32 {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("test.mask"),
            size: 4,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_buffer_to_buffer(visible.mask(0).expect("a mask"), 0, &staging, 0, 4);
        self.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |_| {});
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let view = staging.get_mapped_range(..).unwrap();
        u32::from_le_bytes([view[0], view[1], view[2], view[3]])
    }

    /// Asserts that everything still works, in an encoder that was used before.
    fn works(&self, mut encoder: wgpu::CommandEncoder, what: &str) {
        let wall = self.wall(&mut encoder);
        let pyramid =
            self.context.create_pyramid(self.camera.size(), &PyramidOptions::default()).unwrap();
        let visible = self.context.create_visible(&self.instances, &Outputs::default()).unwrap();
        self.context.record_reduce(&mut encoder, &plain(&wall), &self.camera, &pyramid).unwrap();
        let options = CullOptions::default();
        self.context
            .record_cull(&mut encoder, &self.instances, &self.camera, &pyramid, &visible, &options)
            .unwrap();
        assert_eq!(self.mask(encoder, &visible), 0b01, "{what}");
    }
}

/// The driver has to finish everything before the device is dropped.
impl Drop for World {
    fn drop(&mut self) {
        drop(self.device.poll(wgpu::PollType::wait_indefinitely()));
    }
}

fn plain(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// A case: its name, how the error begins, and what is done.
/// The error is empty where the call works.
type Case<'a> = (&'a str, &'a str, Box<dyn Fn(&mut wgpu::CommandEncoder) -> Result<()> + 'a>);

fn run(world: &World, cases: &[Case<'_>]) {
    for (what, expected, act) in cases {
        let mut encoder = world.encoder();
        match act(&mut encoder) {
            Ok(()) => assert_eq!(*expected, "", "{what}: expected an error"),
            Err(error) => {
                let text = error.to_string();
                assert!(!expected.is_empty() && text.starts_with(expected), "{what}: {text}");
                assert!(!matches!(error, Error::Device(_)), "{what} is no bug: {text}");
            }
        }
        world.works(encoder, what);
    }
}

const SAMPLED: Usages = Usages::TEXTURE_BINDING;

#[test]
fn depth_images_that_cannot_be_reduced_are_refused_by_name() {
    let [world, other] = World::two();
    let other_context = HizContext::new(&world.device).unwrap();
    let of_another =
        other_context.create_pyramid(world.camera.size(), &PyramidOptions::default()).unwrap();
    let smaller = camera_along_z(SIDE, 8, STANDARD);
    let destroyed = |world: &World, format, usage| {
        let texture = world.texture(format, usage);
        let view = plain(&texture);
        texture.destroy();
        view
    };
    let combined = Format::Depth24PlusStencil8;
    let gone = "depth: expected a texture of this device and context that has not been destroyed";
    let view_of = |texture: wgpu::Texture, descriptor: wgpu::TextureViewDescriptor<'static>| {
        texture.create_view(&descriptor)
    };
    let with = |view: wgpu::TextureView| {
        let world = &world;
        Box::new(move |encoder: &mut wgpu::CommandEncoder| world.reduce(encoder, &view)) as Box<_>
    };
    let but = |format, usage, change: &dyn Fn(&mut wgpu::TextureDescriptor<'_>)| {
        with(plain(&world.texture_but(format, usage, change)))
    };
    let aspect = |aspect| wgpu::TextureViewDescriptor { aspect, ..Default::default() };
    let both = SAMPLED | Usages::RENDER_ATTACHMENT;
    run(
        &world,
        &[
            (
                "the default view of depth and stencil",
                "",
                with(plain(&world.texture(combined, SAMPLED))),
            ),
            (
                "its depth",
                "",
                with(view_of(
                    world.texture(combined, SAMPLED),
                    aspect(wgpu::TextureAspect::DepthOnly),
                )),
            ),
            (
                "its stencil",
                "",
                with(view_of(
                    world.texture(combined, SAMPLED),
                    aspect(wgpu::TextureAspect::StencilOnly),
                )),
            ),
            (
                "a view to draw into alone",
                "",
                with(view_of(
                    world.texture(Format::Depth32Float, both),
                    wgpu::TextureViewDescriptor {
                        usage: Some(Usages::RENDER_ATTACHMENT),
                        ..Default::default()
                    },
                )),
            ),
            (
                "a view of layers",
                "",
                with(view_of(
                    world.texture(Format::R32Float, SAMPLED),
                    wgpu::TextureViewDescriptor {
                        dimension: Some(wgpu::TextureViewDimension::D2Array),
                        ..Default::default()
                    },
                )),
            ),
            ("16 bits", "", with(plain(&world.texture(Format::Depth16Unorm, SAMPLED)))),
            ("half floats", "", with(plain(&world.texture(Format::R16Float, SAMPLED)))),
            (
                "another device's depth",
                gone,
                with(plain(&other.texture(Format::Depth32Float, SAMPLED))),
            ),
            (
                "another device's floats",
                gone,
                with(plain(&other.texture(Format::R32Float, SAMPLED))),
            ),
            ("another device's stencil", gone, with(plain(&other.texture(combined, SAMPLED)))),
            ("destroyed depth", gone, with(destroyed(&world, Format::Depth32Float, SAMPLED))),
            ("destroyed floats", gone, with(destroyed(&world, Format::R32Float, SAMPLED))),
            ("destroyed stencil", gone, with(destroyed(&world, combined, SAMPLED))),
            (
                "another device's destroyed depth",
                gone,
                with(destroyed(&other, Format::Depth32Float, SAMPLED)),
            ),
            (
                "another device's destroyed stencil",
                gone,
                with(destroyed(&other, combined, SAMPLED)),
            ),
            (
                "colors",
                "depth: expected a depth format, R32Float",
                with(plain(&world.texture(Format::Rgba8Unorm, SAMPLED))),
            ),
            (
                "a stencil alone",
                "depth: expected a depth format",
                with(plain(&world.texture(Format::Stencil8, SAMPLED))),
            ),
            (
                "no usage",
                "depth: expected the usage TEXTURE_BINDING",
                with(plain(&world.texture(Format::Depth32Float, Usages::RENDER_ATTACHMENT))),
            ),
            (
                "no storage",
                "depth: expected the usage STORAGE_BINDING",
                but(Format::Rgba32Uint, SAMPLED, &|d| d.size.width = SIDE / 4),
            ),
            (
                "another size",
                "depth: expected the pyramid's size",
                but(Format::R32Float, SAMPLED, &|d| d.size.width = 8),
            ),
            (
                "mips",
                "depth: expected which of 2 mip levels, got none",
                but(Format::R32Float, SAMPLED, &|d| d.mip_level_count = 2),
            ),
            (
                "layers",
                "depth: expected which of 3 layers, got none",
                but(Format::R32Float, SAMPLED, &|d| d.size.depth_or_array_layers = 3),
            ),
            (
                "samples",
                "depth: expected one sample per pixel, got 4; record_resolve",
                but(Format::Depth32Float, both, &|d| d.sample_count = 4),
            ),
            (
                "a volume",
                "depth: expected a 2D texture",
                but(Format::R32Float, SAMPLED, &|d| d.dimension = wgpu::TextureDimension::D3),
            ),
            (
                "another context's pyramid",
                "pyramid: expected an object of this device and context",
                Box::new(|encoder| {
                    let view = plain(&world.texture(Format::R32Float, SAMPLED));
                    world.context.record_reduce(encoder, &view, &world.camera, &of_another)
                }),
            ),
            (
                "another camera",
                "camera: expected the depth image's size",
                Box::new(|encoder| {
                    let view = plain(&world.texture(Format::R32Float, SAMPLED));
                    world.context.record_reduce(encoder, &view, &smaller, &world.pyramid)
                }),
            ),
        ],
    );
}

#[test]
fn targets_that_cannot_be_drawn_into_are_refused_by_name() {
    let [world, other] = World::two();
    let depth = Format::Depth32Float;
    let usage = Usages::RENDER_ATTACHMENT;
    let into = |view: wgpu::TextureView| {
        let World { context, occluders, camera, .. } = &world;
        Box::new(move |encoder: &mut wgpu::CommandEncoder| {
            context
                .record_occluders(encoder, occluders, camera, &view, &DrawOptions::default())
                .map(drop)
        }) as Box<_>
    };
    let but = |usage, change: &dyn Fn(&mut wgpu::TextureDescriptor<'_>)| {
        into(plain(&world.texture_but(depth, usage, change)))
    };
    let layers = || world.texture_but(depth, usage, |d| d.size.depth_or_array_layers = 3);
    let destroyed = world.texture(depth, usage);
    let of_destroyed = plain(&destroyed);
    destroyed.destroy();
    let gone = "target: expected a view of one layer of a texture of this device \
                that has not been destroyed";
    run(
        &world,
        &[
            ("a target", "", into(plain(&world.texture(depth, usage)))),
            (
                "one layer of three",
                "",
                into(layers().create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(wgpu::TextureViewDimension::D2),
                    base_array_layer: 2,
                    array_layer_count: Some(1),
                    ..Default::default()
                })),
            ),
            ("three layers", gone, into(plain(&layers()))),
            ("another device's", gone, into(plain(&other.texture(depth, usage)))),
            ("destroyed", gone, into(of_destroyed)),
            (
                "a view without the usage",
                gone,
                into(world.texture(depth, usage | SAMPLED).create_view(
                    &wgpu::TextureViewDescriptor { usage: Some(SAMPLED), ..Default::default() },
                )),
            ),
            ("no usage", "target: expected the usage RENDER_ATTACHMENT", but(SAMPLED, &|_| ())),
            (
                "another format",
                "target: expected a Depth32Float texture",
                into(plain(&world.texture(Format::Depth16Unorm, usage))),
            ),
            (
                "another size",
                "target: expected a Depth32Float texture of the camera's size",
                but(usage, &|d| d.size.width = 8),
            ),
            (
                "samples",
                "target: expected a 2D texture of one mip level and one sample",
                but(usage, &|d| d.sample_count = 4),
            ),
            (
                "mips",
                "target: expected a 2D texture of one mip level",
                but(usage | SAMPLED, &|d| d.mip_level_count = 2),
            ),
            (
                "another context's occluders",
                "occluders: expected an object of this device and context",
                Box::new(|encoder| {
                    let view = plain(&world.texture(depth, usage));
                    world
                        .context
                        .record_occluders(
                            encoder,
                            &other.occluders,
                            &world.camera,
                            &view,
                            &DrawOptions::default(),
                        )
                        .map(drop)
                }),
            ),
        ],
    );
}

/// A world whose wall is reduced, with or without an atlas, and culled once.
/// So its pyramid keeps bindings.
fn culled(mut world: World, atlas: AtlasUse) -> (World, wgpu::Texture) {
    let options = PyramidOptions { atlas, ..PyramidOptions::default() };
    world.pyramid = world.context.create_pyramid(world.camera.size(), &options).unwrap();
    let mut encoder = world.encoder();
    let wall = world.wall(&mut encoder);
    world.reduce(&mut encoder, &plain(&wall)).unwrap();
    world.cull(&mut encoder, &CullOptions::default()).unwrap();
    assert_eq!(world.mask(encoder, &world.visible), 0b01);
    (world, wall)
}

#[test]
fn a_cull_of_what_was_destroyed_is_refused_by_name() {
    for atlas in [AtlasUse::Never, AtlasUse::Always] {
        for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
            let (world, wall) = culled(World::new(), atlas);
            let options = CullOptions { hierarchy, ..CullOptions::default() };
            wall.destroy();
            let gone = "pyramid: expected one whose depth image has not been destroyed";
            run(
                &world,
                &[("the depth image", gone, Box::new(|encoder| world.cull(encoder, &options)))],
            );
        }
    }
    let (world, _) = culled(World::new(), AtlasUse::Never);
    let gone = "visible: expected buffers that have not been destroyed";
    for order in [Order::Stable, Order::Any] {
        let options = CullOptions { order, ..CullOptions::default() };
        for part in 0..3 {
            let visible =
                world.context.create_visible(&world.instances, &Outputs::default()).unwrap();
            let buffers = [visible.draw_arguments(), visible.list(0), visible.mask(0)];
            buffers[part].expect("all outputs").destroy();
            let World { context, instances, camera, pyramid, .. } = &world;
            let cull = |encoder: &mut wgpu::CommandEncoder| {
                context.record_cull(encoder, instances, camera, pyramid, &visible, &options)
            };
            run(&world, &[("a buffer", gone, Box::new(cull))]);
        }
    }
}

#[test]
fn culls_of_what_does_not_belong_are_refused_by_name() {
    let [world, other] = World::two();
    let (world, _) = culled(world, AtlasUse::Auto);
    let never_built =
        world.context.create_pyramid(world.camera.size(), &PyramidOptions::default()).unwrap();
    let reversed = camera_along_z(SIDE, SIDE, DepthConvention::Reversed);
    let mut encoder = world.encoder();
    let single =
        Bounds::Spheres { centers: Floats::F32(&[0.0, 0.0, 8.0]), radii: Floats::F32(&[1.0]) };
    let single =
        world.context.record_instances(&mut encoder, &single, &InstanceOptions::default()).unwrap();
    world.works(encoder, "an upload");
    let of_single = world.context.create_visible(&single, &Outputs::default()).unwrap();
    let cull = |instances, camera, pyramid, visible| {
        let context = &world.context;
        Box::new(move |encoder: &mut wgpu::CommandEncoder| {
            context.record_cull(
                encoder,
                instances,
                camera,
                pyramid,
                visible,
                &CullOptions::default(),
            )
        }) as Box<_>
    };
    let World { context, instances, camera, pyramid, visible, .. } = &world;
    let options = |options: CullOptions| {
        let world = &world;
        Box::new(move |encoder: &mut wgpu::CommandEncoder| world.cull(encoder, &options)) as Box<_>
    };
    let plain = CullOptions::default;
    let theirs = Bounds::Spheres { centers: Floats::F32(&[0.0; 3]), radii: Floats::F32(&[1.0]) };
    let update = |instances, first, bounds| {
        Box::new(move |encoder: &mut wgpu::CommandEncoder| {
            context.record_update(encoder, instances, first, bounds, false)
        }) as Box<_>
    };
    let boxes =
        |centers: Floats<'static>, radii: Floats<'static>, options: InstanceOptions<'static>| {
            Box::new(move |encoder: &mut wgpu::CommandEncoder| {
                context
                    .record_instances(encoder, &Bounds::Spheres { centers, radii }, &options)
                    .map(drop)
            }) as Box<_>
        };
    let stranger = other.bounds_buffer(48);
    run(
        &world,
        &[
            (
                "instances of another device",
                "instances: expected an object of this device",
                cull(&other.instances, camera, pyramid, visible),
            ),
            (
                "a pyramid of another device",
                "pyramid: expected an object of this device",
                cull(instances, camera, &other.pyramid, visible),
            ),
            (
                "outputs of another device",
                "visible: expected an object of this device",
                cull(instances, camera, pyramid, &other.visible),
            ),
            (
                "outputs of other instances",
                "visible: expected buffers that were created for these",
                cull(instances, camera, pyramid, &of_single),
            ),
            (
                "no reduction",
                "pyramid: expected one that was built",
                cull(instances, camera, &never_built, visible),
            ),
            (
                "another camera",
                "camera: expected the camera of the pyramid's depth image",
                cull(instances, &reversed, pyramid, visible),
            ),
            (
                "slack",
                "depth_slack: expected a number in 0..=0.5",
                options(CullOptions { depth_slack: -1.0, ..plain() }),
            ),
            (
                "guard",
                "guard_px: expected",
                options(CullOptions { guard_px: Some(0.3), ..plain() }),
            ),
            (
                "descent",
                "descent: expected a number in 0..=65536",
                options(CullOptions { descent: 65_537, ..plain() }),
            ),
            (
                "an update of another device's",
                "instances: expected an object",
                update(&other.instances, 0, &TWO_BOXES),
            ),
            (
                "an update of another kind",
                "bounds: expected the instances' kind",
                update(instances, 0, &theirs),
            ),
            (
                "another device's buffer",
                "buffer: expected a buffer of this device that has not been destroyed",
                Box::new(|encoder| context.record_update_from(encoder, instances, &stranger)),
            ),
            (
                "an update past the end",
                "bounds: expected at most 1 from instance 1 on",
                update(instances, 1, &TWO_BOXES),
            ),
            (
                "an update beyond the end",
                "first: expected a number in 0..=2",
                update(instances, 3, &TWO_BOXES),
            ),
            (
                "centers and radii",
                "radii: ",
                boxes(Floats::F32(&[0.0; 6]), Floats::F32(&[1.0]), InstanceOptions::default()),
            ),
            (
                "a piece's capacity",
                "piece_capacity: expected a multiple",
                boxes(
                    Floats::F32(&[0.0; 3]),
                    Floats::F32(&[1.0]),
                    InstanceOptions { piece_capacity: Some(1), ..InstanceOptions::default() },
                ),
            ),
            (
                "strict",
                "bounds: expected finite numbers",
                boxes(
                    Floats::F32(&[f32::NAN; 3]),
                    Floats::F32(&[1.0]),
                    InstanceOptions { strict: true, ..InstanceOptions::default() },
                ),
            ),
        ],
    );
}

#[test]
fn what_cannot_be_made_is_refused_by_name() {
    let [world, other] = World::two();
    let context = &world.context;
    let pyramid = |width, height, options: PyramidOptions| {
        Box::new(move |_: &mut wgpu::CommandEncoder| {
            context.create_pyramid(ImageSize::new(width, height), &options).map(drop)
        }) as Box<_>
    };
    let visible = |instances, draw| {
        Box::new(move |_: &mut wgpu::CommandEncoder| {
            context.create_visible(instances, &Outputs { draw, ..Outputs::default() }).map(drop)
        }) as Box<_>
    };
    let occluders = |mesh: MeshData<'static>| {
        Box::new(move |_: &mut wgpu::CommandEncoder| {
            context.create_occluders(&[mesh], &OccluderOptions::default()).map(drop)
        }) as Box<_>
    };
    let first = DrawTemplate { first_instance: 7, ..DrawTemplate::default() };
    run(
        &world,
        &[
            (
                "no pixels",
                "size: expected at least one pixel a side",
                pyramid(0, 4, PyramidOptions::default()),
            ),
            (
                "too many",
                "max_texture_dimension_2d: requested 8193",
                pyramid(8193, 1, PyramidOptions::default()),
            ),
            (
                "chunks",
                "chunk_shift: expected 2 to",
                pyramid(
                    4,
                    4,
                    PyramidOptions { chunk_shift: Some(40), ..PyramidOptions::default() },
                ),
            ),
            (
                "levels",
                "levels: expected",
                pyramid(
                    4,
                    4,
                    PyramidOptions {
                        levels: StoredLevels { first: 0, last: 3 },
                        ..PyramidOptions::default()
                    },
                ),
            ),
            (
                "too many chunks",
                "pyramid texels: requested",
                pyramid(
                    64,
                    64,
                    PyramidOptions { chunk_shift: Some(2), ..PyramidOptions::default() },
                ),
            ),
            (
                "a first instance",
                "first_instance: expected 0 on a device without the feature \
                 INDIRECT_FIRST_INSTANCE, got 7",
                visible(&world.instances, first),
            ),
            (
                "outputs of another device",
                "instances: expected an object of this device",
                visible(&other.instances, DrawTemplate::default()),
            ),
            (
                "an index",
                "triangles: expected indices below the 4",
                occluders(MeshData { triangles: &[0, 1, 4], ..WALL }),
            ),
            (
                "two indices",
                "triangles: expected 3 indices",
                occluders(MeshData { triangles: &[0, 1], ..WALL }),
            ),
            (
                "transforms",
                "transforms: expected 16 numbers",
                occluders(MeshData { transforms: Some(Floats::F32(&[1.0])), ..WALL }),
            ),
            (
                "vertices",
                "vertices: expected finite positions",
                occluders(MeshData { vertices: Floats::F32(&[f32::NAN; 12]), ..WALL }),
            ),
            ("no triangle", "", occluders(MeshData { triangles: &[], ..WALL })),
            (
                "no vertex",
                "",
                occluders(MeshData { vertices: Floats::F32(&[]), triangles: &[], ..WALL }),
            ),
        ],
    );
    // With the feature it is accepted.
    let features = wgpu::Features::INDIRECT_FIRST_INSTANCE;
    let world = World::on(open(&adapter(), features, &HizContext::required_limits()));
    world
        .context
        .create_visible(&world.instances, &Outputs { draw: first, ..Outputs::default() })
        .unwrap();
}

/// No instances, no triangles, one pixel; with every output, order and way.
#[test]
fn nothing_at_all_is_drawn_reduced_and_culled() {
    let mut world = World::new();
    world.camera = camera_along_z(1, 1, STANDARD);
    world.pyramid =
        world.context.create_pyramid(world.camera.size(), &PyramidOptions::default()).unwrap();
    let mut encoder = world.encoder();
    let nothing = Bounds::Boxes { min: Floats::F32(&[]), max: Floats::F32(&[]) };
    world.instances = world
        .context
        .record_instances(&mut encoder, &nothing, &InstanceOptions::default())
        .unwrap();
    world.visible = world.context.create_visible(&world.instances, &Outputs::default()).unwrap();
    world.context.record_update(&mut encoder, &world.instances, 0, &nothing, true).unwrap();
    let no_mesh = world.context.create_occluders(&[], &OccluderOptions::default()).unwrap();
    let target =
        world.texture_but(Format::Depth32Float, Usages::RENDER_ATTACHMENT | SAMPLED, |d| {
            (d.size.width, d.size.height) = (1, 1);
        });
    world
        .context
        .record_occluders(
            &mut encoder,
            &no_mesh,
            &world.camera,
            &plain(&target),
            &DrawOptions::default(),
        )
        .unwrap();
    world.reduce(&mut encoder, &plain(&target)).unwrap();
    for order in [Order::Stable, Order::Any] {
        for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
            let options =
                CullOptions { order, hierarchy, statistics: true, ..CullOptions::default() };
            world.cull(&mut encoder, &options).unwrap();
        }
    }
    assert_eq!(world.mask(encoder, &world.visible), 0);
}

/// When a device is lost nothing panics, whatever is returned.
#[test]
fn a_lost_device_ends_nothing() {
    let (world, wall) = culled(World::new(), AtlasUse::Never);
    let (view, mut encoder) = (plain(&wall), world.encoder());
    let buffer = world.bounds_buffer(48);
    world.device.destroy();
    let World { context, instances, occluders, camera, .. } = &world;
    let outcomes = [
        world.reduce(&mut encoder, &view),
        world.cull(&mut encoder, &CullOptions::default()),
        context
            .record_occluders(&mut encoder, occluders, camera, &view, &DrawOptions::default())
            .map(drop),
        context.record_update(&mut encoder, instances, 0, &TWO_BOXES, true),
        context.record_update_from(&mut encoder, instances, &buffer),
        context.record_instances(&mut encoder, &TWO_BOXES, &InstanceOptions::default()).map(drop),
        context.create_occluders(&[WALL], &OccluderOptions::default()).map(drop),
        context.create_pyramid(camera.size(), &PyramidOptions::default()).map(drop),
        context.create_visible(instances, &Outputs::default()).map(drop),
        HizContext::new(&world.device).map(drop),
    ];
    for (i, outcome) in outcomes.into_iter().enumerate() {
        // Some calls cannot notice the loss; those that need mapped memory do.
        assert!(outcome.is_ok() || matches!(outcome, Err(Error::Device(_))), "{i}: {outcome:?}");
    }
    drop(encoder.finish());
}

/// wgpu reports an encoder of another device when it is finished.
/// An encoder with an open pass is reported at once or when it is finished.
/// Nothing panics here, and the devices can still be used.
#[test]
fn encoders_that_cannot_be_used_are_told_of() {
    let [world, other] = World::two();
    let (world, wall) = culled(world, AtlasUse::Never);
    let mut encoder = other.encoder();
    world.reduce(&mut encoder, &plain(&wall)).unwrap();
    world.cull(&mut encoder, &CullOptions::default()).unwrap();
    let fails = |world: &World, encoder: wgpu::CommandEncoder| {
        let scope = world.device.push_error_scope(wgpu::ErrorFilter::Validation);
        drop(encoder.finish());
        pollster::block_on(scope.pop()).is_some()
    };
    assert!(fails(&other, encoder));
    let World { context, instances, occluders, camera, .. } = &world;
    let view = plain(&wall);
    type Act<'a> = &'a dyn Fn(&mut wgpu::CommandEncoder) -> Result<()>;
    let buffer = world.bounds_buffer(48);
    let acts: [Act<'_>; 6] = [
        &|encoder| world.reduce(encoder, &view),
        &|encoder| world.cull(encoder, &CullOptions::default()),
        &|encoder| {
            context
                .record_occluders(encoder, occluders, camera, &view, &DrawOptions::default())
                .map(drop)
        },
        &|encoder| context.record_update(encoder, instances, 0, &TWO_BOXES, true),
        &|encoder| {
            context.record_instances(encoder, &TWO_BOXES, &InstanceOptions::default()).map(drop)
        },
        &|encoder| context.record_update_from(encoder, instances, &buffer),
    ];
    for (i, act) in acts.iter().enumerate() {
        let mut encoder = world.encoder();
        let pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default()).forget_lifetime();
        let outcome = act(&mut encoder);
        // Where copies are recorded first, wgpu reports it later.
        if [2, 3, 5].contains(&i) {
            let text = outcome.unwrap_err().to_string();
            assert!(
                text.starts_with("encoder: expected one of this device without an open pass, but"),
                "{i}: {text}"
            );
        }
        let scope = world.device.push_error_scope(wgpu::ErrorFilter::Validation);
        drop(pass);
        drop(pollster::block_on(scope.pop()));
        assert!(fails(&world, encoder));
    }
    world.works(world.encoder(), "this device");
    other.works(other.encoder(), "the other one");
}

/// The least of each limit that the shaders need.
/// They are counted by hand from `gpu/layouts.rs` and `shaders/`.
fn least() -> wgpu::Limits {
    wgpu::Limits {
        max_texture_dimension_2d: 4096,
        max_bind_groups: 4,
        max_bind_groups_plus_vertex_buffers: 4,
        max_bindings_per_bind_group: 7,
        max_sampled_textures_per_shader_stage: 4,
        max_samplers_per_shader_stage: 1,
        max_storage_buffers_per_shader_stage: 8,
        max_storage_textures_per_shader_stage: 4,
        max_uniform_buffers_per_shader_stage: 4,
        max_uniform_buffer_binding_size: 528,
        max_storage_buffer_binding_size: 8192,
        max_buffer_size: 65_536,
        max_vertex_buffers: 2,
        max_vertex_attributes: 8,
        max_vertex_buffer_array_stride: 88,
        max_inter_stage_shader_variables: 1,
        max_compute_workgroup_storage_size: 1024,
        max_compute_invocations_per_workgroup: 256,
        max_compute_workgroup_size_x: 256,
        max_compute_workgroup_size_y: 1,
        max_compute_workgroup_size_z: 1,
        max_compute_workgroups_per_dimension: 65_535,
        // Limits that nothing here needs.
        max_texture_dimension_1d: 1,
        max_texture_dimension_3d: 1,
        max_texture_array_layers: 1,
        max_dynamic_uniform_buffers_per_pipeline_layout: 0,
        max_dynamic_storage_buffers_per_pipeline_layout: 0,
        max_color_attachments: 0,
        max_color_attachment_bytes_per_sample: 0,
        ..wgpu::Limits::default()
    }
}

type Lower = (&'static str, fn(&mut wgpu::Limits));

#[test]
fn devices_with_less_than_the_shaders_need_are_refused() {
    macro_rules! one_less {
        ($($name:ident),* $(,)?) => {
            [$((stringify!($name), |limits: &mut wgpu::Limits| limits.$name -= 1)),*]
        };
    }
    let all: [Lower; 22] = one_less![
        max_texture_dimension_2d,
        max_bind_groups,
        max_bind_groups_plus_vertex_buffers,
        max_bindings_per_bind_group,
        max_sampled_textures_per_shader_stage,
        max_samplers_per_shader_stage,
        max_storage_buffers_per_shader_stage,
        max_storage_textures_per_shader_stage,
        max_uniform_buffers_per_shader_stage,
        max_uniform_buffer_binding_size,
        max_storage_buffer_binding_size,
        max_buffer_size,
        max_vertex_buffers,
        max_vertex_attributes,
        max_vertex_buffer_array_stride,
        max_inter_stage_shader_variables,
        max_compute_workgroup_storage_size,
        max_compute_invocations_per_workgroup,
        max_compute_workgroup_size_x,
        max_compute_workgroup_size_y,
        max_compute_workgroup_size_z,
        max_compute_workgroups_per_dimension,
    ];
    let adapter = adapter();
    for (name, lower) in all {
        let mut limits = least();
        lower(&mut limits);
        let (device, _queue) = open(&adapter, wgpu::Features::empty(), &limits);
        let error = HizContext::new(&device).unwrap_err();
        assert!(
            matches!(&error, Error::Limit { name: limit, .. } if limit == name),
            "{name}: {error}"
        );
    }
}

/// Everything runs on a device with only the required limits.
#[test]
fn the_least_limits_are_enough_for_everything() {
    let world = World::on(open(&adapter(), wgpu::Features::empty(), &least()));
    world.works(world.encoder(), "a plain cull");
    let context = &world.context;
    // Each source once, and each kind of bounds.
    let sources = [
        (Format::Depth32Float, SAMPLED, SIDE, BoundsKind::Sphere),
        (Format::R32Float, SAMPLED, SIDE, BoundsKind::Box),
        (Format::Rgba32Uint, Usages::STORAGE_BINDING, SIDE / 4, BoundsKind::OrientedBox),
        (Format::R32Float, SAMPLED, SIDE, BoundsKind::Point),
    ];
    for (format, usage, width, kind) in sources {
        let image = world.texture_but(format, usage | Usages::COPY_SRC, |d| d.size.width = width);
        // Several pieces: more than a row of records.
        let n = 3000;
        let (centers, sizes) = (vec![8.0_f32; 3 * n], vec![1.0_f32; 3 * n]);
        let bounds = match kind {
            BoundsKind::Sphere => {
                Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&sizes[..n]) }
            }
            BoundsKind::Box => {
                Bounds::Boxes { min: Floats::F32(&sizes), max: Floats::F32(&centers) }
            }
            BoundsKind::OrientedBox => Bounds::OrientedBoxes {
                centers: Floats::F32(&centers),
                half_sizes: Floats::F32(&sizes),
                rotations: Floats::F32(&vec![0.5; 9 * n]),
            },
            BoundsKind::Point | BoundsKind::WidePoint => {
                Bounds::Points { positions: Floats::F32(&centers) }
            }
        };
        let mut encoder = world.encoder();
        let instances =
            context.record_instances(&mut encoder, &bounds, &InstanceOptions::default()).unwrap();
        context.record_update(&mut encoder, &instances, 0, &bounds, false).unwrap();
        if kind != BoundsKind::OrientedBox {
            let buffer = world.bounds_buffer(8192);
            let count = 8192 / 24;
            context.record_instances_from(&mut encoder, &buffer, kind, count).unwrap();
        }
        let visible = context.create_visible(&instances, &Outputs::default()).unwrap();
        for atlas in [AtlasUse::Never, AtlasUse::Always] {
            let options = PyramidOptions { atlas, ..PyramidOptions::default() };
            let pyramid = context.create_pyramid(world.camera.size(), &options).unwrap();
            context.record_reduce(&mut encoder, &plain(&image), &world.camera, &pyramid).unwrap();
            for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
                for order in [Order::Stable, Order::Any] {
                    let footprint = Footprint::Four;
                    let options = CullOptions {
                        hierarchy,
                        order,
                        footprint,
                        statistics: true,
                        ..CullOptions::default()
                    };
                    context
                        .record_cull(
                            &mut encoder,
                            &instances,
                            &world.camera,
                            &pyramid,
                            &visible,
                            &options,
                        )
                        .unwrap();
                }
            }
        }
        world.works(encoder, &format!("{format:?} {kind:?}"));
    }
    // Beyond these limits there are named errors.
    let many = vec![0.0_f32; 3 * 3000];
    let mesh = MeshData { vertices: Floats::F32(&many), triangles: &[0, 1, 2], transforms: None };
    let error = context.create_occluders(&[mesh], &OccluderOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "max_buffer_size: requested 72000, the device allows 65536");
    let error =
        context.create_pyramid(ImageSize::new(4096, 4096), &PyramidOptions::default()).unwrap_err();
    assert!(error.to_string().starts_with("pyramid texels: requested"), "{error}");
}

/// An update of more records than a storage binding holds is split into bands.
/// The device has the results of all of them.
#[test]
fn an_update_larger_than_a_binding_reaches_every_instance() {
    // 256 spheres of 32 bytes per band.
    let world = World::on(open(&adapter(), wgpu::Features::empty(), &least()));
    let context = &world.context;
    let count = 1000;
    let random: Vec<[f32; 2]> = {
        let mut random = common::Random(11);
        (0..count)
            .map(|_| [random.range(-0.5, 0.5) as f32, random.range(-0.5, 0.5) as f32])
            .collect()
    };
    let at = |z: f32| -> Vec<f32> { random.iter().flat_map(|[x, y]| [x * z, y * z, z]).collect() };
    let radii = vec![0.01_f32; count];
    let (near, far) = (at(2.0), at(8.0));
    for order in [StoredOrder::Morton, StoredOrder::Given] {
        let mut encoder = world.encoder();
        let before = Bounds::Spheres { centers: Floats::F32(&far), radii: Floats::F32(&radii) };
        let options = InstanceOptions { order, ..InstanceOptions::default() };
        let instances = context.record_instances(&mut encoder, &before, &options).unwrap();
        // All but the first 40 and the last 40 move in front of the wall.
        let range = 40..count - 40;
        let after = Bounds::Spheres {
            centers: Floats::F32(&near[3 * range.start..3 * range.end]),
            radii: Floats::F32(&radii[range.clone()]),
        };
        context.record_update(&mut encoder, &instances, 40, &after, true).unwrap();
        let wall = world.wall(&mut encoder);
        world.reduce(&mut encoder, &plain(&wall)).unwrap();
        for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
            let visible = context.create_visible(&instances, &Outputs::default()).unwrap();
            let mut encoder = std::mem::replace(&mut encoder, world.encoder());
            let options = CullOptions { hierarchy, ..CullOptions::default() };
            context
                .record_cull(
                    &mut encoder,
                    &instances,
                    &world.camera,
                    &world.pyramid,
                    &visible,
                    &options,
                )
                .unwrap();
            let staging = world.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("test.mask"),
                size: 128,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            encoder.copy_buffer_to_buffer(visible.mask(0).expect("a mask"), 0, &staging, 0, 128);
            world.queue.submit([encoder.finish()]);
            staging.map_async(wgpu::MapMode::Read, .., |_| {});
            world.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
            let bytes = staging.get_mapped_range(..).unwrap();
            let kept: Vec<bool> = (0..count).map(|i| bytes[i / 8] >> (i % 8) & 1 == 1).collect();
            let expected: Vec<bool> = (0..count).map(|i| range.contains(&i)).collect();
            assert_eq!(kept, expected, "{order:?} {hierarchy:?}");
        }
    }
}
