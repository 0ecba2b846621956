"""Rendered films with a burnt-in distance counter whose value in every field is known exactly.

Every film has a moving wall behind the text, other text beside the counter, and the losses of a
coder.  The fonts are those of OpenCV, matplotlib and Pillow, a dot matrix and seven segments.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from pathlib import Path

import av
import cv2
import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

TTF = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
OPENCV = {
    "opencv": cv2.FONT_HERSHEY_SIMPLEX,
    "opencv duplex": cv2.FONT_HERSHEY_DUPLEX,
    "opencv small": cv2.FONT_HERSHEY_PLAIN,
}
DOTS = {
    "0": ["01110", "10001", "10011", "10101", "11001", "10001", "01110"],
    "1": ["00100", "01100", "00100", "00100", "00100", "00100", "01110"],
    "2": ["01110", "10001", "00001", "00110", "01000", "10000", "11111"],
    "3": ["11111", "00010", "00100", "00010", "00001", "10001", "01110"],
    "4": ["00010", "00110", "01010", "10010", "11111", "00010", "00010"],
    "5": ["11111", "10000", "11110", "00001", "00001", "10001", "01110"],
    "6": ["00110", "01000", "10000", "11110", "10001", "10001", "01110"],
    "7": ["11111", "00001", "00010", "00100", "01000", "01000", "01000"],
    "8": ["01110", "10001", "10001", "01110", "10001", "10001", "01110"],
    "9": ["01110", "10001", "10001", "01111", "00001", "00010", "01100"],
    ".": ["00000", "00000", "00000", "00000", "00000", "01100", "01100"],
    ":": ["00000", "01100", "01100", "00000", "01100", "01100", "00000"],
    "+": ["00000", "00100", "00100", "11111", "00100", "00100", "00000"],
    "-": ["00000", "00000", "00000", "11111", "00000", "00000", "00000"],
    "/": ["00000", "00001", "00010", "00100", "01000", "10000", "00000"],
    "m": ["00000", "00000", "11010", "10101", "10101", "10101", "10101"],
    "M": ["10001", "11011", "10101", "10101", "10001", "10001", "10001"],
    "F": ["11111", "10000", "10000", "11110", "10000", "10000", "10000"],
    "T": ["11111", "00100", "00100", "00100", "00100", "00100", "00100"],
    "f": ["00110", "01001", "01000", "11100", "01000", "01000", "01000"],
    "t": ["01000", "01000", "11100", "01000", "01000", "01001", "00110"],
    "D": ["11100", "10010", "10001", "10001", "10001", "10010", "11100"],
    "I": ["01110", "00100", "00100", "00100", "00100", "00100", "01110"],
    "S": ["01111", "10000", "10000", "01110", "00001", "00001", "11110"],
    "H": ["10001", "10001", "10001", "11111", "10001", "10001", "10001"],
    " ": ["00000"] * 7,
}
SEGMENTS = {
    "0": "abcdef", "1": "bc", "2": "abged", "3": "abgcd", "4": "fgbc", "5": "afgcd",
    "6": "afgedc", "7": "abc", "8": "abcdefg", "9": "abcdfg", "-": "g", " ": "",
}  # fmt: skip
TRUETYPE = {
    "sans": "DejaVuSans.ttf",
    "sans bold": "DejaVuSans-Bold.ttf",
    "mono": "DejaVuSansMono.ttf",
    "serif": "DejaVuSerif.ttf",
    "typewriter": "cmtt10.ttf",
}
FONTS = (*OPENCV, *TRUETYPE, "pillow", "dots", "segments")

WHITE, YELLOW, GREEN, RED, BLACK = (
    (235, 235, 235), (40, 225, 235), (60, 230, 60), (40, 40, 235), (15, 15, 15),
)  # fmt: skip


@dataclass(frozen=True)
class Text:
    """A line of text at a fixed place."""

    pattern: str
    """With `{value}` for the counter, `{clock}` for the time of day."""
    left_top: tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class CounterFilm:
    """What a film shows; the counter drives, stops and goes on."""

    font: str = "opencv"
    height_px: int = 18
    """Of a digit."""
    colour: tuple[int, int, int] = WHITE
    backing: str = "outline"
    """What separates the text from the wall: outline, box, shadow or nothing."""
    counter: Text | None = Text("{value:06.1f} m", (60, 400))
    others: tuple[Text, ...] = (
        Text("2019/05/17", (420, 30)),
        Text("{clock}", (420, 62)),
        Text("MH 228 - 221", (60, 30)),
    )
    size_wh: tuple[int, int] = (720, 480)
    rate_hz: int = 10
    frames: int = 80
    speed: float = 0.3
    """Units of the counter per second."""
    start: float = 12.3
    step: float = 0.1
    """Smallest change of the counter."""
    jumps: tuple[tuple[int, float], ...] = ()
    """Frame and value at which the counter is set to another value."""
    stands: tuple[tuple[int, int], ...] = ()
    """Frames from and to which the counter does not move."""
    is_interlaced: bool = False
    blends: bool = False
    """Whether the frame of a tick shows the old and the new digit on top of each other."""
    wall: float = 90.0
    """Mean brightness of the wall."""
    contrast: float = 25.0
    noise: float = 3.0
    crf: int = 23
    seed: int = 1
    hidden: tuple[tuple[int, int], ...] = field(default=())
    """Frames from and to which no counter is shown."""


@dataclass(frozen=True)
class Shown:
    """A frame and the values that its two fields show; None without a counter."""

    image: np.ndarray
    values: tuple[float, ...] | None


def values(film: CounterFilm) -> np.ndarray:
    """The counter at twice the frame rate: one value for each field."""
    step = film.speed / film.rate_hz / 2
    jumps = {2 * frame: value for frame, value in film.jumps}
    value, found = film.start, []
    for index in range(2 * film.frames):
        moves = not any(2 * a <= index < 2 * b for a, b in film.stands)
        value = jumps.get(index, value + step * moves * (index > 0))
        found.append(value)
    return np.round(np.floor(np.array(found) / film.step + 1e-6) * film.step, 6)


def frames(film: CounterFilm) -> Iterator[Shown]:
    """Every frame, (H, W, 3) BGR."""
    rng = np.random.default_rng(film.seed)
    wall = _Wall(film, rng)
    shown = values(film)
    for index in range(film.frames):
        before = shown[max(2 * index - 1, 0)]
        first, second = shown[2 * index], shown[2 * index + 1]
        hidden = film.counter is None or any(a <= index < b for a, b in film.hidden)
        t_s = index / film.rate_hz
        picture = wall.at(index)
        if film.is_interlaced:
            picture[::2] = _written(film, picture, first, t_s, hidden)[::2]
            picture[1::2] = _written(film, picture, second, t_s, hidden)[1::2]
            seen = (first, second)
        elif film.blends and before != first:
            old, new = (_written(film, picture, v, t_s, hidden) for v in (before, first))
            picture, seen = (old + new) / 2, (before, first)
        else:
            picture, seen = _written(film, picture, first, t_s, hidden), (first,)
        picture = picture + rng.normal(0, film.noise, picture.shape)
        image = np.clip(picture, 0, 255).astype(np.uint8)
        yield Shown(image, None if hidden else tuple(float(v) for v in seen))


def write(film: CounterFilm, path: Path) -> list[tuple[float, ...] | None]:
    """Write a film as H.264; return the values of every frame."""
    truth = []
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(film.rate_hz))
        stream.width, stream.height = film.size_wh
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": str(film.crf), "preset": "veryfast"}
        for shown in frames(film):
            truth.append(shown.values)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(shown.image, format="bgr24")))
        container.mux(stream.encode())
    return truth


class _Wall:
    """A pipe along its axis while the camera drives: a texture that grows out of the middle."""

    def __init__(self, film: CounterFilm, rng: np.random.Generator) -> None:
        width, height = film.size_wh
        self.film = film
        rough = sum(
            cv2.resize(
                rng.normal(0, 1, (64 * n, 64 * n)), (1024, 1024), interpolation=cv2.INTER_LINEAR
            )
            for n in (1, 4, 8)
        )
        self.texture = (film.contrast * rough / rough.std()).astype(np.float32)
        x, y = np.meshgrid(np.arange(width), np.arange(height))
        dx, dy = x - 0.55 * width, y - 0.5 * height
        radius = np.hypot(dx, dy) + 8
        self.angle = ((np.arctan2(dy, dx) / (2 * np.pi) + 0.5) * 1023).astype(np.float32)
        self.depth = (60000 / radius).astype(np.float32)
        self.light = np.clip(radius / (0.35 * width), 0.05, 1.0).astype(np.float32)
        self.tint = np.array([0.8, 0.95, 1.1], np.float32)

    def at(self, index: int) -> np.ndarray:
        depth = np.mod(self.depth + 900 * self.film.speed * index / self.film.rate_hz, 1023)
        seen = cv2.remap(self.texture, self.angle, depth.astype(np.float32), cv2.INTER_LINEAR)
        return ((self.film.wall + seen) * self.light)[..., None] * self.tint


def _written(film, picture, value, t_s, hidden) -> np.ndarray:
    texts = film.others if hidden or film.counter is None else (*film.others, film.counter)
    out = picture.copy()
    clock = f"{14 + int(t_s) // 3600:02d}:{5 + int(t_s) // 60:02d}:{int(t_s) % 60:02d}"
    for text in texts:
        words = text.pattern.format(value=value, clock=clock)
        is_counter = text is film.counter
        font = film.font if is_counter or film.font != "segments" else "opencv"
        _put(out, words, text.left_top, replace(film, font=font))
    return out


def _put(out: np.ndarray, words: str, left_top: tuple[int, int], film: CounterFilm) -> None:
    mask = _line(film.font, words, film.height_px)
    mask = np.pad(mask, 4)
    left, top = left_top
    height, width = min(mask.shape[0], out.shape[0] - top), min(mask.shape[1], out.shape[1] - left)
    mask = mask[:height, :width, None]
    part = out[top : top + height, left : left + width]
    dark = sum(film.colour) < 300
    against = np.array((235, 235, 235) if dark else (5, 5, 5), float)
    match film.backing:
        case "box":
            part[:] = against
        case "outline":
            ring = cv2.dilate(mask[..., 0], np.ones((3, 3)))[..., None]
            part += ring * (against - part)
        case "shadow":
            ring = np.roll(mask, (2, 2), (0, 1))
            part += ring * (against - part)
    part += mask * (np.array(film.colour, float) - part)


@lru_cache(maxsize=4096)
def _line(font: str, words: str, height_px: int) -> np.ndarray:
    """(H, W) in [0, 1]: a line whose digits are `height_px` high."""
    if font in OPENCV:
        face = OPENCV[font]
        scale = height_px / cv2.getTextSize("0", face, 1.0, 1)[0][1]
        thickness = max(1, round(height_px / 10))
        (width, height), base = cv2.getTextSize(words, face, scale, thickness)
        canvas = np.zeros((height + base + 2, width + 4), np.uint8)
        smooth = cv2.LINE_8 if font == "opencv small" else cv2.LINE_AA
        cv2.putText(canvas, words, (2, height), face, scale, 255, thickness, smooth)
        return canvas.astype(np.float32) / 255
    if font == "dots":
        cells = [np.array([[int(c) for c in row] for row in DOTS[letter]]) for letter in words]
        rows = np.hstack([np.pad(cell, ((0, 0), (0, 1))) for cell in cells]).astype(np.float32)
        wide = max(1, round(height_px / 9))
        return cv2.resize(rows, (rows.shape[1] * wide, height_px), interpolation=cv2.INTER_NEAREST)
    if font == "segments":
        return np.hstack([_segments(letter, height_px) for letter in words])
    name = TTF / TRUETYPE[font] if font in TRUETYPE else None
    size = round(height_px / 0.73)
    face = ImageFont.truetype(str(name), size) if name else ImageFont.load_default(size)
    left, top, right, bottom = face.getbbox(words)
    canvas = Image.new("L", (round(right - left) + 2, round(bottom - top) + 2))
    ImageDraw.Draw(canvas).text((1 - left, 1 - top), words, font=face, fill=255)
    return np.asarray(canvas, np.float32) / 255


def _segments(letter: str, height_px: int) -> np.ndarray:
    """(H, W): a character of a seven-segment display; units stand smaller beside it."""
    thick = max(2, height_px // 8)
    if letter in ".:":
        cell = np.zeros((height_px, 2 * thick), np.float32)
        cell[-thick:, :thick] = 1
        return cell
    if letter not in SEGMENTS:
        small = _line("opencv", letter, height_px // 2)[:height_px]
        return np.pad(small, ((height_px - len(small), 0), (1, 1)))
    wide, middle = height_px * 5 // 9, height_px // 2
    across, left, right = (
        slice(1, wide - 1),
        slice(0, thick),
        slice(wide - thick, wide),
    )
    above, below = slice(1, middle - 1), slice(middle + 1, height_px - 1)
    bars = {
        "a": (slice(0, thick), across),
        "g": (slice(middle - thick // 2, middle - thick // 2 + thick), across),
        "d": (slice(height_px - thick, height_px), across),
        "f": (above, left),
        "b": (above, right),
        "e": (below, left),
        "c": (below, right),
    }
    cell = np.zeros((height_px, wide + 2 * thick), np.float32)
    for bar in SEGMENTS[letter]:
        cell[bars[bar]] = 1
    return cell
