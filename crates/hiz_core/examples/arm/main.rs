//! ARM's scene: spheres among prisms, culled with a depth image of 256x256 pixels, and checked by
//! rays of a larger picture.
//!
//! ```text
//! cargo run --example arm
//! ```
//!
//! First the spheres rest.
//! The conservative image culls no sphere that a ray sees; a plain one culls some.
//! Then a shader moves all spheres in every frame, and the library takes their bounds from its
//! buffer.
//!
//! - `scene.rs` has the prisms, the spheres and the camera.
//! - `moving.rs` has the shader that moves the spheres.
//! - `culled.rs` culls them.
//! - `truth.rs` casts the rays.
//!
//! `tests/arm.rs` runs the same code.

mod culled;
mod moving;
mod scene;
mod truth;

use std::error::Error;

use culled::{Depth, From, SIDES, Tally};
use hiz_core::ImageSize;
use hiz_core::headless::Engine;

fn main() -> Result<(), Box<dyn Error>> {
    let engine = Engine::new(None)?;
    let picture = ImageSize::new(1280, 720);
    println!("adapter: {}", engine.adapter());
    println!("rays: through the {}x{} pixels of the picture", picture.width, picture.height);
    println!("{:>24}  {:>8} {:>8} {:>8}  seen, but culled", "", "spheres", "kept", "seen");
    let mut failed = false;
    for kind in [Depth::Conservative, Depth::Plain] {
        for azimuth in SIDES {
            let tally = culled::at_rest(&engine, azimuth, picture, kind)?;
            print(&format!("{kind:?}, {azimuth} degrees"), &tally);
            failed |= kind == Depth::Conservative && tally.false_culls > 0;
        }
    }
    let tally = culled::moving(&engine, From::Buffer, 60, picture)?;
    print("60 frames, moved", &tally);
    println!("{:>24}  {} of {} culled", "invalid bounds", tally.invalid_culls, tally.invalid);
    failed |= tally.false_culls + tally.invalid_culls > 0;
    if failed { Err("a sphere was culled that has to be kept".into()) } else { Ok(()) }
}

fn print(name: &str, tally: &Tally) {
    let Tally { tested, kept, seen, false_culls, .. } = tally;
    println!("{name:>24}  {tested:>8} {kept:>8} {seen:>8}  {false_culls}");
}
