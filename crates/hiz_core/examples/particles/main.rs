//! A million unsorted particles of one pixel each, which ask one coarse level first.
//!
//! ```text
//! cargo run --release --example particles
//! ```
//!
//! A particle nearer than the nearest depth of its texel shows, and one behind the farthest does
//! not: neither reads the depth image.
//! After Mike Turitzin, Hierarchical Depth Buffers (2020), who tests the nearest depth.
//! The picture is the same to the bit; `tests/examples.rs` checks that on a small one.

mod particles;

use std::error::Error;

use hiz_core::ImageSize;
use hiz_core::wgpu;

fn main() -> Result<(), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    println!("{}", adapter.get_info().name);
    for (level, soft) in [3, 4, 5].into_iter().flat_map(|level| [(level, false), (level, true)]) {
        let size = ImageSize::new(1280, 720);
        let setup = particles::Setup { size, particles: 1_000_000, level, soft, rounds: 12 };
        let found = particles::run(&device, &queue, setup, &[])?;
        let [all, before, behind] = found.counts;
        let [plain, coarse] = found.ms;
        let pixels = if soft { "2x2 pixels" } else { "1 pixel" };
        let same = found.pictures[0] == found.pictures[1];
        println!(
            "level {level}, {pixels} per test: of {all} particles in the image {before} lie before \
             all of a texel and {behind} behind it: {:.1} % skip the depth image; {coarse:.2} of \
             {plain:.2} ms, {:.2} times; pictures equal: {same}",
            1e2 * found.skipped(),
            coarse / plain
        );
    }
    Ok(())
}
