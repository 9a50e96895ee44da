"""Where a tower has to stand, and how high, to see behind a ridge: viewsheds of a terrain.

The terrain is flat but for a ridge of 8 m that runs across it.
From the ground the ridge hides all that lies behind it.
"""

import numpy as np
import numpy.typing as npt

import hizvk

CELL = 10.0  # metres between heights
RIDGE, BEHIND = 12, 14  # columns: of the ridge, and from which on the ground behind it counts


def terrain() -> npt.NDArray[np.float64]:
    """Heights in metres, a row to the north of the one before it."""
    heights = np.zeros((9, 40))
    heights[:, RIDGE] = 8.0
    return heights


def drawn(seen: npt.NDArray[np.bool_]) -> str:
    """A picture of characters: a dot for what is seen, a hash for what is not."""
    return "\n".join("".join(".#"[not cell] for cell in row) for row in seen[::-1])


def main() -> None:
    """Looks from the same place at two heights."""
    heights = terrain()
    place = (4, 2)  # row, column
    counts = {}
    for name, eye_height in (("the ground", 1.7), ("a tower", 60.0)):
        # One call: six views around the eye, with conservative depth.
        seen = hizvk.viewshed(heights, CELL, place, eye_height=eye_height)
        print(f"from {name}, {eye_height} m:\n{drawn(seen)}")
        counts[name] = int(seen[:, BEHIND:].sum())
    print("cells seen behind the ridge:", ", ".join(f"{n} from {who}" for who, n in counts.items()))


if __name__ == "__main__":
    main()
