"""Every script in examples/ runs as a user runs it, and its last line is what was worked out."""

from __future__ import annotations

import re
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS = sorted(path.name for path in ROOT.glob("examples/*.py"))
#: Against a script that hangs; one takes a second.
GUARD_S = 120

#: The last line of each, as a pattern; how the numbers come about is said beside them.
LAST_LINES = {
    # The light's verdict and the slice's, by masks of numpy.
    "cascades.py": "lit AND in the slice: True",
    # An exact oracle has the last word, and how much a way keeps in vain is no promise.
    "check_against_truth.py": r"0 false culls; false keeps: \d+, \d+, \d+",
    # All of the wall is in every picture of its side, and 40 cm hide the other side.
    "colour_points.py": r"red or blue as they are: 100\.0%; of both colours: 0",
    # A small pixel is 13 cm wide at 10 m, and its centre 6 cm off the middle of the 2 cm gap.
    # A large pixel is 1 cm wide.
    "conservative.py": "the ball behind the gap: "
    "large keeps, small hides, small and conservative keeps",
    # The walls are closed but for the door.
    "cube_map.py": "lit: 500 in the room, 300 behind the door, 0 behind walls",
    # Levels by rays, which the label file holds; 24 boxes have level 3, as they do not show.
    "driving_boxes.py": "kept 15 of 39; 39 levels as labelled",
    # Ten boxes each.
    "depth_image.py": "kept 10 before the wall, 0 behind it, 10 without data",
    # The scene's own count; what is left out would not have shown.
    "front_to_back.py": "depth as of all boxes: True",
    # Half of the balls in front of the wall, the others in its shadow.
    "first_cull.py": "kept 5,000 of 5,000 in front and 0 behind the wall",
    # 600 balls in front of the wall; the other four numbers are the script's own.
    "indirect_draws.py": "draw 600 instances from 0 on, 36 indices from 12 on, base vertex -4",
    # A closed house; each ball of the ring is nearer to some camera than the house.
    "many_views.py": "seen from 24 views: 0 inside, 60 around",
    # 200 boxes stand before the wall, and 200 in its shadow.
    "pictures.py": "white: 200 kept, red: 200 culled",
    # At a distance of 20 m the wall of 6 x 6 m hides 12 x 12 m, and there are 8 x 8 m.
    "polygon_soup.py": "kept: 100 % of the wall, 0 % of what it hides",
    # The answer is that of a blocking read.
    "readback.py": "8 of 8 masks are those of a blocking read",
    # What a culled caster could shadow, no pixel shows.
    "shadow_casters.py": "pixels that lose a shadow: 0 of the sun's, 0 of the lamp's",
    # Each eye sees past its own side of the pillar.
    "stereo.py": "a list of one eye would lose balls of the other: True",
    # How many are kept in vain is no promise; `test_jobs.py` asks rays what shows.
    "model_visibility.py": r"71 buildings: \d+ show from all places, \d+ from none",
    # The first ball is as wide as any, nearest, and on the same axis.
    "ten_spheres.py": "1 drawn, 9 skipped",
    # The stale answer lacks what the door has hidden.
    "two_passes.py": "pixels lost: 0 by two passes, 0 by hand; the stale answer loses some: True",
    # x is -9, -7, ... 9: a ball of 0.5 m is hidden up to 3.5 m from the middle.
    "updates.py": "the walker is hidden in frames 3, 4, 5, 6",
    # From 60 m, 100 m before a ridge of 8 m, the ground shows again 15 m behind it.
    "viewshed.py": "cells seen behind the ridge: 0 from the ground, 234 from a tower",
    # The wall hides what is below 1 m of the cars behind it, and they are 1.5 m high.
    "visible_fraction.py": "level 4: 4 of 4 in the open, 0 of 4 behind the wall",
}


def test_every_script_has_an_expectation() -> None:
    assert sorted(LAST_LINES) == SCRIPTS


@pytest.mark.parametrize("name", SCRIPTS)
def test_script_runs(name: str, tmp_path: Path) -> None:
    # From a folder elsewhere, as a copy of the script would be; a warning is an error.
    run = subprocess.run(
        [sys.executable, "-W", "error", str(ROOT / "examples" / name)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=GUARD_S,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    last = run.stdout.splitlines()[-1]
    assert re.fullmatch(LAST_LINES[name], last), run.stdout
    assert not list(tmp_path.iterdir())


def test_ten_spheres_show_their_depth_complexity(tmp_path: Path) -> None:
    path = tmp_path / "complexity.png"
    script = str(ROOT / "examples" / "ten_spheres.py")
    subprocess.run([sys.executable, script, str(path)], check=True, timeout=GUARD_S)
    data = path.read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    chunks, at = {}, 8
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        (check,) = struct.unpack_from(">I", data, at + 8 + length)
        assert check == zlib.crc32(kind + body)
        chunks[kind], at = body, at + 12 + length
    width, height = struct.unpack_from(">2I", chunks[b"IHDR"])
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, width + 1)
    everything, drawn = np.split(rows[:, 1:] // 25, 2, axis=1)
    # All ten lie in the middle, and only the first was drawn there.
    middle = (height // 2, width // 4)
    assert (everything[middle], drawn[middle]) == (10, 1)
    assert (everything.max(), drawn.max()) == (10, 1)
    # The first is the widest: as many pixels are covered at all.
    assert ((everything > 0) == (drawn > 0)).all()
    assert everything[0, 0] == 0


@pytest.mark.parametrize("name", SCRIPTS)
def test_script_needs_numpy_alone(name: str) -> None:
    text = (ROOT / "examples" / name).read_text(encoding="utf-8")
    assert 30 <= len(text.splitlines()) <= 80
    modules = set(re.findall(r"^(?:import|from) (\w+)", text, re.MULTILINE))
    assert modules <= {"hizvk", "numpy", *sys.stdlib_module_names}
