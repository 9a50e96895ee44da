"""Checks what a wheel of hizvk says about itself and what it holds: `inspect_wheel.py WHEEL`."""

import re
import struct
import sys
import zipfile
from email.parser import HeaderParser
from pathlib import PurePosixPath

# The newest glibc that the wheel may need: that of Debian 10 and RHEL 8.
NEWEST_GLIBC = (2, 28)
ALIASES = {"manylinux1": (2, 5), "manylinux2010": (2, 12), "manylinux2014": (2, 17)}
EXPECTED = {"hizvk/__init__.py", "hizvk/_core.pyi", "hizvk/py.typed"}
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


def glibc_of(platform: str) -> tuple[int, int]:
    """`manylinux_2_28_x86_64` -> (2, 28)."""
    if match := re.match(r"manylinux_(\d+)_(\d+)_", platform):
        return int(match[1]), int(match[2])
    return ALIASES[platform.split("_")[0]]


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
        [module] = [name for name in names if name.endswith(".so")]
        binary = wheel.read(module)
        needed = needed_libraries(binary)

    for tag in tags:
        python, abi, platform = tag.split("-")
        assert (python, abi) == ("cp311", "abi3"), f"tag: expected cp311-abi3, got {tag}"
        assert glibc_of(platform) <= NEWEST_GLIBC, (
            f"tag: expected glibc {NEWEST_GLIBC} or older, got {tag}"
        )
    assert tags, "the wheel has no tag"

    required = [entry for entry in metadata.get_all("Requires-Dist", []) if "extra ==" not in entry]
    projects = [re.split(r"[ <>=!~;\[]", entry)[0] for entry in required]
    assert projects == ["numpy"], f"dependencies: expected numpy alone, got {required}"
    assert module == "hizvk/_core.abi3.so", f"module: expected hizvk/_core.abi3.so, got {module}"
    assert names >= EXPECTED, f"missing: {EXPECTED - names}"
    licences = {PurePosixPath(name).name for name in names if f"{info}/licenses/" in name}
    assert licences == {"LICENSE-MIT", "LICENSE-APACHE"}, f"licences: got {licences}"
    strangers = {name for name in names if not name.startswith(("hizvk/", info))}
    assert not strangers, f"files outside of the package: {strangers}"
    for feature, word in DEVELOPERS_WORDS.items():
        assert word not in binary, (
            f"the module was built with the feature {feature}: {word!r} is in it"
        )
    linked = {name for name in needed if not name.startswith("ld-linux")}
    assert linked <= SYSTEM_LIBRARIES, (
        f"linked libraries: {linked - SYSTEM_LIBRARIES} are not on every system"
    )
    print(f"wheel: {', '.join(tags)}, {len(names)} files")
    print(f"wheel: requires {', '.join(required)}; links {', '.join(sorted(linked))}")


if __name__ == "__main__":
    main(sys.argv[1])
