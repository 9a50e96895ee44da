//! Keys: what each of them does, in the window and on the command line.

use hiz_core::{Pose, Vec3};

use crate::Failure;
use crate::mesh::{along, cross, sub, unit};
use crate::renderer::{Mode, Renderer};

/// What a key does; the window and `--keys` share them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Key {
    /// Shows a level of the pyramid, or the picture again.
    Level,
    /// One level coarser, and one finer.
    Coarser,
    Finer,
    /// Culling of what is hidden: off and on.
    Cull,
    /// Bounds as boxes.
    Boxes,
    /// What was drawn in vain.
    InVain,
    /// LODs tinted or not.
    Tint,
    /// Numbers in the corner or not.
    Numbers,
    /// Writes a PNG file.
    Screenshot,
    /// Moves the camera.
    Forward,
    Back,
    Left,
    Right,
}

/// The keys with their names on the command line, and what the help says.
pub(crate) const KEYS: [(Key, &str, &str); 13] = [
    (Key::Forward, "Up", "move forward"),
    (Key::Back, "Down", "move back"),
    (Key::Left, "Left", "turn left"),
    (Key::Right, "Right", "turn right"),
    (Key::Level, "F4", "show a level of the depth pyramid, linearised, or the picture again"),
    (Key::Coarser, "plus", "the next coarser level, while F4 shows one"),
    (Key::Finer, "minus", "the next finer level, while F4 shows one"),
    (Key::Cull, "C", "switch occlusion culling off and on"),
    (Key::Boxes, "R", "show bounds: what is culled in red, what is drawn in white"),
    (Key::InVain, "V", "darken what was drawn in vain, behind something else"),
    (Key::Tint, "L", "tint LODs, or not"),
    (Key::Numbers, "H", "show the frame's time and counts, or not"),
    (Key::Screenshot, "P", "write the picture to a PNG file"),
];

impl Key {
    /// A key by its name, in capitals or not.
    ///
    /// # Errors
    /// For a name that is none.
    pub(crate) fn by_name(name: &str) -> Result<Self, Failure> {
        let found = KEYS.iter().find(|(_, known, _)| known.eq_ignore_ascii_case(name));
        found.map(|(key, ..)| *key).ok_or_else(|| {
            let names: Vec<_> = KEYS.iter().map(|(_, name, _)| *name).collect();
            format!("--keys: expected keys of {}, got {name:?}", names.join(", ")).into()
        })
    }

    /// Keys that are separated by commas.
    pub(crate) fn list(names: &str) -> Result<Vec<Self>, Failure> {
        names.split(',').filter(|name| !name.is_empty()).map(Self::by_name).collect()
    }
}

/// Where the viewer stands, and what it shows while it culls.
#[derive(Debug)]
pub(crate) struct Controls {
    pub(crate) pose: Pose,
    /// The way of culling that the key for it returns to.
    culling: Mode,
}

impl Controls {
    pub(crate) fn new(pose: Pose, mode: Mode) -> Self {
        Self { pose, culling: if mode == Mode::Frustum { Mode::TwoPasses } else { mode } }
    }

    /// Does what a key does, except to write a file.
    pub(crate) fn press(&mut self, key: Key, renderer: &mut Renderer) {
        let last = renderer.num_levels() - 1;
        let step = 0.25 * renderer.scene.speed;
        let shown = &mut renderer.shown;
        match key {
            Key::Level => {
                shown.level = if shown.level.is_some() { None } else { Some(1.min(last)) }
            }
            Key::Coarser => shown.level = shown.level.map(|level| (level + 1).min(last)),
            Key::Finer => shown.level = shown.level.map(|level| level.saturating_sub(1)),
            Key::Boxes => shown.boxes ^= true,
            Key::InVain => shown.in_vain ^= true,
            Key::Tint => shown.tint ^= true,
            Key::Numbers => shown.numbers ^= true,
            Key::Cull => {
                let is_off = renderer.mode == Mode::Frustum;
                renderer.mode = if is_off { self.culling } else { Mode::Frustum };
            }
            Key::Forward => self.advance(step),
            Key::Back => self.advance(-step),
            Key::Left => self.turn(0.1, 0.0),
            Key::Right => self.turn(-0.1, 0.0),
            Key::Screenshot => {}
        }
    }

    /// Moves by some metres in the direction of view.
    pub(crate) fn advance(&mut self, metres: f64) {
        let forward = unit(sub(self.pose.target, self.pose.eye));
        self.pose.eye = along(self.pose.eye, forward, metres);
        self.pose.target = along(self.pose.target, forward, metres);
    }

    /// Turns by angles in radians: to the left, and up.
    /// It stops short of straight up and down.
    pub(crate) fn turn(&mut self, left: f64, up: f64) {
        const STEEPEST: f64 = 0.98;
        let Pose { eye, target, up: axis } = self.pose;
        let forward = unit(sub(target, eye));
        let flat = |v: Vec3| {
            let (sin, cos) = left.sin_cos();
            [cos * v[0] + sin * v[2], v[1], cos * v[2] - sin * v[0]]
        };
        let turned = flat(forward);
        let upward = cross(cross(turned, axis), turned);
        let mut lifted = unit(along(turned, unit(upward), up.tan()));
        if lifted[1].abs() > STEEPEST {
            lifted = turned;
        }
        self.pose.target = along(eye, lifted, 10.0);
    }
}
