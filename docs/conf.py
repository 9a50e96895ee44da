"""Sphinx: the pages of this folder, the documents beside it and the Python interface.

`make docs` builds it; a dead link or reference fails the build.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_root = Path(__file__).parent.parent
_cargo = tomllib.loads((_root / "Cargo.toml").read_text(encoding="utf-8"))

project = "hizvk"
author = "hizvk contributors"
copyright = "hizvk contributors"
release = version = _cargo["workspace"]["package"]["version"]

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"hizvk {release}"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
# Defaults are shown as they are written (`2**-23`), not as values.
autodoc_preserve_defaults = True
# Types of parameters are prose, such as "a sequence of meshes".
# As fields of their own, their words would be links to whatever attribute has such a name.
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_use_keyword = False
myst_heading_anchors = 3

#: Documents beside this folder that are pages here, under their name in lower case.
_BESIDE = ("ARCHITECTURE", "CHANGELOG", "CONTRIBUTING", "STYLE")


def _read_beside(app: Sphinx, page: str, source: list[str]) -> None:
    """The text of a document beside this folder, with its links as they are from here."""
    if page.upper() not in _BESIDE:
        return
    path = _root / f"{page.upper()}.md"
    app.env.note_dependency(str(path))
    text = path.read_text(encoding="utf-8")
    text = text.replace("](docs/", "](")
    for name in _BESIDE:
        text = text.replace(f"]({name}.md", f"]({name.lower()}.md")
    source[0] = text


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("source-read", _read_beside)
