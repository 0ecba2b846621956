"""Measures how well the burnt-in counter is read, on rendered films with exact truth.

    python tests/measure counter [--write docs/accuracy.md]

A reading is right if one of the two fields of its frame shows it. In a coded film a tick may appear
one frame early or late; such readings are counted apart. Every frame with a counter is legible.
"""

# ruff: noqa: T201
from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from counter_films import BLACK, FONTS, GREEN, RED, YELLOW, CounterFilm, Text, write

from app.burnt_in.counter import CounterReadings, burnt_in, read_counter
from app.lab.markdown_figures import replace_figures, write_figures

MARK = "counter"
COMMAND = "python tests/measure counter --write docs/accuracy.md"
LEVELS = (0.6, 0.8, 0.95, 0.99, 1.0)
AT = (60, 400)
FILMS: dict[str, CounterFilm] = {
    **{f"font {font}": CounterFilm(font=font) for font in FONTS if font != "segments"},
    "seven segments, 26 px": CounterFilm(font="segments", height_px=26),
    "interlaced, slashed zeros, feet": CounterFilm(
        font="dots", backing="box", is_interlaced=True, height_px=14, speed=0.6, start=49.5,
        counter=Text("DIST: {value:.1f} FT", AT),
    ),
    "one picture a second, interlaced": CounterFilm(
        font="dots", backing="box", is_interlaced=True, height_px=14, rate_hz=1, frames=60,
        speed=0.53, start=7.0, counter=Text("{value:06.1f}", AT), crf=28,
    ),
    "30 pictures a second": CounterFilm(rate_hz=30, frames=150, speed=1.1),
    "old and new digit blended": CounterFilm(blends=True, speed=0.9),
    "+12.34m": CounterFilm(step=0.01, speed=0.12, counter=Text("{value:+.2f}m", AT)),
    "below zero": CounterFilm(start=0.85, speed=-0.25, counter=Text("{value:.1f} m", AT)),
    "9.9 to 10.0": CounterFilm(start=9.2, counter=Text("{value:.1f} m", AT)),
    "99.9 to 100.0": CounterFilm(start=99.2, counter=Text("{value:6.1f} m", AT)),
    "reset to zero": CounterFilm(jumps=((40, 0.0),)),
    "sticks": CounterFilm(stands=((20, 60),)),
    "hidden for a while": CounterFilm(hidden=((30, 50),)),
    "crf 35": CounterFilm(crf=35),
    "crf 35, 11 px, no outline": CounterFilm(crf=35, height_px=11, backing="nothing"),
    "noise": CounterFilm(noise=16, crf=30),
    "white on a light wall": CounterFilm(wall=190, contrast=18, backing="nothing"),
    "black, no outline": CounterFilm(wall=150, colour=BLACK, backing="nothing"),
    "red, no outline": CounterFilm(colour=RED, backing="nothing", crf=28),
    "green, shadow": CounterFilm(colour=GREEN, backing="shadow", crf=28),
    "yellow, 10 px in 352x288": CounterFilm(
        size_wh=(352, 288), height_px=10, colour=YELLOW, counter=Text("{value:06.1f} m", (20, 250)),
        others=(Text("{clock}", (220, 12)), Text("MH 228", (20, 12))),
    ),
    "1280x720": CounterFilm(
        size_wh=(1280, 720), height_px=22, counter=Text("{value:.2f} m", (1000, 640)), step=0.01,
        others=(Text("2019/05/17 {clock}", (60, 40)),), speed=0.2,
    ),
    "one line with date and clock": CounterFilm(
        counter=Text("17.05.2019 {clock} {value:.1f}m", AT), others=()
    ),
    "no unit": CounterFilm(counter=Text("{value:.1f}", AT)),
    "no counter": CounterFilm(counter=None),
    "no text": CounterFilm(counter=None, others=()),
    "temperature and pressure": CounterFilm(
        counter=None,
        others=(Text("21.4 C", (60, 30)), Text("0.31 bar", (60, 60)), Text("{clock}", (420, 30))),
    ),
}  # fmt: skip
"""By what is special about each; the rest is as in `CounterFilm`."""


@dataclass(frozen=True)
class Measured:
    """How the readings of films compare with their truth."""

    legible: int = 0
    """Frames that show a counter."""
    right: int = 0
    near: int = 0
    """Readings of a tick that is one frame early or late."""
    wrong: int = 0
    answers: tuple[tuple[float, bool], ...] = ()
    """Confidence of each reading, with whether it is right or near."""

    def __add__(self, other: Measured) -> Measured:
        return Measured(
            self.legible + other.legible,
            self.right + other.right,
            self.near + other.near,
            self.wrong + other.wrong,
            self.answers + other.answers,
        )


def compared(
    readings: CounterReadings, truth: Sequence[tuple[float, ...] | None], step: float
) -> Measured:
    """Compare readings with the values that are shown."""
    result = Measured()
    for frame, values in enumerate(truth):
        reading, confidence = readings.reading[frame], float(readings.confidence[frame])
        result += Measured(legible=int(values is not None))
        if np.isnan(reading):
            continue
        around = [v for shown in truth[max(frame - 1, 0) : frame + 2] for v in shown or ()]
        is_right, is_near = (
            bool((np.abs(np.array(shown) - reading) < step / 2).any())
            for shown in (values or (), around)
        )
        result += Measured(
            right=int(is_right),
            near=int(is_near and not is_right),
            wrong=int(not is_near),
            answers=((confidence, is_near),),
        )
    return result


def measure(film: CounterFilm, folder: Path) -> Measured:
    """Render a film and read its counter."""
    path = folder / "film.mp4"
    truth = write(film, path)
    return compared(read_counter(path, burnt_in(path).place), truth, film.step)


def main() -> None:
    """Measure every film, and show or write the table."""
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--write", type=Path, help="put the table between its markers here")
    arguments.add_argument("--only", default="", help="films whose name contains this")
    asked = arguments.parse_args()
    if asked.write:  # fails now, not after some minutes
        replace_figures(asked.write.read_text("utf-8"), MARK, "")
    rows = ["| film | legible | right | one frame off | wrong |", "|---|---|---|---|---|"]
    total, begin = Measured(), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        for name, film in FILMS.items():
            if asked.only in name:
                found = measure(film, Path(folder))
                total += found
                rows.append(_row(name, found))
                print(rows[-1], flush=True)
    rows += [_row("**all**", total), "", "| confidence | readings | right |", "|---|---|---|"]
    rows += [_level(total, low, high) for low, high in pairwise(LEVELS)]
    print("\n".join(rows[-len(LEVELS) - 3 :]), f"\n{time.process_time() - begin:.0f} s")
    if asked.write:
        write_figures(asked.write, MARK, COMMAND, "\n".join(rows))


def _row(name: str, found: Measured) -> str:
    return f"| {name} | {found.legible} | {found.right} | {found.near} | {found.wrong} |"


def _level(found: Measured, low: float, high: float) -> str:
    within = [is_right for sure, is_right in found.answers if low <= sure < high + (high == 1)]
    share = f"{100 * np.mean(within):.1f}%" if within else ""
    return f"| {low:g} to {high:g} | {len(within)} | {share} |"


if __name__ == "__main__":
    main()
