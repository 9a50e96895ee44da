"""Pictures of what a cull did, for notebooks, figures and browsers.

Nothing here decides anything, and a cull never loads it.
The methods of `CullResult`, `Pyramid`, `DepthImage` and `Explanation` come here when something is
drawn.
Pictures in notebooks and pages need numpy alone; figures need matplotlib (the extra ``viz``).
"""

from .web import page

__all__ = ["page"]
