"""Phase correlation (Kuglin & Hines 1975) and rotation from the polar spectrum.

With b(p) = a(p - s) the spectra satisfy B = A exp(-i k.s), so F^-1{conj(A) B / |A B|} peaks at s,
the motion of the content from a to b: +x right, +y down.  A band-pass on the normalised product
keeps the frequencies of the wall's texture, and a parabola through its logarithms locates the peak.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from vo_core.image.filters import magnitude, parabola_peak, smooth, taper
from vo_core.types import ByteImage, GrayImage

LOCK_PSR = 8.0
"""Peak-to-sidelobe ratio of a true match; without a match it stays below 6 (measured)."""

LOBE_PX = 6
"""Values closer to a peak than this belong to it."""


@dataclass(frozen=True, slots=True)
class Peak:
    """One peak of a correlation surface."""

    dx_px: float
    dy_px: float
    height: float
    """1 at a perfect match before the band-pass; comparable within one surface."""
    psr: float
    """(height - mean) / deviation of the surface with its peaks set to 0; see `LOCK_PSR`."""


def spectrum(image: GrayImage, window: GrayImage) -> GrayImage:
    """Packed spectrum of a windowed picture, padded with zeros to an even size that is fast.

    The spectrum of a real picture fits into a real array of the same size (OpenCV's CCS order), at
    a quarter of the cost of a complex one.
    """
    return np.asarray(cv2.dft(_padded(image, window)), np.float32)


def window_of(seen: ByteImage) -> GrayImage:
    """Window for pictures of the wall, (H, W): it tapers over a fifth of the shorter side."""
    return taper(seen, max(4, min(seen.shape) // 5))


def correlation(reference: GrayImage, moving: GrayImage) -> GrayImage:
    """Correlation surface of two spectra, normalised and band-passed; lag zero at (0, 0)."""
    product = cv2.mulSpectrums(moving, reference, 0, conjB=True)
    power = cv2.mulSpectrums(product, product, 0, conjB=True)
    # The imaginary parts are 0; the power is copied there, because it divides both parts.
    power[:, 2:-1:2] = power[:, 1:-2:2]
    power[2:-1:2, [0, -1]] = power[1:-2:2, [0, -1]]
    product *= _band_pass(*product.shape) / (cv2.sqrt(power) + np.float32(1e-9))
    return np.asarray(cv2.dft(product, flags=cv2.DFT_INVERSE | cv2.DFT_SCALE), np.float32)


def best_peaks(surface: GrayImage, count: int = 1) -> list[Peak]:
    """The highest peaks, highest first, each at least `LOBE_PX` away from those before it."""
    rest = surface.copy()
    places = []
    for _ in range(count):
        row, column = divmod(int(rest.argmax()), rest.shape[1])
        places.append((row, column, float(rest[row, column])))
        rows = np.arange(row - LOBE_PX, row + LOBE_PX + 1) % rest.shape[0]
        columns = np.arange(column - LOBE_PX, column + LOBE_PX + 1) % rest.shape[1]
        rest[np.ix_(rows, columns)] = 0  # 0 is its mean, as the band-pass removes the constant part
    mean, deviation = (float(v.item()) for v in cv2.meanStdDev(rest))
    return [
        Peak(*_subpixel(surface, row, column), height, (height - mean) / max(deviation, 1e-12))
        for row, column, height in places
    ]


def _subpixel(surface: GrayImage, row: int, column: int) -> tuple[float, float]:
    height, width = surface.shape
    across = surface[row, [column - 1, column, (column + 1) % width]]
    down = surface[[row - 1, row, (row + 1) % height], column]
    dx = column + _log_parabola(across)
    dy = row + _log_parabola(down)
    return (dx + width / 2) % width - width / 2, (dy + height / 2) % height - height / 2


def _log_parabola(three: GrayImage) -> float:
    """Offset of the maximum of the parabola through the logarithms of three neighbours."""
    left, middle, right = np.log(np.maximum(three.astype(np.float64), 1e-9)).tolist()
    return 0.0 if middle < max(left, right) else parabola_peak(left, middle, right)


def _padded(image: GrayImage, window: GrayImage) -> GrayImage:
    """Pad a windowed picture with zeros to an even size that is fast."""
    height, width = image.shape
    padded = np.zeros((_dft_size(height), _dft_size(width)), np.float32)
    np.multiply(image, window, out=padded[:height, :width])
    return padded


def _dft_size(length: int) -> int:
    """The next even size that is fast; an odd one would move every peak by half a pixel."""
    size: int = cv2.getOptimalDFTSize(length)
    while size % 2:
        size = cv2.getOptimalDFTSize(size + 1)
    return size


@lru_cache(maxsize=16)
def _band_pass(height: int, width: int) -> GrayImage:
    """W in packed order, scaled so that a perfect match peaks at 1.

    W = exp(-(r/low)^2/2) (1 - exp(-(r/high)^2/2)) of the frequency r.
    """
    low, high = 0.16, 0.02  # cycles per px
    r = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(width)[None, :])
    half = np.exp(-((r / low) ** 2) / 2) * (1 - np.exp(-((r / high) ** 2) / 2))
    half /= np.fft.irfft2(half).flat[0]
    packed = np.empty((height, width), np.float32)
    packed[:, 1:-1] = np.repeat(half[:, 1:-1], 2, axis=1)
    upper = half[: height // 2 + 1, [0, -1]]
    packed[:, [0, -1]] = np.vstack([upper[:1], np.repeat(upper[1:-1], 2, axis=0), upper[-1:]])
    return packed


ANGLES = 360
"""Angles of the polar spectrum, over half a turn."""


def polar_spectrum(image: GrayImage, window: GrayImage) -> GrayImage:
    """log|F| over (angle of half a turn, radius), without slow parts; only a rotation moves it."""
    padded = _padded(image, window)
    whole = np.asarray(cv2.dft(padded, flags=cv2.DFT_COMPLEX_OUTPUT), np.float32)
    half = np.fft.fftshift(whole[:, : padded.shape[1] // 2 + 1], axes=0)
    size = np.log1p(magnitude(half[..., 0], half[..., 1]))
    maps = _polar_maps(*size.shape)
    polar = np.asarray(cv2.remap(size, *maps, cv2.INTER_LINEAR), np.float32)
    return polar - smooth(polar, 9)


def rotation_between(reference: GrayImage, moving: GrayImage) -> float:
    """Rotation of the content, x towards y, between two polar spectra, within the limit."""
    # Largest rotation that is searched for: the paper's 10 degrees plus a margin.
    rotation_limit_rad = float(np.radians(12))
    spectra = [np.fft.rfft(polar, axis=0) for polar in (reference, moving)]
    curve = np.fft.irfft((np.conj(spectra[0]) * spectra[1]).sum(1), n=ANGLES)
    curve = np.convolve(np.r_[curve[-2:], curve, curve[:2]], np.hanning(7)[1:-1], "valid")
    step_rad = np.pi / ANGLES
    reach = int(rotation_limit_rad / step_rad)
    lags = np.arange(-reach, reach + 1)
    best = int(lags[curve[lags].argmax()])
    offset = parabola_peak(*curve[[best - 1, best, (best + 1) % ANGLES]].tolist())
    return float((best + offset) * step_rad)


@lru_cache(maxsize=16)
def _polar_maps(height: int, half_width: int) -> tuple[GrayImage, GrayImage]:
    radius_range = (0.03, 0.35)  # radii of the polar spectrum, cycles per px
    angle = (np.arange(ANGLES)[:, None] / ANGLES - 0.5) * np.pi
    radius = np.linspace(*radius_range, 160)[None, :]
    # Frequencies count per side: a spectrum that is not square has different steps on its axes.
    x = radius * np.cos(angle) * 2 * (half_width - 1)
    y = height // 2 + radius * np.sin(angle) * height
    return x.astype(np.float32), y.astype(np.float32)
