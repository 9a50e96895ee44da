"""What was measured, as plain objects: figures beside their targets, times, errors, sizes; `report` writes them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .rounds import quartiles

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...adapter import Adapter
    from ...scenes import Floats
    from ..results import Spread

__all__ = ["Error", "Figure", "FirstCall", "Found", "ImageSize", "InstanceCount", "Time"]


@dataclass(frozen=True)
class Figure:
    """A number, what it is to reach, and whether it does."""

    key: str
    """``part.name``, the same in every run."""
    label: str
    value: float
    unit: str = "x"
    """``"x"``: a ratio of medians; ``"ms"``, ``"s"``, ``"ns"``, ``"culls"``, ``"share"``."""
    q1: float | None = None
    """Quartiles over the rounds; of a ratio, of the rounds' own ratios."""
    q3: float | None = None
    target: float | None = None
    """None: told, not judged."""
    at_least: bool = False
    """Whether the target is a lower bound."""

    @property
    def met(self) -> bool | None:
        """Whether the target is reached; None without one."""
        if self.target is None:
            return None
        return self.value >= self.target if self.at_least else self.value <= self.target

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self) | {"part": self.key.partition(".")[0], "met": self.met}


@dataclass(frozen=True)
class Time:
    """Milliseconds of one way, over the rounds."""

    part: str
    label: str
    ms: Spread
    least: float
    most: float
    """Far above the median: somebody else's work, or a shader that the driver compiled once more."""


@dataclass(frozen=True)
class Error:
    """What a way keeps, and of a sample of instances what the float64 oracle says of that."""

    part: str
    label: str
    instances: int
    kept: int
    sample: int
    hidden: int
    """Of the sample, hidden for certain."""
    hidden_kept: int
    """Of these, kept."""
    false_culls: int
    """Of the sample, visible for certain and culled."""
    promises: bool
    """Whether a false cull would be a bug."""

    @property
    def hidden_share(self) -> float:
        """`hidden` / `sample`."""
        return self.hidden / max(self.sample, 1)

    @property
    def hidden_kept_share(self) -> float:
        """`hidden_kept` / `hidden`."""
        return self.hidden_kept / max(self.hidden, 1)


@dataclass(frozen=True)
class InstanceCount:
    """One number of instances, 95 % of them hidden."""

    instances: int
    pieces: int
    upload_ms: float
    flat_ms: float
    groups_ms: float
    device_bytes: int
    """Of the instances and of what a cull for mask, indices and draws leaves."""
    texels: float
    """Texels read, an instance; flat."""
    tests: int
    """Tests spent with groups, of groups and of instances."""


@dataclass(frozen=True)
class ImageSize:
    """One square depth image."""

    side: int
    memcpy_ms: float
    reduce_ms: float
    groups_ms: float
    """The cull with groups of the crowd of `calls`."""
    device_bytes: int
    """Of the pyramid and the image."""
    texels: float
    """Texels read, an instance; flat."""


@dataclass(frozen=True)
class FirstCall:
    """A fresh process up to its first mask, in seconds: medians over the processes."""

    cache: Literal["cold"] | Literal["warm"]
    import_s: float
    device_s: float
    first_s: float
    """Uploads, depth, pyramid, cull and mask."""
    second_s: float
    """The same once more."""

    @property
    def total_s(self) -> float:
        """To the first mask."""
        return self.import_s + self.device_s + self.first_s


@dataclass
class Found:
    """A run of the bench."""

    command: str
    seed: int
    extent: str
    adapter: Adapter
    figures: list[Figure] = field(default_factory=list)
    times: list[Time] = field(default_factory=list)
    errors: list[Error] = field(default_factory=list)
    first_calls: list[FirstCall] = field(default_factory=list)
    instance_counts: list[InstanceCount] = field(default_factory=list)
    image_sizes: list[ImageSize] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """What was left out, and cliffs."""
    build: str = "release"
    """Of the extension module: ``"dev"`` or ``"release"``."""
    cores: int = 1
    load: list[float] = field(default_factory=list)
    """The system's load average before each part and at the end; empty where it has none."""
    seconds: float = 0.0

    def timed(self, part: str, ways: Mapping[str, Floats]) -> None:
        """Keeps what `rounds.in_turns` measured."""
        for label, ms in ways.items():
            self.times.append(Time(part, label, quartiles(ms), float(ms.min()), float(ms.max())))

    def number(
        self, key: str, label: str, value: float, unit: str, target: float | None = None
    ) -> None:
        """A figure that is counted, or taken once."""
        self.figures.append(Figure(key, label, value, unit, target=target))

    def spread(
        self, key: str, label: str, values: Floats, unit: str, target: float | None = None
    ) -> None:
        """A figure of which every round has one."""
        told = quartiles(values)
        self.figures.append(Figure(key, label, told.median, unit, told.q1, told.q3, target))

    def ratio(
        self,
        key: str,
        label: str,
        over: Floats,
        under: Floats,
        target: float | None = None,
        *,
        at_least: bool = False,
    ) -> None:
        """A ratio of medians, with the quartiles of the rounds' ratios."""
        value = float(np.median(over) / np.median(under))
        told = quartiles(over / under)
        self.figures.append(Figure(key, label, value, "x", told.q1, told.q3, target, at_least))

    def broken(self) -> list[str]:
        """Culls with the promise that hid what can be seen, in words: bugs."""
        return [
            f"{error.part}: {error.label}: {error.false_culls} visible instances culled"
            for error in self.errors
            if error.promises and error.false_culls
        ]

    @property
    def passed(self) -> bool:
        """Whether something was measured and no promise was broken. Targets that were missed are told, no more."""
        return bool(self.figures) and not self.broken()
