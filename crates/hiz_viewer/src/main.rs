//! A renderer that shows occlusion culling by `hiz_core`: in a window, in PNG files, in numbers.
//!
//! It draws bodies from the lists that the library leaves on the device.
//! `viewer --help` says what it takes, and `docs/rust.md` what it shows.
//!
//! The files, in the order of the data:
//!
//! 1. `args` reads the command line, and `controls` has the keys.
//! 2. `scene` describes meshes, bodies and a camera's path; `scene_on_device` uploads them.
//! 3. `culler` calls the library: everything that is about culling.
//! 4. `renderer` records a frame with `pipelines` into `targets`.
//!    `overlay` and `font` draw over it.
//! 5. `picture` reads and compares; `headless`, `window` and `bench` are the three tasks.
//!    `queries` is what `bench` compares with.

mod args;
mod bench;
mod controls;
mod culler;
mod font;
mod gpu;
mod headless;
mod mesh;
mod overlay;
mod picture;
mod pipelines;
mod queries;
mod renderer;
mod sample_places;
mod scene;
mod scene_on_device;
mod targets;
#[cfg(test)]
mod tests;
mod window;

use args::{Arguments, What};

/// Why something could not be done, in words.
type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("viewer: {error}");
            std::process::ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Failure> {
    let arguments = Arguments::parse(std::env::args().skip(1))?;
    match arguments.what {
        What::Help => print!("{}", args::help()),
        What::Headless => headless::run(&arguments)?,
        What::Window => window::run(&arguments)?,
        What::Bench => bench::run(&arguments)?,
    }
    Ok(())
}
