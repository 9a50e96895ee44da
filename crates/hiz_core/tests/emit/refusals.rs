//! Tables, ids and records that are refused by name.

use std::sync::Arc;

use hiz_core::{
    Bounds, CullOptions, DrawTemplate, Emit, Error, Floats, HizContext, InstanceOptions, Instances,
    Lod, MeshLods, Order, Outputs, Placement, VertexDraw, wgpu,
};

use crate::{Crowd, World};

/// What cannot be used is refused by name.
#[test]
fn bad_tables_ids_and_records_are_refused() {
    let world = World::new(&[]);
    let hiz = world.engine.context();
    let draw = DrawTemplate { index_count: 3, ..DrawTemplate::default() };
    let lod = |error: f64| Lod::new(draw, error);
    let refused = |lods: &[&[Lod]]| {
        let meshes: Vec<_> = lods.iter().map(|lods| MeshLods::new(lods)).collect();
        hiz.create_mesh_table(&meshes).unwrap_err()
    };
    assert_eq!(refused(&[]).to_string(), "meshes: expected at least one mesh, got none");
    assert!(refused(&[&[]]).to_string().contains("mesh 0 has none"));
    assert_eq!(
        refused(&[&[lod(0.0)], &[lod(0.0); 9]]),
        Error::Limit { name: "levels of detail of mesh 1".into(), requested: 9, allowed: 8 }
    );
    for error in [-1.0, f64::NAN, f64::INFINITY] {
        let text = refused(&[&[lod(error)]]).to_string();
        assert!(text.starts_with("error: expected errors from 0 on"), "{text}");
    }
    let vertices = Lod::new(VertexDraw { vertex_count: 3, first_vertex: 0 }, 0.0);
    assert!(refused(&[&[lod(0.0)], &[vertices]]).to_string().starts_with("draw: expected"));
    let moved = Lod::new(DrawTemplate { first_instance: 1, ..draw }, 0.0);
    assert!(refused(&[&[moved]]).to_string().starts_with("first_instance: expected 0"));

    let centers = [0.0_f32; 6];
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&[1.0; 2]) };
    let upload = |ids: Option<&[u32]>, scales: Option<&[f64]>| {
        let scales = scales.map(Floats::F64);
        let options = InstanceOptions { mesh_ids: ids, scales, ..InstanceOptions::default() };
        world.engine.instances(&bounds, &options)
    };
    let text = upload(Some(&[0]), None).unwrap_err().to_string();
    assert_eq!(text, "mesh_ids: expected one per instance, which are 2, got 1");
    let text = upload(None, Some(&[1.0, -1.0])).unwrap_err().to_string();
    assert!(text.starts_with("scales: expected numbers from 0 on") && text.ends_with("index 1"));
    assert!(matches!(upload(Some(&[0, 1 << 20]), None), Err(Error::Limit { .. })));
    let instances = upload(Some(&[0, 5]), None).unwrap();
    let meshes = world.table(&[1; 5], true);
    let visible = |instances: &Instances, emit: Emit| {
        hiz.create_visible(instances, &Outputs { draws: true, emit, ..Outputs::NONE })
    };
    let binned = |placement| Emit::Binned { meshes: meshes.clone(), placement };
    let text = visible(&instances, binned(Placement::Packed)).unwrap_err().to_string();
    assert_eq!(text, "mesh_ids: expected ids below 5, the number of meshes, got 5");

    // Bins belong to the ids of their instances, and in any order to one mesh.
    let [first, second] = [0, 1].map(|id| upload(Some(&[id, 1]), None).unwrap());
    let packed = visible(&first, binned(Placement::Packed)).unwrap();
    let crowd = |instances: &Arc<Instances>| Crowd {
        made: Vec::new(),
        instances: Arc::clone(instances),
        piece: 2,
    };
    let error = world.cull(&crowd(&second), &packed, &CullOptions::default()).unwrap_err();
    assert!(error.to_string().starts_with("visible: expected buffers that were created for these"));
    let any = CullOptions { order: Order::Any, ..CullOptions::default() };
    for placement in [Placement::Packed, Placement::Reserved] {
        let visible = visible(&first, binned(placement)).unwrap();
        let text = world.cull(&crowd(&first), &visible, &any).unwrap_err().to_string();
        assert!(text.starts_with("order: expected Order::Stable, got Order::Any"), "{text}");
    }

    let buffer = |size, usage| {
        let (label, mapped_at_creation) = (None, false);
        let descriptor = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation };
        world.engine.device().create_buffer(&descriptor)
    };
    let storage = wgpu::BufferUsages::STORAGE;
    let copy = |records: wgpu::Buffer, stride| {
        visible(&first, Emit::Copy { records, stride }).unwrap_err().to_string()
    };
    for stride in [0, 2, 6, 260] {
        assert!(copy(buffer(4096, storage), stride).starts_with("stride: expected 4 to 256"));
    }
    assert!(copy(buffer(12, storage), 8).starts_with("records: expected 16 bytes, which are 8"));
    let text = copy(buffer(64, wgpu::BufferUsages::VERTEX), 8);
    assert!(text.starts_with("records: expected the usage STORAGE"), "{text}");
}

/// Without the feature, what sets `first_instance` is refused, and reserved bins work.
#[test]
fn packed_bins_need_first_instances() {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let request = wgpu::RequestAdapterOptions::default();
    let adapter = pollster::block_on(instance.request_adapter(&request)).expect("a driver");
    let descriptor = wgpu::DeviceDescriptor::default();
    let (device, queue) =
        pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
    let hiz = HizContext::new(&device).unwrap();
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let bounds = Bounds::Spheres { centers: Floats::F32(&[0.0; 3]), radii: Floats::F32(&[1.0]) };
    let instances =
        hiz.record_instances(&mut encoder, &bounds, &InstanceOptions::default()).unwrap();
    queue.submit([encoder.finish()]);
    let draw = DrawTemplate { index_count: 3, ..DrawTemplate::default() };
    let meshes = hiz.create_mesh_table(&[MeshLods::new(&[Lod::new(draw, 0.0)])]).unwrap();
    let visible =
        |emit| hiz.create_visible(&instances, &Outputs { draws: true, emit, ..Outputs::NONE });
    let packed = Emit::Binned { meshes: meshes.clone(), placement: Placement::Packed };
    let text = visible(packed).unwrap_err().to_string();
    assert!(text.starts_with("placement: expected a device with the feature INDIRECT_FIRST"));
    assert!(text.ends_with("or use Placement::Reserved"), "{text}");
    let text = visible(Emit::Instances { meshes: meshes.clone() }).unwrap_err().to_string();
    assert!(text.starts_with("emit: expected a device with the feature INDIRECT_FIRST_INSTANCE"));
    let reserved = Emit::Binned { meshes, placement: Placement::Reserved };
    assert!(visible(reserved).is_ok());
}
