"""Measures the short sequences in two processes, beside their recorded figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import cv2

from app.lab.bench.recorded import FIGURES, Change, Record, Row, cells, figures_of, write
from app.lab.bench.run import METHODS, OURS, Progress, bench
from app.lab.bench.sequences import SEQUENCES
from app.lab.bench.tables import table
from app.lab.markdown_figures import write_figures

RECORD = Path(__file__).parents[3] / "docs" / "bench_quick.csv"
"""The recorded figures, in the tree of the sources."""

_README = RECORD.parents[1] / "README.md"
_README_ROWS = (
    "nominal", "dirty_lens", "drop_outs", "bounce", "low_bit_rate", "pulsed_lamp", "corrugated",
    "forward", "mist",
)  # fmt: skip
_README_FIGURES = ("end_percent", "worst_mm", "ate_mm", "yaw_deg", "within", "lost")

DRAWS = 3
"""How many draws of the noise are recorded."""

_PROCESSES = 2


def measure(draws: int, on_progress: Progress) -> Record:
    """Render and track each sequence with so many draws of the noise, and take its figures."""
    record: dict[str, list[Row]] = {}
    films = [(name, draw) for name in SEQUENCES for draw in range(draws)]
    with ProcessPoolExecutor(
        _PROCESSES, mp_context=get_context("spawn"), initializer=cv2.setNumThreads, initargs=(1,)
    ) as workers:
        for done, (name, row) in enumerate(workers.map(_figures, films), 1):
            record.setdefault(name, []).append(row)
            on_progress(name, done, len(films))
    return record


def _figures(film: tuple[str, int]) -> tuple[str, Row]:
    name, draw = film
    (row,) = bench([replace(SEQUENCES[name], noise_draw=draw)], methods={OURS: METHODS[OURS]})
    return name, figures_of(row)


def to_markdown(before: Record, now: Record, changed: Iterable[Change]) -> str:
    """Write all figures; then what has become worse, slower and better."""
    parts = [_table(before, now, list(FIGURES))]
    found = list(changed)
    for heading, some in (
        ("Worse", [one for one in found if one.fails]),
        (
            "Slower, which may be the machine",
            [one for one in found if one.is_worse and not one.fails],
        ),
        ("Better", [one for one in found if not one.is_worse]),
    ):
        if some:
            parts.append("\n".join([f"{heading}:", "", *(f"- {one}" for one in some)]))
    return "\n\n".join(parts) + "\n"


def keep(record: Record) -> None:
    """Record these figures, and show those of the README there."""
    write(RECORD, record)
    shown = {name: record[name] for name in _README_ROWS}
    write_figures(
        _README,
        "bench-quick",
        "chainage bench --quick --record",
        _table(shown, shown, _README_FIGURES) + "\n",
    )


def _table(before: Record, now: Record, names: Sequence[str]) -> str:
    headings = ["sequence", *(FIGURES[name].heading for name in names)]
    lines = [[one, *cells(before.get(one, [{}])[0], row, names)] for one, (row, *_) in now.items()]
    return table(headings, lines)
