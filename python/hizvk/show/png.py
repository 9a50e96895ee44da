"""Pictures of numpy arrays as PNG files in memory, with numpy and zlib alone.

The format is that of the PNG specification, third edition (W3C 2025): 8 bits per channel, no
interlacing, and filter 0 in each row.
"""

from __future__ import annotations

import base64
import struct
import zlib
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["png", "png_url"]

SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
#: The header's code of a colour type, by the number of channels.
COLOUR_TYPES: Final = {1: 0, 3: 2}


def png(image: npt.NDArray[np.uint8]) -> bytes:
    """A picture as the bytes of a PNG file.

    Parameters
    ----------
    image : (height, width, 3) or (height, width) uint8 array
        Colours or greys, row 0 on top; at least one pixel.
    """
    pixels = np.ascontiguousarray(image, np.uint8)
    height, width = pixels.shape[:2]
    rows = pixels.reshape(height, -1)
    # Each row begins with the number of its filter.
    filtered = np.zeros((height, rows.shape[1] + 1), np.uint8)
    filtered[:, 1:] = rows
    colour_type = COLOUR_TYPES[rows.shape[1] // width]
    header = struct.pack(">2I5B", width, height, 8, colour_type, 0, 0, 0)
    return b"".join(
        [
            SIGNATURE,
            _chunk(b"IHDR", header),
            _chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6)),
            _chunk(b"IEND", b""),
        ]
    )


def png_url(file: bytes) -> str:
    """The file as a ``data:`` address, which an HTML page can hold."""
    return "data:image/png;base64," + base64.b64encode(file).decode("ascii")


def _chunk(name: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
