"""`hizvk.recommend`: measures the caller's own scene and says which configuration to use.

Some candidates are proven for every ray, others only for the pixels of one image.
So each candidate is checked against what can be seen, and one that hides something visible is never
recommended.
Of the others, the one that keeps fewer instances is right more often.

- `entry`, `arguments`: `recommend` and what it takes
- `candidate`: one measured configuration, and the choice among several
- `tried`: which configurations are tried first
- `axes`: what is tried then, one axis after the other
- `search`: measures them, checks them and chooses
- `timing`: times every candidate on every camera, in turns
- `checking`: what the candidates hide: by rays at the triangles, or by the oracle
- `blockers`: the rays: float64, at the occluders' triangles
- `answer`: `Recommendation`, and its notes in words
"""

from __future__ import annotations

from .answer import Recommendation
from .candidate import Candidate, choose
from .entry import recommend

__all__ = ["Candidate", "Recommendation", "choose", "recommend"]
