// The choice of a level of detail where no mesh has more than one.

fn lod_of(volume: Volume, mesh: u32, scale: f32, count: u32) -> u32 {
    return 0u;
}
