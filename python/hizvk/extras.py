"""What to run to get the packages that pictures (`viz`) and ray-cast truth (`scene`) need.

hizvk is on no package index, so ``pip install hizvk[viz]`` would find nothing.
Where it was installed from a wheel that is still there, that wheel's path takes the extras.
"""

from __future__ import annotations

import json
from importlib import metadata
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit
from urllib.request import url2pathname

__all__ = ["install_line"]

#: The packages of the extras in pyproject.toml; a test compares them.
PACKAGES: Final = {"viz": ("matplotlib",), "scene": ("embreex",)}


def install_line(*extras: str) -> str:
    """The command that installs the packages of these extras."""
    wheel = _wheel()
    if wheel is not None:
        return f"pip install '{wheel}[{','.join(extras)}]'"
    return "pip install " + " ".join(name for extra in extras for name in PACKAGES[extra])


def _wheel() -> str | None:
    """The wheel that hizvk was installed from, if pip says so (PEP 610) and it is still there."""
    try:
        origin = metadata.distribution("hizvk").read_text("direct_url.json")
    except metadata.PackageNotFoundError:
        return None
    url = urlsplit(json.loads(origin or "{}").get("url", ""))
    path = Path(url2pathname(url.path))
    if url.scheme != "file" or path.suffix != ".whl" or not path.is_file():
        return None
    return str(path)
