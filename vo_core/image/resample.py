"""Pictures at other positions, sizes and types."""

from __future__ import annotations

from mmap import mmap
from typing import Any

import numpy as np

from vo_core.errors import ShapeMismatch
from vo_core.rig import Camera
from vo_core.types import ByteImage, GrayImage, Image

SMALLEST_PX = 32


def to_grey(image: Image) -> Image:
    """Convert to grey on the scale 0 to 255, uint8 or float32; the input is not changed.

    Args:
        image: (H, W) or (H, W, 3) BGR; uint8, uint16, or float (values within 0 to 1 are scaled;
            negative or not finite ones count as black).
    Raises:
        ShapeMismatch: Another number of dimensions or channels, or smaller than 32x32.
    """
    import cv2

    image = np.asarray(image)
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[:, :, 0]
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise ShapeMismatch(f"An image is (H, W) or (H, W, 3); found {image.shape}.")
    if min(image.shape[:2]) < SMALLEST_PX:
        raise ShapeMismatch(f"An image is at least 32x32 px; found {image.shape[:2]}.")
    if image.dtype != np.uint8:
        sixteen_bit = image.dtype == np.uint16
        image = np.nan_to_num(image.astype(np.float32), posinf=0.0, neginf=0.0)
        np.maximum(image, 0.0, out=image)
        if sixteen_bit:
            image /= 257
        elif 0.0 < image.max() <= 1.0:
            image *= 255
    if image.ndim == 3:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
    return image


def grey_frame(camera: Camera, image: Image) -> Image:
    """Convert a frame of this camera to grey, see `to_grey`.

    Raises:
        ShapeMismatch: The frame has another size than the camera, or is not a picture.
    """
    grey = to_grey(image)
    height, width = grey.shape
    if (width, height) != (camera.width, camera.height):
        raise ShapeMismatch(
            f"The frame is {width}x{height} px, the rig's camera "
            f"{camera.width}x{camera.height} px; they must agree."
        )
    return grey


_NO_MAP: Any = None
"""Placeholder: remap takes columns and rows in one array or two, its stubs only two."""


def resample(image: GrayImage, positions_px: GrayImage) -> GrayImage:
    """Sample a picture at (H, W, 2) positions (column, row), bilinear; 0 outside.

    Bilinear, because the bicubic tables of OpenCV round positions to 1/32 px.
    """
    import cv2

    return np.asarray(
        cv2.remap(image, positions_px, _NO_MAP, cv2.INTER_LINEAR, borderValue=0), np.float32
    )


def resample_at(image: GrayImage, columns_px: GrayImage, rows_px: GrayImage) -> GrayImage:
    """Sample a picture like `resample`, at the columns and rows in two arrays of one shape."""
    import cv2

    return np.asarray(
        cv2.remap(image, columns_px, rows_px, cv2.INTER_LINEAR, borderValue=0), np.float32
    )


def resample_colour(image: ByteImage, positions_px: GrayImage) -> ByteImage:
    """Sample a colour picture like `resample`, but with the border continued outside."""
    import cv2

    seen = cv2.remap(
        image, positions_px, _NO_MAP, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(seen, np.uint8)


def resample_mask(mask: ByteImage, positions_px: GrayImage) -> ByteImage:
    """Sample a mask at (H, W, 2) positions (column, row), nearest pixel; 0 outside."""
    import cv2

    return np.asarray(
        cv2.remap(mask, positions_px, _NO_MAP, cv2.INTER_NEAREST, borderValue=0), np.uint8
    )


def reduce_to(image: Image, size_wh: tuple[int, int]) -> GrayImage:
    """Reduce a picture; each pixel becomes the mean of the area that it covers."""
    import cv2

    if image.shape[1::-1] == size_wh:
        return np.asarray(image, np.float32)
    return np.asarray(cv2.resize(image, size_wh, interpolation=cv2.INTER_AREA), np.float32)


def kept_apart(image: Image) -> Image:
    """A copy of a picture in memory of its own, which goes back to the system as a whole.

    Many pictures that are dropped at once would leave the process as large as with them.
    """
    kept = np.frombuffer(mmap(-1, image.nbytes), image.dtype).reshape(image.shape)
    kept[...] = image
    return kept


def halve(image: GrayImage) -> GrayImage:
    """Halve the size by averaging 2x2 pixels; an odd last row or column is left out."""
    height, width = image.shape
    even = image[: height // 2 * 2, : width // 2 * 2]
    return reduce_to(even, (width // 2, height // 2))


def halve_mask(mask: ByteImage) -> ByteImage:
    """A mask at half the size, as `halve`: 1 where all of it is 1."""
    return (halve(mask.astype(np.float32)) > 0.99).astype(np.uint8)


def double(image: GrayImage, out: GrayImage | None = None) -> GrayImage:
    """Double the size, smoothly: pixel p moves to 2 p.  `out` is memory for the result."""
    import cv2

    return np.asarray(cv2.pyrUp(image, dst=out), np.float32)


def even_pixels_of_double(image: GrayImage) -> GrayImage:
    """Every second row and column of `double`: the pixels of the picture, smoothed as there."""
    import cv2

    smooth = np.array([1, 6, 1], np.float32) / 8
    return np.asarray(cv2.sepFilter2D(image, cv2.CV_32F, smooth, smooth), np.float32)
