//! The window under Xvfb: keys that are pressed by xdotool change what is shown.
//!
//! Without an X server, xdotool or the X libraries the test says so and passes.
//! `make setup` installs them.
//! It does so, too, on a driver that cannot show a window of X, as some builds of SwiftShader.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

const SIZE: [usize; 2] = [320, 180];

/// A process that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

/// What is missing for a window, if anything is.
fn missing() -> Option<String> {
    let on_path = |name: &str| {
        std::env::var_os("PATH")
            .is_some_and(|path| std::env::split_paths(&path).any(|dir| dir.join(name).is_file()))
    };
    let programs = ["Xvfb", "xdotool"].into_iter().filter(|name| !on_path(name));
    // winit opens these when a window is made.
    let has_library = |name: &str| {
        let folders =
            ["/usr/lib", "/usr/lib64", "/lib", "/usr/local/lib", "/usr/lib/x86_64-linux-gnu"];
        let more = ["/usr/lib/aarch64-linux-gnu", "/usr/lib/i386-linux-gnu"];
        folders.into_iter().chain(more).any(|folder| Path::new(folder).join(name).exists())
    };
    let libraries = [
        "libX11.so.6",
        "libX11-xcb.so.1",
        "libXcursor.so.1",
        "libXi.so.6",
        "libXrandr.so.2",
        "libxkbcommon-x11.so.0",
    ];
    let missing: Vec<_> =
        programs.chain(libraries.into_iter().filter(|name| !has_library(name))).collect();
    (!missing.is_empty()).then(|| missing.join(", "))
}

/// Starts an X server on a display that it finds free.
fn x_server() -> (Running, String) {
    let mut server = Command::new("Xvfb")
        .args(["-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("Xvfb starts");
    let mut line = String::new();
    let output = server.stdout.take().expect("it is piped");
    BufReader::new(output).read_line(&mut line).expect("Xvfb names its display");
    assert!(!line.trim().is_empty(), "Xvfb ended");
    (Running(server), format!(":{}", line.trim()))
}

/// The viewer in a window, and its lines.
struct Viewer {
    process: Running,
    display: String,
    lines: BufReader<ChildStdout>,
}

impl Viewer {
    /// The viewer in a window; `None` if the driver has no surfaces of X.
    fn open(display: &str, folder: &Path) -> Option<Self> {
        std::fs::create_dir_all(folder).expect("a folder for pictures");
        let errors = folder.join("errors.txt");
        let mut process = Command::new(env!("CARGO_BIN_EXE_viewer"))
            .args(["--scene", "city", "--size", &format!("{}x{}", SIZE[0], SIZE[1])])
            .arg("--screenshots")
            .arg(folder)
            .arg("--out")
            .arg(folder)
            .env("DISPLAY", display)
            .env_remove("WAYLAND_DISPLAY")
            .stdout(Stdio::piped())
            .stderr(std::fs::File::create(&errors).expect("a file for errors"))
            .spawn()
            .expect("the viewer starts");
        let lines = BufReader::new(process.stdout.take().expect("it is piped"));
        let mut viewer = Self { process: Running(process), display: display.into(), lines };
        if viewer.found("open;").is_none() {
            let errors = std::fs::read_to_string(errors).expect("what the viewer said");
            assert!(errors.contains("does not support VK_KHR_xlib_surface"), "{errors}");
            return None;
        }
        Some(viewer)
    }

    /// The next line that has `part` in it; `None` if the viewer ends before.
    fn found(&mut self, part: &str) -> Option<String> {
        loop {
            let mut line = String::new();
            let read = self.lines.read_line(&mut line).expect("the viewer tells what it does");
            if read == 0 || line.contains(part) {
                return (read > 0).then_some(line);
            }
        }
    }

    fn line_with(&mut self, part: &str) -> String {
        let line = self.found(part);
        line.unwrap_or_else(|| panic!("the viewer ended before it said {part:?}"))
    }

    fn xdotool(&self, arguments: &[&str]) -> String {
        let output = Command::new("xdotool")
            .args(arguments)
            .env("DISPLAY", &self.display)
            .output()
            .expect("xdotool runs");
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    /// Gives the window the keyboard; there is no window manager that would.
    fn focus(&self) {
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(20) {
            let found = self.xdotool(&["search", "--onlyvisible", "--name", "hizvk viewer"]);
            if let Some(window) = found.lines().next() {
                self.xdotool(&["windowfocus", "--sync", window]);
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("no window appeared");
    }

    /// Presses a key, and reads the picture and the line that the viewer leaves.
    fn press(&mut self, key: &str) -> (Vec<u8>, String) {
        self.xdotool(&["key", key]);
        let line = self.line_with(".png");
        let path = PathBuf::from(line.split(".png").next().expect("a path").to_owned() + ".png");
        (pixels(&path), line)
    }
}

fn pixels(path: &Path) -> Vec<u8> {
    let file = std::fs::File::open(path).expect("the viewer has written it");
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().expect("a PNG file");
    let mut rgba = vec![0; reader.output_buffer_size().expect("it has a size")];
    reader.next_frame(&mut rgba).expect("a picture");
    assert_eq!(rgba.len(), 4 * SIZE[0] * SIZE[1]);
    rgba
}

/// The share of pixels that a test of red, green and blue holds for.
fn share(rgba: &[u8], holds: impl Fn(u8, u8, u8) -> bool) -> f64 {
    let pixels = rgba.chunks_exact(4);
    let all = pixels.len() as f64;
    pixels.filter(|p| holds(p[0], p[1], p[2])).count() as f64 / all
}

fn differing(a: &[u8], b: &[u8]) -> f64 {
    let pixels = a.chunks_exact(4).zip(b.chunks_exact(4));
    pixels.filter(|(p, q)| p != q).count() as f64 / (SIZE[0] * SIZE[1]) as f64
}

/// The number of drawn bodies in a line: `drawn 12 early + 3 late of 400`.
fn drawn(line: &str) -> u32 {
    let words = line.split("drawn ").nth(1).and_then(|rest| rest.split(" of ").next());
    let numbers =
        words.expect("a line with counts").split(' ').filter_map(|n| n.parse::<u32>().ok());
    numbers.sum()
}

#[test]
fn keys_change_what_the_window_shows() {
    if let Some(missing) = missing() {
        println!("skipped: a window needs {missing}; make setup installs them");
        return;
    }
    let folder = std::env::temp_dir().join(format!("hizvk_viewer_{}", std::process::id()));
    let (_server, display) = x_server();
    let Some(mut viewer) = Viewer::open(&display, &folder) else {
        println!("skipped: the driver cannot show a window of X (VK_KHR_xlib_surface)");
        std::fs::remove_dir_all(&folder).expect("the folder of this test");
        return;
    };
    viewer.focus();

    // Without numbers, so that pictures of one view are equal.
    let (plain, line) = viewer.press("h");
    let culled = drawn(&line);
    let (again, _) = viewer.press("p");
    assert_eq!(differing(&plain, &again), 0.0);

    // Culling off: the same picture of many more bodies.
    let (all, line) = viewer.press("c");
    assert!(drawn(&line) > 2 * culled, "{} of {}", culled, drawn(&line));
    assert!(differing(&plain, &all) < 0.001, "{}", differing(&plain, &all));
    let (dark, _) = viewer.press("v");
    let darker = differing(&all, &dark);
    assert!(darker > 0.02, "in vain without culling: {darker}");
    viewer.press("v");
    viewer.press("c");

    // A key that is held switches once.
    viewer.xdotool(&["keydown", "c"]);
    std::thread::sleep(Duration::from_millis(1500));
    viewer.xdotool(&["keyup", "c"]);
    viewer.xdotool(&["key", "p"]);
    viewer.line_with("_C.png");
    let next = viewer.line_with(".png");
    assert!(next.contains("_P.png"), "{next}");
    viewer.press("c");

    // Boxes: red and white pixels that were not there.
    let is_red = |r: u8, g: u8, b: u8| r > 150 && g < 90 && b < 90;
    let is_white = |r: u8, g: u8, b: u8| r > 225 && g > 225 && b > 225;
    let (boxes, _) = viewer.press("r");
    assert!(share(&boxes, is_red) > share(&plain, is_red) + 0.002);
    assert!(share(&boxes, is_white) > share(&plain, is_white) + 0.002);
    let (without, _) = viewer.press("r");
    assert_eq!(differing(&plain, &without), 0.0);

    // Levels are grey or sky, and get coarser: fewer different rows.
    let (level, line) = viewer.press("F4");
    assert!(line.contains("level 1: 160x90"), "{line}");
    let is_grey = |r: u8, g: u8, b: u8| (r == g && g == b) || b > r;
    assert!(share(&level, is_grey) > 0.999);
    let mut runs = runs_per_row(&level);
    for (key, name) in [("plus", "level 2: 80x45"), ("plus", "level 3: 40x23")] {
        let (coarser, line) = viewer.press(key);
        assert!(line.contains(name), "{line}");
        let coarse_runs = runs_per_row(&coarser);
        assert!(coarse_runs < runs, "{coarse_runs} after {runs}");
        runs = coarse_runs;
    }
    assert!(viewer.press("minus").1.contains("level 2"));
    let (picture, _) = viewer.press("F4");
    assert_eq!(differing(&plain, &picture), 0.0);

    // The camera moves, and comes back.
    for (there, back) in [("Up", "Down"), ("Left", "Right")] {
        let (moved, _) = viewer.press(there);
        assert!(differing(&plain, &moved) > 0.05, "{there}");
        let (returned, _) = viewer.press(back);
        // Positions are sums of steps, so the last bits may differ.
        assert!(differing(&plain, &returned) < 0.02, "{back}: {}", differing(&plain, &returned));
    }
    // The mouse, too, while its button is held.
    viewer.xdotool(&["mousemove", "100", "100", "mousedown", "1"]);
    viewer.xdotool(&["mousemove", "160", "110", "mouseup", "1"]);
    let (turned, _) = viewer.press("p");
    assert!(differing(&plain, &turned) > 0.05);

    viewer.xdotool(&["key", "Escape"]);
    let status = viewer.process.0.wait().expect("it ends");
    assert!(status.success(), "{status}");
    std::fs::remove_dir_all(&folder).expect("the folder of this test");
}

/// How often neighbours in a row differ, per row.
fn runs_per_row(rgba: &[u8]) -> f64 {
    let rows = rgba.chunks_exact(4 * SIZE[0]);
    let changes = |row: &[u8]| {
        let pixels: Vec<_> = row.chunks_exact(4).collect();
        pixels.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    rows.map(changes).sum::<usize>() as f64 / SIZE[1] as f64
}
