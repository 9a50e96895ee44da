"""The command line: ``hizvk info | doctor | demo | bench``."""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import importlib.util
import json
import os
import platform
import sys
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import hizvk

from . import _core
from .commands import pipes
from .doctor import checks, install_hint

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]

#: Variables that choose drivers and adapters.
VARIABLES: Final = ("HIZVK_ADAPTER", "VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES")
#: The commands that are packages of their own; each has ``main(arguments) -> exit code``.
DELEGATED: Final = {
    "demo": "the demo scene: culls it, draws it, checks it",
    "bench": "measures speed and error on this machine",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command and returns the exit code.

    0: good; 1: something is wrong; 2: wrong usage; 141: nobody read the output to its end.
    """
    return pipes.run(lambda: _command(list(sys.argv[1:] if arguments is None else arguments)))


def _command(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        prog="hizvk", description="Occlusion culling that never hides what can be seen."
    )
    parser.add_argument("--version", action="version", version=f"hizvk {hizvk.__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="command")
    for name, help_text in (
        ("info", "versions and adapters"),
        ("doctor", "checks that culling works here"),
    ):
        command = commands.add_parser(name, help=help_text, description=help_text)
        command.add_argument("--json", action="store_true", help="print one JSON object")
    for name, help_text in DELEGATED.items():
        commands.add_parser(name, help=help_text, add_help=False)
    if arguments and arguments[0] in DELEGATED:
        # Its own package parses the rest, --help and --json included.
        return _delegate(arguments[0], arguments[1:])
    parsed = parser.parse_args(arguments)
    return _info(parsed.json) if parsed.command == "info" else _doctor(parsed.json)


def _delegate(name: str, arguments: list[str]) -> int:
    """Runs ``hizvk.<name>.main(arguments)``."""
    if importlib.util.find_spec(f"hizvk.{name}") is None:
        print(f"hizvk {name}: not part of this build", file=sys.stderr)
        return 2
    code: int = importlib.import_module(f"hizvk.{name}").main(arguments)
    return code


def information() -> dict[str, Any]:
    """The output of `info` as plain data."""
    return {
        "hizvk": hizvk.__version__,
        "build": _core.__build__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "platform": platform.platform(),
        "environment": {name: os.environ[name] for name in VARIABLES if name in os.environ},
        "adapters": [dataclasses.asdict(adapter) for adapter in hizvk.adapters()],
    }


def _info(as_json: bool) -> int:
    told = information()
    if as_json:
        print(json.dumps(told, indent=2))
        return 0
    for name in ("hizvk", "build", "python", "numpy", "platform"):
        print(f"{name:9} {told[name]}")
    for name, value in told["environment"].items():
        print(f"{name}={value}")
    print("adapters")
    for adapter in told["adapters"]:
        print(f"  {hizvk.Adapter(**adapter)}")
    if not told["adapters"]:
        print(f"  none: {install_hint()}")
    return 0


def _doctor(as_json: bool) -> int:
    found = checks()
    healthy = all(check.passed for check in found)
    if as_json:
        told = [{**dataclasses.asdict(check), "meaning": check.meaning} for check in found]
        print(json.dumps({"healthy": healthy, "checks": told}, indent=2))
        return 0 if healthy else 1
    for check in found:
        print(f"{'ok  ' if check.passed else 'FAIL'} {check.name}: {check.detail}")
        print(f"     {check.meaning}")
        if check.advice:
            print(f"     -> {check.advice}")
    failed = sum(not check.passed for check in found)
    if failed:
        print(f"{failed} of {len(found)} failed; the line with -> below each says what to do")
    else:
        print("all is well: culls work here")
    return 0 if healthy else 1
