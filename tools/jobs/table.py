"""Times ways of one job in turns, loads the examples, and prints tables."""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

__all__ = ["ROOT", "best_ms", "load", "print_table"]

ROOT = Path(__file__).resolve().parents[2]


def load(path: str) -> Any:
    """A script of the repository as a module, such as ``examples/driving_boxes.py``."""
    name = Path(path).stem
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, ROOT / path)
        assert spec is not None
        assert spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


def best_ms(ways: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """The least wall time of each way, run in turns after one untimed call of each."""
    for way in ways.values():
        way()
    best = dict.fromkeys(ways, float("inf"))
    for _ in range(rounds):
        for name, way in ways.items():
            begin = time.perf_counter()
            way()
            best[name] = min(best[name], 1e3 * (time.perf_counter() - begin))
    return best


def print_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """A table in Markdown; all columns but the first are numbers."""
    print("| " + " | ".join(head) + " |")
    print("|---" + "|---:" * (len(head) - 1) + "|")
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print(flush=True)
