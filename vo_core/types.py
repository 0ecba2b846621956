"""Array aliases; shapes are given where they are used."""

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Image = NDArray[Any]
"""(H, W) or (H, W, 3), any real dtype; three channels are BGR."""

GrayImage = NDArray[np.float32]
"""(H, W), grey levels on the scale 0 to 255."""

ByteImage = NDArray[np.uint8]
"""(H, W) grey or (H, W, 3) BGR."""

Matrix = NDArray[np.float64]
"""Small matrices and vectors: rotations, poses, covariances."""

AnyImage = TypeVar("AnyImage", ByteImage, GrayImage)
