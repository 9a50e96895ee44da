"""The page of a result: its text, its size, and what a browser draws of it without a network."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk import show
from hizvk.show import shapes
from hizvk.show.colours import CLASS_COLOURS, rgb
from hizvk.show.seen import Seen
from hizvk.show.web import MOST_TRIANGLES, page_of
from pictures import decoded, near

WHITE, RED, BLUE = map(rgb, CLASS_COLOURS)
SIZE = (90, 160)
#: Against a browser that hangs; one picture takes two seconds.
GUARD_S = 120
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
#: Of the browser's window; the canvas has what the panel of 350 pixels leaves.
WINDOW, CANVAS = (1150, 600), 800
ROOT = Path(__file__).resolve().parents[1]
#: Tests put another in its place.
shutil_which = shutil.which


def camera() -> hizvk.Camera:
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1)


QUAD = hizvk.Mesh(
    [[-30, -30, -10.0], [0, -30, -10], [0, 30, -10], [-30, 30, -10]], [[0, 1, 2], [0, 2, 3]]
)
#: A wall hides the left half of the view, and so the boxes at the left.
LEFT, RIGHT = np.array([(-x, y, -20) for x in (3, 5) for y in (-2, 2)]), (4, 3, -20)
CENTERS = np.array([*LEFT, RIGHT, (60, 0, -20)], float)
BOXES = hizvk.Boxes(CENTERS - 0.6, CENTERS + 0.6)


def result(device: hizvk.Device, bounds: Any = BOXES) -> hizvk.CullResult:
    hiz = device.pyramid(device.render_depth(device.occluders(QUAD), camera()))
    return device.cull(device.instances(bounds), camera(), hiz)


def scene_in(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="scene">(.*?)</script>', page, re.DOTALL)
    assert found
    scene: dict[str, Any] = json.loads(found[1])
    return scene


def numbers(text: str, dtype: str) -> npt.NDArray[Any]:
    return np.frombuffer(base64.b64decode(text), dtype)


def made_up(count: int, **more: Any) -> Seen:
    """What is shown of a cull that nobody made."""
    low = np.random.default_rng(1).normal(size=(count, 3)) * 50
    given = {
        "title": "made up",
        "camera": camera(),
        "classes": (np.arange(count) % 3).astype(np.uint8),
        "names": shapes.CLASSES,
        "bounds": hizvk.Boxes(low, low + 1.0),
        "depth": np.full(SIZE, 9.0, np.float32),
        "numbers": [],
        "unit": "m",
    }
    return Seen(**{**given, **more})


# -- its text --------------------------------------------------------------------------------------


def test_the_page_holds_the_result(device: hizvk.Device, tmp_path: Path) -> None:
    far = np.array([1e7, 0.0, -3e6])
    seen = result(device)
    seen.save_html(tmp_path / "page.html", hizvk.Boxes(BOXES.min + far, BOXES.max + far))
    scene = scene_in((tmp_path / "page.html").read_text(encoding="utf-8"))
    centers = numbers(scene["centers"], "<f4").reshape(-1, 3) + np.array(scene["origin"])
    np.testing.assert_allclose(centers, CENTERS + far, rtol=0, atol=1e-5)
    assert scene["kind"] == "boxes"
    np.testing.assert_allclose(numbers(scene["sizes"], "<f4"), 0.6, rtol=1e-6)
    assert numbers(scene["classes"], "u1").tolist() == [1, 1, 1, 1, 0, 2]
    assert numbers(scene["indices"], "<u4").tolist() == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize("kind", ["spheres", "points", "oriented"])
def test_other_kinds(device: hizvk.Device, kind: str) -> None:
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    bounds: Any = {
        "spheres": hizvk.Spheres(CENTERS, 0.6),
        "points": hizvk.Points(CENTERS),
        "oriented": hizvk.OrientedBoxes(
            CENTERS, np.tile([1.0, 2, 3], (6, 1)), np.tile(turn, (6, 1, 1))
        ),
    }[kind]
    scene = scene_in(show.page(result(device, bounds)))
    assert scene["kind"] == kind
    sizes = numbers(scene["sizes"], "<f4")
    if kind == "oriented":
        # An axis of the box after the other: 1 along y, 2 along -x, 3 along z.
        np.testing.assert_array_equal(sizes[:9], [0, 1, 0, -2, 0, 0, 0, 0, 3])
    else:
        np.testing.assert_allclose(sizes, [0.6] * 6 if kind == "spheres" else [])


def test_every_text_is_escaped(device: hizvk.Device) -> None:
    evil = "</script><script>alert(1)</script>\"'&<b>"
    page = show.page(result(device), title=evil, unit=evil)
    assert page.count("<script") == 2  # the data and the program
    assert page.count("</script>") == 2
    assert "<b>" not in page
    seen = made_up(3, names=(evil, evil, evil), numbers=[(evil, evil)])
    page = page_of(seen, None, "y", 10)
    assert page.count("<script") == 2
    assert page.count("</script>") == 2
    assert scene_in(page)["names"] == [evil] * 3


def test_nothing_is_loaded(device: hizvk.Device) -> None:
    page = show.page(result(device), occluders=[QUAD])
    assert not re.search(r"https?:|\bsrc=|\bimport\b|@import|url\(|fetch\(|XMLHttp", page)
    assert "default-src 'none'" in page


def test_its_size_is_bounded() -> None:
    page = page_of(made_up(1_000_000), None, "y", 20_000)
    assert len(page) < 1_000_000
    scene = scene_in(page)
    assert len(numbers(scene["indices"], "<u4")) == pytest.approx(20_000, abs=3)
    assert re.search(r"(19,99\d|20,000) of 1,000,000 instances are drawn", page)
    assert "333,334" in page  # the count of a class is that of all
    count = MOST_TRIANGLES // 2 + 500
    step = np.arange(count)[:, None, None] * [[3.0, 0, 0]]
    corners = (np.eye(3) + step).reshape(-1, 3)
    large = hizvk.Mesh(
        corners,
        np.arange(3 * count).reshape(-1, 3),
        [np.eye(4), 2 * np.eye(4) - np.diag([0, 0, 0, 1])],
    )
    page = page_of(made_up(10), [large], "y", 10)
    assert f"{MOST_TRIANGLES:,} of {2 * count:,} triangles are drawn" in page
    assert len(page) < 3_000_000
    triangles = numbers(scene_in(page)["triangles"], "<u4").reshape(-1, 3)
    vertices = numbers(scene_in(page)["vertices"], "<f4").reshape(-1, 3)
    sides = np.linalg.norm(vertices[triangles[:, 1]] - vertices[triangles[:, 0]], axis=1)
    assert np.count_nonzero(sides > 2.0) == count  # all of the larger copy


def test_strange_scenes_make_a_page(device: hizvk.Device) -> None:
    nothing = hizvk.Boxes(np.zeros((0, 3)), np.zeros((0, 3)))
    assert scene_in(show.page(result(device, nothing)))["reach"] > 0.0
    one = hizvk.Points([(0.0, 0.0, -5.0)])
    assert scene_in(show.page(result(device, one)))["reach"] > 0.0
    bad = hizvk.Spheres([(np.nan, 0, 0), (0, 0, -5)], 1.0)
    assert len(numbers(scene_in(show.page(result(device, bad)))["classes"], "u1")) == 1
    for made in (
        hizvk.Camera.orthographic((0, 0, 0), (0, 0, -1), height=9, size=SIZE, near=0.1, far=50),
        hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1, far=50),
    ):
        scene = scene_in(page_of(made_up(9, camera=made), None, "-z", 9))
        assert np.isfinite(scene["frustum"]).all()
        # Left and right of the near plane, as the image has them.
        assert scene["frustum"][0] < scene["frustum"][3]
        assert not scene["mirrored"]


def test_a_mirrored_world_is_said_to_be_so() -> None:
    """A left-handed world, such as CARLA's: x forward, y right, z up."""
    clip = np.array([[0, 1.0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0.1], [1, 0, 0, 0]])
    seen = made_up(9, camera=hizvk.Camera.from_matrices(clip, size=SIZE, reversed_z=True))
    assert scene_in(page_of(seen, None, "z", 9))["mirrored"]


def test_a_cull_that_tells_nothing_is_refused(device: hizvk.Device, tmp_path: Path) -> None:
    hiz = device.pyramid(np.full(SIZE, 9.0), camera(), kind="z")
    seen = device.cull(device.instances(BOXES), camera(), hiz, outputs=["draws"])
    with pytest.raises(ValueError, match=r'^outputs: expected "mask" or "verdicts"'):
        seen.save_html(tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()


# -- in a browser ----------------------------------------------------------------------------------


def usable_browser(guard_s: float = 20.0) -> tuple[str | None, str]:
    """A browser's path, or why there is none.

    On Ubuntu a command may be a stub that asks for a snap, and a snap sees another /tmp.
    """
    why = []
    for name in BROWSERS:
        path = shutil.which(name)
        if path is None:
            continue
        if "/snap/" in os.path.realpath(path) or os.path.realpath(path).endswith("/snap"):
            why.append(f"{path} is a snap, which does not see the files of tests")
            continue
        try:
            told = subprocess.run(
                [path, "--version"], capture_output=True, text=True, timeout=guard_s, check=False
            )
        except (OSError, subprocess.TimeoutExpired):
            why.append(f"{path} does not say its version")
            continue
        if told.returncode == 0 and re.search(r"\d+\.\d", told.stdout):
            return path, ""
        why.append(f"{path} is no browser: {(told.stdout + told.stderr).strip()[:200]}")
    reason = "; ".join(why) or (
        "install it with: apt-get update && apt-get install -y --no-install-recommends chromium"
    )
    return None, f"no Chromium; {reason}"


class Browser:
    """Headless Chromium without a network; pages are opened side by side."""

    def __init__(self, folder: Path, guard_s: float = 20.0) -> None:
        self._path, why = usable_browser(guard_s)
        if self._path is None:
            pytest.skip(why)
        self._folder = folder
        self._opened = 0

    def open(self, page: Path, address: str, *arguments: str) -> subprocess.Popen[str]:
        """Begins to open a page."""
        self._opened += 1
        return subprocess.Popen(
            [
                str(self._path),
                "--headless",
                "--disable-gpu",
                *(["--no-sandbox"] if os.geteuid() == 0 else []),
                f"--user-data-dir={self._folder / f'profile{self._opened}'}",
                "--host-resolver-rules=MAP * ~NOTFOUND",
                "--proxy-server=127.0.0.1:9",
                "--enable-logging=stderr",
                "--virtual-time-budget=1000",
                f"--window-size={WINDOW[0]},{WINDOW[1]}",
                "--hide-scrollbars",
                *arguments,
                page.as_uri() + address,
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def shots(self, page: Path, *addresses: str) -> list[npt.NDArray[np.uint8]]:
        """Pictures of the page, one per address."""
        files = [self._folder / f"{page.stem}{number}.png" for number in range(len(addresses))]
        opened = [
            self.open(page, address, f"--screenshot={file}")
            for address, file in zip(addresses, files, strict=True)
        ]
        for one in opened:
            _, told = one.communicate(timeout=GUARD_S)
            assert one.returncode == 0, told
            assert "CONSOLE" not in told, told
        return [decoded(file.read_bytes()) for file in files]


@pytest.mark.parametrize(
    ("script", "reason"),
    [
        (
            "echo \"Command 'chromium' requires the chromium snap to be installed.\" >&2; exit 1",
            "chromium is no browser: Command 'chromium' requires the chromium snap",
        ),
        ("exec sleep 60", "chromium does not say its version"),
        ("exit 0", "chromium is no browser"),
        (None, "apt-get install -y --no-install-recommends chromium"),
    ],
)
def test_a_stub_is_no_browser(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, script: str | None, reason: str
) -> None:
    if script is not None:
        stub = tmp_path / "chromium"
        stub.write_text(f"#!/bin/sh\n{script}\n")
        stub.chmod(0o755)
    # The stub alone is found; `sleep` is where it always is.
    monkeypatch.setattr(shutil, "which", lambda name: shutil_which(name, path=str(tmp_path)))
    path, why = usable_browser(0.5)
    assert path is None
    assert why.startswith("no Chromium; ")
    assert reason in why
    with pytest.raises(pytest.skip.Exception, match="no Chromium"):
        Browser(tmp_path, 0.5)


def test_a_snap_is_no_browser_and_others_are_asked(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "snap" / "bin").mkdir(parents=True)
    for place in ("snap/bin/chromium", "google-chrome"):
        stub = tmp_path / place
        stub.write_text("#!/bin/sh\necho Chromium 120.0.1\n")
        stub.chmod(0o755)
    (tmp_path / "chromium").symlink_to(tmp_path / "snap" / "bin" / "chromium")
    monkeypatch.setattr(shutil, "which", lambda name: shutil_which(name, path=str(tmp_path)))
    assert usable_browser() == (str(tmp_path / "google-chrome"), "")
    (tmp_path / "google-chrome").unlink()
    assert "chromium is a snap" in usable_browser()[1]


#: `make setup` on an Ubuntu: what the package list says, which command there is, what is installed.
SETUP = """
set -euo pipefail
have() {{ command -v "$1" >/dev/null 2>&1; }}
can_be_root() {{ return 0; }}
apt_install() {{ echo "installing $*"; printf '#!/bin/sh\n{installed}\n' >{folder}/chromium;
  chmod +x {folder}/chromium; }}
STAMPS={folder}/stamps BROWSER_GUARD_S=1
. {source}
browser_package
echo done
"""


@pytest.mark.parametrize(
    ("package", "stub", "installed", "installs", "noted"),
    [
        ("Description: web browser", None, "echo Chromium 120.0", True, False),
        ("Description: web browser", "sleep 60", "echo Chromium 120.0", True, False),
        ("Description: web browser", None, "exit 1", True, True),
        ("Description: Transitional package - chromium snap", "exit 1", "exit 1", False, True),
        ("Description: web browser", "echo Chromium 120.0", "exit 1", False, False),
    ],
)
def test_setup_neither_hangs_nor_fails_on_a_stub(
    tmp_path: Path, package: str, stub: str | None, installed: str, installs: bool, noted: bool
) -> None:
    (tmp_path / "stamps").mkdir()
    scripts = {"apt-get": "exit 0", "apt-cache": f"echo '{package}'"}
    for name, script in {**scripts, **({"chromium": stub} if stub else {})}.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{script}\n")
        (tmp_path / name).chmod(0o755)
    for name in ("timeout", "grep", "touch", "chmod", "sleep"):
        found = shutil.which(name)
        assert found
        (tmp_path / name).symlink_to(found)
    source = ROOT / "scripts" / "browser.sh"
    text = SETUP.format(folder=tmp_path, source=source, installed=installed)
    for turn in range(2):  # what could not be installed is not tried again
        told = subprocess.run(
            ["/bin/bash", "-c", text],
            env={"PATH": str(tmp_path)},
            capture_output=True,
            text=True,
            timeout=GUARD_S,
            check=False,
        )
        assert told.returncode == 0, told.stderr
        assert told.stdout.endswith("done\n")
        assert ("installing chromium" in told.stdout) == (installs and turn == 0)
        is_noted = "the test of the HTML page is skipped without Chromium" in told.stderr
        assert is_noted == (noted and turn == 0)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Browser:
    return Browser(tmp_path_factory.mktemp("browser"))


def test_a_browser_draws_and_turns_it(
    browser: Browser, device: hizvk.Device, tmp_path: Path
) -> None:
    result(device).save_html(tmp_path / "page.html", title="Boxes")
    over, turned = (
        image[:, :CANVAS] for image in browser.shots(tmp_path / "page.html", "", "#yaw=30")
    )
    for image in (over, turned):
        assert near(image, WHITE, 8) > 20
        assert near(image, RED, 8) > 100
        assert near(image, BLUE, 8) > 20
    assert (over != turned).any(axis=2).mean() > 0.005


#: Presses keys, drags, and turns the wheel; looks at pixels; and writes what it found as JSON.
HANDS = """
<script>
const told = { states: [] };
const tellState = () => told.states.push([state.yaw, state.pitch, state.distance]);
const press = (key) => window.dispatchEvent(new KeyboardEvent("keydown", { key }));
const drag = (type, x) => canvas.dispatchEvent(
  new PointerEvent(type, { pointerId: 1, clientX: x, clientY: 100, buttons: 1 }));
canvas.setPointerCapture = () => {};
tellState();
press("ArrowLeft"); tellState();
press("+"); tellState();
drag("pointerdown", 100); drag("pointermove", 200); drag("pointerup", 200); tellState();
canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: 100 })); tellState();

// The number of pixels of about this colour, the first and last of their columns, the last row.
function look(colour) {
  let [count, first, last, bottom] = [0, width, -1, -1];
  for (let at = 0; at < width * height; at++) {
    if (colour.every((one, k) => Math.abs(one - pixels[4 * at + k]) <= 8)) {
      count++;
      first = Math.min(first, at % width);
      last = Math.max(last, at % width);
      bottom = Math.floor(at / width);
    }
  }
  return [count, first, last, bottom];
}
press("4"); press("c"); draw();
told.size = [width, height];
const panel = document.querySelector("aside");
told.cut = [panel.scrollWidth - panel.clientWidth, document.body.scrollWidth - innerWidth];
[told.kept, told.hidden] = [look(colours[0]), look(colours[1])];
press("2"); draw();
told.without = look(colours[1])[0];
press("2"); press("4"); draw();
const dim = colours[1].map((one, k) => 0.4 * one + 0.6 * colours[3][k]);
told.behind = [look(colours[1])[0], look(dim)[0]];
press("x"); draw();
told.opaque = [look(colours[1])[0], look(dim)[0], look(colours[0])[0]];
const at = owners.indexOf(4);
const box = canvas.getBoundingClientRect();
canvas.dispatchEvent(new PointerEvent("pointermove", {
  pointerId: 2, clientX: box.left + at % width, clientY: box.top + Math.floor(at / width) }));
told.status = document.getElementById("status").textContent;
document.title = "TOLD" + JSON.stringify(told);
</script>
"""


def test_keys_mouse_and_pixels(browser: Browser, device: hizvk.Device, tmp_path: Path) -> None:
    path = tmp_path / "hands.html"
    page = show.page(result(device), occluders=QUAD)
    path.write_text(page.replace("</body>", HANDS + "</body>"), encoding="utf-8")
    dom, told = browser.open(path, "", "--dump-dom").communicate(timeout=GUARD_S)
    assert "CONSOLE" not in told, told
    written = re.search(r"<title>TOLD(.*?)</title>", dom)
    assert written, dom[:2000]
    found = json.loads(written[1])
    yaw, pitch, distance = np.array(found["states"]).T
    assert yaw.tolist() == pytest.approx([yaw[0], yaw[0] + 5, yaw[0] + 5, yaw[0] - 25, yaw[0] - 25])
    assert np.ptp(pitch) == 0.0
    assert distance[2] < distance[1] == distance[0]
    assert distance[4] > distance[3] == distance[2]
    # From the camera everything lies where the camera has it.
    wide, tall = found["size"]
    assert wide == CANVAS
    assert max(found["cut"]) <= 0  # no text is cut off
    focal = tall / 2 / np.tan(np.radians(30))
    for (_, first, last, _), sides in (
        (found["kept"], (3.4 / 20.6, 4.6 / 19.4)),
        (found["hidden"], (-5.6 / 19.4, -2.4 / 20.6)),
    ):
        expected = [wide / 2 + focal * side for side in sides]
        assert [first, last] == pytest.approx(expected, abs=2)
    assert found["kept"][3] == pytest.approx(tall / 2 - focal * 2.4 / 20.6, abs=2)
    assert found["without"] == 0
    # The wall leaves a dim rest of what it hides, or without x-ray nothing.
    assert found["behind"][0] == 0
    assert found["behind"][1] > 100
    assert found["opaque"][:2] == [0, 0]
    assert found["opaque"][2] == found["kept"][0]
    assert found["status"] == "Instance 4: kept. In Python: seen.explain(4)"


@pytest.mark.slow
def test_an_error_in_the_page_is_seen(
    browser: Browser, device: hizvk.Device, tmp_path: Path
) -> None:
    page = tmp_path / "broken.html"
    page.write_text(show.page(result(device)).replace("drawFrustum();", "drawNothing();"))
    dom, told = browser.open(page, "", "--dump-dom").communicate(timeout=GUARD_S)
    assert "CONSOLE" in told
    assert "This page could not be drawn: Uncaught ReferenceError: drawNothing" in dom
