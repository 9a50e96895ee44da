"""A folder through which workers of the same machine, or of a shared file system, get the scene.

Executors choose which worker runs what, so nothing can be sent to one worker.
A reference to a file costs nothing wherever it arrives.
"""

from __future__ import annotations

import os
import pickle
import tempfile
import uuid
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Self

    from .scene import SceneData

__all__ = ["Reference", "Spool"]


@dataclass(frozen=True)
class Reference:
    """Where a scene lies; it travels with every block."""

    folder: str
    token: str
    """What the folder's file of this name holds: another machine may have a folder of that name."""

    def is_here(self) -> bool:
        """Whether this process sees the folder."""
        try:
            with open(os.path.join(self.folder, "token"), encoding="ascii") as file:
                return file.read() == self.token
        except OSError:
            return False

    def load(self) -> SceneData:
        """The scene; the folder belongs to the user who sweeps, and nobody else can write to it."""
        with open(os.path.join(self.folder, "scene"), "rb") as file:
            scene: SceneData = pickle.load(file)
        return scene


class Spool:
    """The folder of one sweep, from ``with`` to its end."""

    def __init__(self, scene: SceneData) -> None:
        self._scene = scene
        self._is_written = False

    def __enter__(self) -> Self:
        self._folder = tempfile.TemporaryDirectory(prefix="hizvk-sweep-")
        self.reference = Reference(self._folder.name, uuid.uuid4().hex)
        with open(os.path.join(self._folder.name, "token"), "w", encoding="ascii") as file:
            file.write(self.reference.token)
        return self

    def written(self) -> Reference:
        """The reference, once the scene is in the folder."""
        if not self._is_written:
            with open(os.path.join(self._folder.name, "scene"), "wb") as file:
                pickle.dump(self._scene, file, protocol=5)
            self._is_written = True
        return self.reference

    def __exit__(self, *error: object) -> None:
        self._folder.cleanup()
