"""The scenes of the bench by name: mountains, city, room, and Intel's castle."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from .. import scenes
from ..scenes import Scene, View
from ..scenes.city import city
from ..scenes.grid import on_grid
from .volumes import bounds_of

if TYPE_CHECKING:
    from ..bounds import Bounds
    from ..scenes.grid import Floats

__all__ = ["NAMES", "BenchScene", "Missing", "find_castle", "load_castle", "make"]

#: In the order of the report; ``city-far`` is the city at coordinates of a million metres.
NAMES: Final = ("mountains", "city", "city-far", "room", "castle")
#: The environment variable that names castle.npz where ``--castle`` does not.
VARIABLE: Final = "HIZVK_CASTLE"
FAR_CORNER: Final = (1_000_000.0, -750_000.0, 0.0)


class Missing(Exception):
    """A scene is not available here; the text says why and what would help."""


@dataclass(frozen=True)
class BenchScene:
    """A scene, and what is needed to bound its instances."""

    key: str
    """One of `NAMES`."""
    scene: Scene
    up: int = 2
    """The vertical axis."""
    yaw: Floats | None = None
    """``(N,)``: the instances' angles about it, if they are known."""

    def bounds(self, kind: str) -> Bounds:
        """The instances' bounds; `kind` is one of `hizvk.measuring.volumes.KINDS`."""
        return bounds_of(self.scene, kind, up=self.up, yaw=self.yaw)


def make(key: str, instances: int, views: int, seed: int, castle: Path | None) -> BenchScene:
    """One scene.

    Parameters
    ----------
    key : str
        One of `NAMES`.
    instances, views : int
        How many.
        The castle's instances are given, and of its views every k-th is taken.
    seed : int
        Same seed, same scene.
    castle : Path, optional
        The castle's file; None: see `find_castle`.

    Raises
    ------
    Missing
        If its data or a package is absent.
    """
    if key == "mountains":
        try:
            return BenchScene(key, scenes.mountains(instances, views, seed=seed))
        except ImportError as error:
            raise Missing(str(error)) from None
    if key in ("city", "city-far"):
        corner = FAR_CORNER if key == "city-far" else (0.0, 0.0, 0.0)
        made = city(instances, views, seed=seed, corner=corner)
        return BenchScene(key, made.scene, yaw=made.yaw)
    if key == "room":
        return BenchScene(key, _room(instances, views, seed), yaw=np.zeros(instances))
    if key == "castle":
        return load_castle(find_castle(castle), views)
    raise ValueError(f"key: expected one of {', '.join(NAMES)}, got {key!r}")


def find_castle(given: Path | None) -> Path:
    """The castle's file, as `given` or as `VARIABLE` names it.

    Raises
    ------
    Missing
        If neither names a file.
    """
    named = given or os.environ.get(VARIABLE)
    if not named or not Path(named).is_file():
        where = f"{named} is no file" if named else "its file is not part of the package"
        raise Missing(
            f"the castle is left out: {where}; name a castle.npz with --castle PATH or {VARIABLE}"
        )
    return Path(named)


def load_castle(path: Path, views: int) -> BenchScene:
    """A scene from an npz file with occluders, instances, their triangles and cameras.

    Parameters
    ----------
    path : Path
        Keys: ``occluder_vertices`` (V, 3), ``occluder_triangles`` (T, 3), ``occluder_instance``
        (T,) all -1, ``instance_aabb_min`` and ``instance_aabb_max`` (N, 3), ``instance_vertices``,
        ``instance_triangles``, ``instance_first_triangle`` (N + 1,), ``up`` (3,), ``name``,
        ``source``, ``license``, and for K cameras ``camera_name``, ``camera_eye``,
        ``camera_target``, ``camera_up``, ``camera_fov_y`` (radians), ``camera_near``,
        ``camera_far``.
    views : int
        How many cameras at most; they are taken evenly.

    Raises
    ------
    Missing
        If the file lacks keys, or if an occluder is also an instance.
    """
    with np.load(path) as data:
        try:
            found = {key: data[key] for key in data.files}
            if (found["occluder_instance"] >= 0).any():
                raise Missing(f"{path}: occluders that are instances as well are not supported")
            count = len(found["camera_eye"])
            chosen = np.unique(np.linspace(0, count - 1, min(views, count)).round().astype(int))
            scene = Scene(
                name=f"{found['name']} ({str(found['source']).split()[0]}, {found['license']})",
                origin=tuple(
                    np.round(found["instance_aabb_min"].astype(float).mean(axis=0)).tolist()
                ),
                vertices=found["occluder_vertices"].astype(np.float64),
                triangles=found["occluder_triangles"].astype(np.uint32),
                instance_vertices=found["instance_vertices"].astype(np.float64),
                instance_triangles=found["instance_triangles"].astype(np.uint32),
                owner=np.repeat(
                    np.arange(len(found["instance_aabb_min"]), dtype=np.int32),
                    np.diff(found["instance_first_triangle"]),
                ),
                box_min=found["instance_aabb_min"].astype(np.float64),
                box_max=found["instance_aabb_max"].astype(np.float64),
                views=tuple(_castle_view(found, int(k)) for k in chosen),
            )
        except KeyError as error:
            raise Missing(
                f"{path}: expected the keys of a bench scene, {error} is missing"
            ) from None
        return BenchScene("castle", scene, up=int(np.argmax(np.abs(found["up"]))))


def _castle_view(found: dict[str, np.ndarray], k: int) -> View:
    eye, target, up = (
        tuple(found[f"camera_{key}"][k].astype(float).tolist()) for key in ("eye", "target", "up")
    )
    fov = float(np.degrees(found["camera_fov_y"][k]))
    near, far = float(found["camera_near"][k]), float(found["camera_far"][k])
    return View(str(found["camera_name"][k]), eye, target, fov, near, up, far)


def _room(crates: int, views: int, seed: int) -> Scene:
    """The room of `hizvk.scenes`, seen from standing height in its three bays."""
    room = scenes.room(seed, crates)
    rng = np.random.default_rng(seed)
    eyes = []
    for number in range(views):
        bay = (0.5, 5.75, 10.75)[number % 3]
        eye = np.array([bay + rng.uniform(0.0, 4.0), rng.uniform(0.5, 11.5), rng.uniform(1.4, 1.9)])
        eye = on_grid(eye)
        target = rng.uniform((1.0, 1.0, 0.2), (15.0, 11.0, 1.2))
        eyes.append(
            View(f"bay {number % 3}", tuple(eye.tolist()), tuple(target.tolist()), 70.0, 0.0625)
        )
    return replace(room, views=tuple(eyes))
