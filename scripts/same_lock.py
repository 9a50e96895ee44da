"""Checks that a Cargo.lock holds nothing that another one does not: `same_lock.py WHOLE PART`."""

import sys
import tomllib
from pathlib import Path


def packages(path: str) -> set[tuple[str, str, str]]:
    """Name, version and checksum of every package; those of this workspace have no checksum."""
    lock = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    return {(one["name"], one["version"], one.get("checksum", "")) for one in lock["package"]}


def main(whole: str, part: str) -> None:
    """Ends with an error that names the packages which are in the part alone."""
    strangers = sorted(packages(part) - packages(whole))
    if strangers:
        named = ", ".join(f"{name} {version}" for name, version, _ in strangers)
        sys.exit(f"error: {part}: expected packages of {whole} alone, got {named}")
    print(f"{len(packages(part))} of {len(packages(whole))} locked packages are needed")


if __name__ == "__main__":
    main(*sys.argv[1:])
