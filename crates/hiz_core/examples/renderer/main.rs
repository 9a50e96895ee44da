//! A renderer with its own device draws three scenes, with culling and without, and compares the
//! pictures.
//!
//! ```text
//! cargo run --example renderer [FOLDER]
//! ```
//!
//! The pictures land in FOLDER, by default `out/renderer`.
//! They show what was drawn with culling, and the body at each pixel.
//!
//! - `renderer.rs` shows how the crate is embedded.
//! - `scene.rs` says what a scene is.
//! - `town.rs`, `rooms.rs` and `field.rs` are the three scenes.
//!
//! `tests/renderer.rs` runs the same code.
//! `examples/simple.rs` is shorter, and draws one frame.

mod field;
#[allow(dead_code, reason = "its test reads more of it")]
mod renderer;
mod rooms;
#[allow(dead_code, reason = "its test reads more of it")]
mod scene;
mod town;

use std::error::Error;
use std::path::{Path, PathBuf};

use hiz_core::ImageSize;
use renderer::{Picture, Renderer};
use scene::{Scene, Shot};

fn main() -> Result<(), Box<dyn Error>> {
    let folder =
        std::env::args_os().nth(1).map_or_else(|| PathBuf::from("out/renderer"), PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    let renderer = Renderer::open(&[])?;
    println!(
        "adapter: {} ({} {})",
        renderer.adapter.name, renderer.adapter.driver, renderer.adapter.driver_info
    );
    println!(
        "{:>22}  {:>9}  {:>9} {:>6} {:>8} {:>7}  differing pixels",
        "camera", "image", "instances", "kept", "occluded", "outside"
    );
    let mut differing_in_all = 0;
    for (scene, shots) in scenes_and_shots(ImageSize::new(640, 360))? {
        let stage = renderer.build(&scene)?;
        for shot in shots {
            let size = shot.camera.size();
            let all = renderer.draw_all(&stage, &shot);
            let culled =
                renderer.draw_culled(&stage, &shot, &renderer.cull_options(&shot.camera))?;
            let differing = all.differing_pixels(&culled.picture);
            differing_in_all += differing;
            let (counts, image) = (culled.counts, format!("{}x{}", size.width, size.height));
            println!(
                "{:>22}  {image:>9}  {:>9} {:>6} {:>8} {:>7}  {differing}",
                shot.name,
                counts.kept + counts.occluded + counts.outside,
                counts.kept,
                counts.occluded,
                counts.outside,
            );
            let path = |what| folder.join(format!("{}_{image}{what}.png", shot.name));
            save(&path(""), &culled.picture, &culled.picture.colour)?;
            save(&path("_ids"), &culled.picture, &id_colours(&culled.picture))?;
        }
    }
    println!("pictures: {}", folder.display());
    if differing_in_all == 0 {
        Ok(())
    } else {
        Err(format!("{differing_in_all} pixels differ").into())
    }
}

/// The scenes at the world's origin, each with its cameras.
fn scenes_and_shots(size: ImageSize) -> hiz_core::Result<[(Scene, Vec<Shot>); 3]> {
    let origin = [0.0; 3];
    Ok([
        (town::scene(origin), town::shots(origin, size)?),
        (rooms::scene(origin), rooms::shots(origin, size)?),
        (field::scene(origin), field::shots(origin, size)?),
    ])
}

/// Turns numbers into colours that differ between neighbours.
fn id_colours(picture: &Picture) -> Vec<u8> {
    let colour = |id: u32| (id.wrapping_mul(0x9E37_79B1) | 0xFF).to_be_bytes();
    picture.ids.iter().flat_map(|id| colour(*id)).collect()
}

fn save(path: &Path, picture: &Picture, rgba: &[u8]) -> Result<(), Box<dyn Error>> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, picture.size.width, picture.size.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(rgba)?;
    Ok(())
}
