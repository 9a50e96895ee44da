//! What wgpu's validation would find wrong in the library's own calls is returned as an error.
//! That error names the parameter.
//! Devices here have wgpu's own error handler, which ends the process.
//! So an error that reaches it fails the test.
//! After each error the same encoder is finished and submitted.
//! The same device then culls as before.

#[path = "../common/mod.rs"]
mod common;
mod culls;
mod depth;
mod limits;
mod made;

use hiz_core::wgpu::{TextureFormat as Format, TextureUsages as Usages};
use hiz_core::{
    Bounds, Camera, CullOptions, DepthConvention, DrawOptions, Error, FaceCull, Floats, HizContext,
    InstanceOptions, Instances, MeshData, OccluderOptions, Occluders, Outputs, Pyramid,
    PyramidOptions, Result, Visible, wgpu,
};

use crate::common::{camera_along_z, depth_descriptor};

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
