"""The two fields of an interlaced picture of text: its even and its odd rows.

`vo_core.matching.fields` detects fields by the motion of the wall. A digit that ticks between the
fields combs on a standing wall too, and does not comb on a moving one.
"""

from __future__ import annotations

import numpy as np

from vo_core.types import ByteImage

COMBED = 1.2
"""Energy of the differences between neighbouring rows over that between every second row, from
which the fields show different digits. Of one text it is about 1, and up to 3 if small or noisy."""

BLANK = 0.05
"""Share of the variance of a crop below which these differences are noise."""


def field_of(picture: ByteImage, first: int) -> ByteImage:
    """Return every second row from the first on, interpolated to the size of the picture."""
    import cv2

    size = (picture.shape[1], picture.shape[0])
    return np.asarray(cv2.resize(picture[first::2], size, interpolation=cv2.INTER_LINEAR), np.uint8)


def combs(crop: ByteImage) -> bool:
    """Whether the two fields of a crop, (H, W, 3) BGR, show different digits.

    Neighbouring rows differ more than every second row does, in a part as wide as a digit.
    """
    import cv2

    rows = crop.astype(np.float32).mean(axis=2)
    near = rows[1:-3] + rows[3:-1] - 2 * rows[2:-2]
    far = rows[:-4] + rows[4:] - 2 * rows[2:-2]
    digit = (max(3, len(rows) // 3), max(3, len(rows) // 2))
    near_energy, far_energy = (
        cv2.blur(part * part, digit, borderType=cv2.BORDER_CONSTANT) for part in (near, far)
    )
    return bool((near_energy > COMBED * (far_energy + BLANK * rows.var())).any())
