"""Counts of pixels beside rays in the scenes of the bench, as ``docs/counts.md`` tells of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from hizvk.scenes.embree import can_cast
from tools.counts import measure

if TYPE_CHECKING:
    import hizvk

#: The castle is not part of the repository; `tools.counts` measures it where it is there.
SCENES = ("mountains", "city", "city-far", "room")


@pytest.mark.skipif(not can_cast(), reason="rays need embreex, which is not installed")
def test_no_count_is_out_of_bounds_and_fractions_are_close(device: hizvk.Device) -> None:
    errors = []
    for scene in SCENES:
        row = measure(device, scene, 100, 1, None)
        assert row.objects > 30, scene
        assert row.broken == 0, scene
        errors.append(np.abs(np.array(row.found) - np.array(row.truth)).mean())
    assert np.mean(errors) < 0.02
