"""Sphinx: the README and the Python interface. `make docs` builds it."""

import tomllib
from pathlib import Path

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
# Defaults are shown as they are written (`2**-23`), not as what they evaluate to.
autodoc_preserve_defaults = True
myst_heading_anchors = 3
# The README links to files that are no pages here, and its Rust blocks are marked as rustdoc wants
# them.
suppress_warnings = ["myst.xref_missing", "misc.highlighting_failure"]
