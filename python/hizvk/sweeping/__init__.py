"""`hizvk.sweep`: many views on one machine or on many, and what is made of it.

A sweep is cut into blocks of views.
Each block is one call of a function, which any `concurrent.futures.Executor` may run.

- `scene`: bounds and occluders as they travel to a worker, and their digest
- `spool`: the file from which workers of the same machine read the scene
- `workers`: what a process that runs blocks keeps, and how it runs one
- `blocks`: hands blocks to an executor, and the scene to each worker that asks for it
- `result`: `Sweep`, the bits of all views, and `SweepInterrupted`, which has a part of them
- `arguments`: the arguments of `sweep`, checked
- `entry`: `sweep`
- `cubes`: `cube`, six cameras for all directions
- `cells`: `visible_sets`, what is seen from samples of cells
- `terrain`: `viewshed`, what is seen of a height field

The package is not called ``sweep``: a module of that name would take the function's place as soon
as a worker imports it.
"""

from __future__ import annotations

from .cells import visible_sets
from .cubes import cube
from .entry import sweep
from .result import Sweep, SweepInterrupted
from .terrain import viewshed

__all__ = ["Sweep", "SweepInterrupted", "cube", "sweep", "viewshed", "visible_sets"]
