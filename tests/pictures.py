"""Reads the PNG files that tests look at, by the format's own words and no library."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt


def decoded(file: bytes) -> npt.NDArray[np.uint8]:
    """``(height, width, channels)`` of a PNG of 8 bits per channel, not interlaced.

    The checksum of each chunk is compared, and all five filters are undone (PNG specification,
    third edition, W3C 2025, section 9).
    """
    assert file[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, list[tuple[bytes, bytes]]()
    while at < len(file):
        (length,) = struct.unpack_from(">I", file, at)
        name, body = file[at + 4 : at + 8], file[at + 8 : at + 8 + length]
        (check,) = struct.unpack_from(">I", file, at + 8 + length)
        assert check == zlib.crc32(name + body)
        chunks.append((name, body))
        at += 12 + length
    assert (chunks[0][0], chunks[-1]) == (b"IHDR", (b"IEND", b""))
    width, height, bits, colour_type, packing, filtering, interlace = struct.unpack(
        ">2I5B", chunks[0][1]
    )
    assert (bits, packing, filtering, interlace) == (8, 0, 0, 0)
    channels = {0: 1, 2: 3, 6: 4}[colour_type]
    raw = zlib.decompress(b"".join(body for name, body in chunks if name == b"IDAT"))
    rows = np.frombuffer(raw, np.uint8).reshape(height, width * channels + 1)
    image = np.zeros((height, width * channels), np.uint8)
    above = np.zeros(width * channels, np.uint8)
    for row, (kind, line) in enumerate(zip(rows[:, 0].tolist(), rows[:, 1:], strict=True)):
        image[row] = above = _unfiltered(kind, line, above, channels)
    return image.reshape(height, width, channels)


def _unfiltered(
    kind: int, line: npt.NDArray[np.uint8], above: npt.NDArray[np.uint8], channels: int
) -> npt.NDArray[np.uint8]:
    if kind in (0, 2):
        return line + above if kind == 2 else line
    if kind == 1:
        pixels = line.reshape(-1, channels)
        return np.cumsum(pixels, axis=0, dtype=np.uint8).reshape(-1)
    found, before = line.tolist(), above.tolist()
    for i in range(len(found)):
        a = found[i - channels] if i >= channels else 0
        b, c = before[i], before[i - channels] if i >= channels else 0
        if kind == 3:
            guess = (a + b) // 2
        else:  # Paeth 1991
            p = a + b - c
            pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
            guess = a if pa <= pb and pa <= pc else b if pb <= pc else c
        found[i] = (found[i] + guess) % 256
    return np.array(found, np.uint8)


def near(image: npt.NDArray[np.uint8], colour: tuple[int, int, int], room: int = 40) -> int:
    """How many pixels have about this colour."""
    apart = np.abs(image[..., :3].astype(int) - colour).max(axis=2)
    return int(np.count_nonzero(apart <= room))
