//! The command line.

use std::path::PathBuf;

use hiz_core::ImageSize;

use crate::Failure;
use crate::controls::{KEYS, Key};
use crate::renderer::Mode;

/// What the viewer is asked to do.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Arguments {
    pub(crate) what: What,
    /// `None`: mountains, and all scenes of the bench.
    pub(crate) scene: Option<String>,
    pub(crate) size: ImageSize,
    pub(crate) samples: u32,
    pub(crate) mode: Mode,
    pub(crate) lods: bool,
    pub(crate) moving: bool,
    pub(crate) keys: Vec<Key>,
    pub(crate) frames: usize,
    pub(crate) out: PathBuf,
    pub(crate) screenshots: Option<PathBuf>,
}

/// The viewer's tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum What {
    Window,
    Headless,
    Bench,
    Help,
}

impl Arguments {
    /// The scene that is drawn.
    pub(crate) fn scene_name(&self) -> &str {
        self.scene.as_deref().unwrap_or("mountains")
    }

    /// Reads the arguments behind the program's name.
    ///
    /// # Errors
    /// For an argument that is none, and for values out of range; the text names it.
    pub(crate) fn parse(given: impl IntoIterator<Item = String>) -> Result<Self, Failure> {
        let mut parsed = Self {
            what: What::Window,
            scene: None,
            size: ImageSize::new(960, 540),
            samples: 1,
            mode: Mode::TwoPasses,
            lods: true,
            moving: false,
            keys: Vec::new(),
            frames: 6,
            out: "out/viewer".into(),
            screenshots: None,
        };
        let mut given = given.into_iter();
        while let Some(name) = given.next() {
            let mut value =
                || given.next().ok_or_else(|| Failure::from(format!("{name}: a value is missing")));
            match name.as_str() {
                "-h" | "--help" => parsed.what = What::Help,
                "--headless" => parsed.what = What::Headless,
                "--bench" => parsed.what = What::Bench,
                "--no-cull" => parsed.mode = Mode::Frustum,
                "--no-lods" => parsed.lods = false,
                "--moving" => parsed.moving = true,
                "--scene" => parsed.scene = Some(value()?),
                "--size" => parsed.size = size(&value()?)?,
                "--samples" => parsed.samples = samples(&value()?)?,
                "--mode" => parsed.mode = mode(&value()?)?,
                "--keys" => parsed.keys = Key::list(&value()?)?,
                "--frames" => parsed.frames = frames(&value()?)?,
                "--out" => parsed.out = value()?.into(),
                "--screenshots" => parsed.screenshots = Some(value()?.into()),
                _ => return Err(format!("{name}: no such argument; --help lists all").into()),
            }
        }
        Ok(parsed)
    }
}

fn size(text: &str) -> Result<ImageSize, Failure> {
    let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match sides {
        Some((width @ 16..=8192, height @ 16..=8192)) => Ok(ImageSize::new(width, height)),
        _ => Err(format!("--size: expected WIDTHxHEIGHT, 16 to 8192 a side, got {text:?}").into()),
    }
}

fn samples(text: &str) -> Result<u32, Failure> {
    match text {
        "1" => Ok(1),
        "4" => Ok(4),
        _ => Err(format!("--samples: expected 1 or 4, got {text:?}").into()),
    }
}

fn frames(text: &str) -> Result<usize, Failure> {
    match text.parse() {
        Ok(frames @ 1..=100_000) => Ok(frames),
        _ => Err(format!("--frames: expected 1 to 100000, got {text:?}").into()),
    }
}

fn mode(text: &str) -> Result<Mode, Failure> {
    Mode::ALL.into_iter().find(|mode| mode.name() == text).ok_or_else(|| {
        let names = Mode::ALL.map(Mode::name).join(", ");
        format!("--mode: expected one of {names}, got {text:?}").into()
    })
}

/// What `--help` prints.
pub(crate) fn help() -> String {
    let keys = KEYS.map(|(_, name, what)| format!("  {name:<8} {what}\n")).concat();
    format!(
        "viewer: a renderer that draws what hiz_core leaves in its lists.

  viewer [--scene SCENE]              opens a window
  viewer --headless [--frames N]      writes frames to PNG files, without a window
  viewer --bench                      compares frames with and without culling

Scenes: mountains, arm, city, and castle, whose data is not part of this repository:
`HIZVK_CASTLE=castle.npz make view ARGS='--scene castle'` unpacks it first.

  --scene SCENE      the scene (default: mountains, and all of them with --bench)
  --size WxH         of the picture in pixels (default: 960x540)
  --samples 1|4      samples per pixel (default: 1)
  --mode MODE        what is left out of a frame (default: two-passes):
                       all         nothing, and each body is drawn at its finest
                       frustum     what is outside of the view
                       one-pass    also what is hidden by occluders that are drawn before
                       two-passes  also what is hidden by what the frame before has shown
  --no-cull          the same as --mode frustum
  --no-lods          each body is drawn at its finest
  --moving           with --headless, bodies drift, come and go from frame to frame
  --keys KEYS        keys to press before the first frame, separated by commas: F4,plus,C
  --frames N         frames along the scene's path, which has jumps (default: 6)
  --out FOLDER       where the PNG files of --headless and of the key P go (default: out/viewer)
  --screenshots DIR  writes a PNG file after each key in the window

Keys:
{keys}  Escape   close the window
The mouse turns the camera while a button is held.

HIZVK_ADAPTER chooses the adapter: its index, or a part of its name or driver.
"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<Arguments, String> {
        Arguments::parse(line.split_whitespace().map(str::to_owned)).map_err(|e| e.to_string())
    }

    #[test]
    fn arguments_are_read() {
        let parsed = parse("--headless --scene arm --frames 3 --samples 4 --size 64x48 --no-cull")
            .expect("they are right");
        assert_eq!(parsed.what, What::Headless);
        assert_eq!((parsed.scene_name(), parsed.frames, parsed.samples), ("arm", 3, 4));
        assert_eq!((parsed.size, parsed.mode), (ImageSize::new(64, 48), Mode::Frustum));
        assert_eq!(parse("--keys f4,Plus,C").unwrap().keys, [Key::Level, Key::Coarser, Key::Cull]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (line, name) in [
            ("--size 12", "--size"),
            ("--size 0x5", "--size"),
            ("--samples 3", "--samples"),
            ("--frames 0", "--frames"),
            ("--mode half", "--mode"),
            ("--keys F4,Q", "--keys"),
            ("--scene", "--scene"),
            ("--wide", "--wide"),
        ] {
            let error = parse(line).expect_err(line);
            assert!(error.starts_with(name), "{line}: {error}");
        }
    }

    #[test]
    fn help_names_every_argument_and_key() {
        let help = help();
        let arguments = [
            "headless", "bench", "scene", "size", "samples", "mode", "no-cull", "no-lods",
            "moving", "keys",
        ];
        for name in arguments.into_iter().chain(["frames", "out", "screenshots"]) {
            assert!(help.contains(&format!("--{name} ")), "{name}");
        }
        for mode in Mode::ALL {
            assert!(help.contains(mode.name()));
        }
        for (_, name, _) in KEYS {
            assert!(help.contains(&format!("\n  {name} ")), "{name}");
        }
    }
}
