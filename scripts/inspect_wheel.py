"""Checks what a wheel of hizvk says about itself and what it holds: `inspect_wheel.py WHEEL`."""

import json
import re
import struct
import sys
import tomllib
import zipfile
from email.parser import HeaderParser
from pathlib import Path, PurePosixPath
from typing import Any

# On Linux the glibc of Debian 10 and RHEL 8: `std` of Rust needs no symbol that is newer, and
# some that older tags do not have.
# check_wheel.sh lets auditwheel find out which symbols are needed.
PLATFORMS = re.compile(r"manylinux_2_28_(x86_64|aarch64)|macosx_\d+_\d+_(x86_64|arm64)|win_amd64")
# Crates whose lack would show that the bill of materials is not that of this module.
PARTS = ("wgpu", "wgpu-core", "naga", "pyo3", "numpy", "hiz_core", "hiz_ref")
# How crates are named in it: those of the registry, and those of this workspace without a place.
PLACES = ("registry+https://", "path+file:///crates/")
# The module on Linux and macOS, and on Windows.
MODULES = ("hizvk/_core.abi3.so", "hizvk/_core.pyd")
EXPECTED = {
    "hizvk/__init__.py", "hizvk/_core.pyi", "hizvk/py.typed", "hizvk/show/web.html",
    "hizvk/show/web.js",
}  # fmt: skip
# The features of crates/hiz_py that a wheel is built without, and what only they put into a module.
DEVELOPERS_WORDS = {"testing": b"HIZVK_PLANTED_FAULT", "yardstick": b"Yardstick"}
# Libraries that every Linux system has.
# Vulkan's loader is opened at run time and must not be linked.
SYSTEM_LIBRARIES = {
    "libc.so.6",
    "libm.so.6",
    "libdl.so.2",
    "libpthread.so.0",
    "librt.so.1",
    "libgcc_s.so.1",
}


def is_known(platform: str) -> bool:
    """Whether a wheel may have this tag of a platform: `manylinux_2_28_x86_64`."""
    return PLATFORMS.fullmatch(platform) is not None


def sbom_of(wheel: zipfile.ZipFile, info: str) -> dict[str, Any]:
    """The bill of materials of the Rust crates in the module, which maturin writes (PEP 770)."""
    path = f"{info}/sboms/hiz_py.cyclonedx.json"
    assert path in wheel.namelist(), f"no bill of materials: expected {path}"
    found: dict[str, Any] = json.loads(wheel.read(path))
    return found


def check_sbom(sbom: dict[str, Any]) -> None:
    """It names crates that Cargo.lock has, in these versions, each with its licence."""
    kind = (sbom["bomFormat"], sbom["specVersion"].split(".")[0])
    assert kind == ("CycloneDX", "1"), f"bill of materials: unknown format {kind}"
    lock = tomllib.loads((Path(__file__).parent.parent / "Cargo.lock").read_text(encoding="utf-8"))
    locked = {(one["name"], one["version"]) for one in lock["package"]}
    parts = {(one["name"], one["version"]) for one in sbom["components"]}
    missing = set(PARTS) - {name for name, _ in parts}
    assert not missing, f"bill of materials: missing {sorted(missing)}"
    assert parts <= locked, f"bill of materials: {sorted(parts - locked)} not in Cargo.lock"
    refs = [one["bom-ref"] for one in (sbom["metadata"]["component"], *sbom["components"])]
    placed = sorted(ref for ref in refs if not ref.startswith(PLACES))
    assert not placed, f"bill of materials: names of a build's folder: {placed}"
    silent = sorted(one["name"] for one in sbom["components"] if not one.get("licenses"))
    assert not silent, f"bill of materials: no licence of {silent}"


def needed_libraries(elf: bytes) -> list[str]:
    """The DT_NEEDED entries of a 64-bit little-endian shared object."""
    section_offset = struct.unpack_from("<Q", elf, 0x28)[0]
    entry_size, count = struct.unpack_from("<HH", elf, 0x3A)
    # A section header: name, type, flags, address, offset, size, link, ...
    sections = [
        struct.unpack_from("<IIQQQQI", elf, section_offset + k * entry_size) for k in range(count)
    ]
    names = []
    for _, kind, _, _, offset, size, link in sections:
        if kind != 6:  # SHT_DYNAMIC
            continue
        strings = sections[link][4]
        for tag, value in struct.iter_unpack("<qQ", elf[offset : offset + size]):
            if tag == 1:  # DT_NEEDED
                start = strings + value
                names.append(elf[start : elf.index(b"\0", start)].decode())
    return names


def main(path: str) -> None:
    """Checks the wheel, and prints what was found."""
    with zipfile.ZipFile(path) as wheel:
        names = set(wheel.namelist())
        info = next(name for name in names if name.endswith(".dist-info/WHEEL")).removesuffix(
            "/WHEEL"
        )
        tags = HeaderParser().parsestr(wheel.read(f"{info}/WHEEL").decode()).get_all("Tag", [])
        metadata = HeaderParser().parsestr(wheel.read(f"{info}/METADATA").decode())
        [module] = [name for name in names if name.endswith((".so", ".pyd"))]
        binary = wheel.read(module)
        sbom = sbom_of(wheel, info)

    for tag in tags:
        python, abi, platform = tag.split("-")
        assert (python, abi) == ("cp311", "abi3"), f"tag: expected cp311-abi3, got {tag}"
        assert is_known(platform), f"tag: expected {PLATFORMS.pattern}, got {tag}"
    assert tags, "the wheel has no tag"

    required = [entry for entry in metadata.get_all("Requires-Dist", []) if "extra ==" not in entry]
    projects = [re.split(r"[ <>=!~;\[]", entry)[0] for entry in required]
    assert projects == ["numpy"], f"dependencies: expected numpy alone, got {required}"
    assert module in MODULES, f"module: expected one of {MODULES}, got {module}"
    assert names >= EXPECTED, f"missing: {EXPECTED - names}"
    licences = {PurePosixPath(name).name for name in names if f"{info}/licenses/" in name}
    assert licences == {"LICENSE-MIT", "LICENSE-APACHE"}, f"licences: got {licences}"
    strangers = {name for name in names if not name.startswith(("hizvk/", info))}
    assert not strangers, f"files outside of the package: {strangers}"
    for feature, word in DEVELOPERS_WORDS.items():
        assert word not in binary, (
            f"the module was built with the feature {feature}: {word!r} is in it"
        )
    check_sbom(sbom)
    print(f"wheel: {', '.join(tags)}, {len(names)} files")
    print(f"wheel: requires {', '.join(required)}; {len(sbom['components'])} crates in its bill")
    if not binary.startswith(b"\x7fELF"):
        return
    linked = {name for name in needed_libraries(binary) if not name.startswith("ld-linux")}
    assert linked <= SYSTEM_LIBRARIES, (
        f"linked libraries: {linked - SYSTEM_LIBRARIES} are not on every system"
    )
    print(f"wheel: links {', '.join(sorted(linked))}")


if __name__ == "__main__":
    main(sys.argv[1])
