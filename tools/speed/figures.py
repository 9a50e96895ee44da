"""What was measured, as plain objects: figures beside their targets, times, errors, sizes."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hizvk.commands.report import versions
from hizvk.measuring.spread import over_rounds

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hizvk.adapter import Adapter
    from hizvk.measuring.spread import Spread
    from hizvk.scenes.grid import Floats

__all__ = [
    "Error",
    "Figure",
    "FirstCall",
    "Found",
    "ImageSize",
    "InstanceCount",
    "Time",
    "WholeCall",
]


@dataclass(frozen=True)
class Figure:
    """A number, its target, and whether it reaches it."""

    key: str
    """``part.name``, the same in every run."""
    label: str
    value: float
    unit: str = "x"
    """``"x"`` (a ratio of medians), ``"ms"``, ``"s"``, ``"ns"``, ``"culls"``, ``"share"``, ..."""
    q1: float | None = None
    """Quartiles over the rounds; of a ratio, those of the rounds' own ratios."""
    q3: float | None = None
    target: float | None = None
    """None: reported, not judged."""
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
    """If far above the median: other work on the machine, or a shader that was compiled again."""


@dataclass(frozen=True)
class Error:
    """What a way of culling keeps, and what the float64 oracle says about a sample of it."""

    part: str
    label: str
    instances: int
    kept: int
    sample: int
    hidden: int
    """Of the sample: certainly hidden."""
    hidden_kept: int
    """Of these: kept."""
    false_culls: int
    """Of the sample: certainly visible and culled."""
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
    """Of the instances, and of the outputs of a cull for mask, indices and draws."""
    texels: float
    """Texels read per instance, without groups."""
    tests: int
    """Tests of groups and of instances, with groups."""


@dataclass(frozen=True)
class ImageSize:
    """One square depth image."""

    side: int
    memcpy_ms: float
    reduce_ms: float
    groups_ms: float
    """The cull of `Workload.calls` instances with groups."""
    device_bytes: int
    """Of the pyramid and the image."""
    texels: float
    """Texels read per instance, without groups."""


@dataclass(frozen=True)
class WholeCall:
    """A call from meshes to a mask on the host: medians in milliseconds, each part waited for."""

    bounds: int
    rasteriser: str
    render_ms: float
    reduce_ms: float
    cull_ms: float
    read_ms: float
    whole_ms: Spread
    kept: int


@dataclass(frozen=True)
class FirstCall:
    """A fresh process up to its first mask, in seconds: medians over the processes."""

    cache: Literal["cold"] | Literal["warm"]
    import_s: float
    device_s: float
    first_s: float
    """Uploads, depth, pyramid, cull and mask."""
    second_s: float
    """The same again."""

    @property
    def total_s(self) -> float:
        """Up to the first mask."""
        return self.import_s + self.device_s + self.first_s


@dataclass
class Found:
    """A run."""

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
    whole_calls: list[WholeCall] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """What was left out, and cliffs."""
    build: str = "release"
    """Of the extension module: ``"dev"`` or ``"release"``."""
    cores: int = 1
    load: list[float] = field(default_factory=list)
    """The system's load average before each part and at the end; empty where it has none."""
    seconds: float = 0.0

    def timed(self, part: str, ways: Mapping[str, Floats]) -> None:
        """Adds what `rounds.in_turns` measured."""
        for label, ms in ways.items():
            self.times.append(Time(part, label, over_rounds(ms), float(ms.min()), float(ms.max())))

    def number(
        self, key: str, label: str, value: float, unit: str, target: float | None = None
    ) -> None:
        """Adds a figure that is counted, or taken once."""
        self.figures.append(Figure(key, label, value, unit, target=target))

    def spread(
        self, key: str, label: str, values: Floats, unit: str, target: float | None = None
    ) -> None:
        """Adds a figure of which every round has one."""
        told = over_rounds(values)
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
        """Adds a ratio of medians, with the quartiles of the rounds' ratios."""
        value = float(np.median(over) / np.median(under))
        told = over_rounds(over / under)
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
        """Whether something was measured and no promise was broken; missed targets do not count."""
        rows = self.figures or self.first_calls or self.instance_counts or self.image_sizes
        return bool(rows or self.whole_calls) and not self.broken()

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "passed": self.passed,
            **asdict(self),
            "versions": versions(),
            "figures": [figure.as_data() for figure in self.figures],
        }
