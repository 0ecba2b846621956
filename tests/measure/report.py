"""Measures time and memory of the PDF of 200 defects with photos.

Run as `python tests/measure report [FILE.pdf]`. The photos have the size of full HD pictures;
fonts are loaded within the time, as after a start.
"""

from __future__ import annotations

import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from reports import LENGTH_M, OBSERVATIONS, entry, full_report

from app.reports import pdf as document
from app.reports.report import Photo, Report
from app.storage.folder.files import sha256_of
from measure.used import Used

DEFECTS = 200
SIZE_WH = (1920, 1080)


def large_report(folder: Path) -> Report:
    """Return a report with two hundred observations of all kinds, each with its own photo."""
    kinds = [
        {name: value for name, value in fields.items() if not name.startswith("cont_")}
        for fields in OBSERVATIONS
        if fields["code"]
    ]
    with ProcessPoolExecutor(1, get_context("spawn")) as other:  # whose memory is not measured
        pictures = list(other.map(partial(large_photo, folder), range(1, DEFECTS + 1)))
    places_m = np.sort(np.random.default_rng(5).uniform(0, LENGTH_M, DEFECTS)).round(3)
    entries = [
        replace(
            entry(n, **kinds[n % len(kinds)] | {"distance_m": float(place_m)}),
            photo=Photo(f"CUL-0041-{n:03d}.jpg", *pictures[n - 1]),
        )
        for n, place_m in enumerate(places_m, 1)
    ]
    return full_report(folder, entries=tuple(entries))


def large_photo(folder: Path, seq: int) -> tuple[Path, str]:
    """Write a JPEG with about as much detail as a film of concrete; return its digest, too."""
    noise = np.random.default_rng(seq).normal(110, 20, (SIZE_WH[1] // 8, SIZE_WH[0] // 8))
    picture = cv2.resize(noise.clip(0, 255).astype(np.uint8), SIZE_WH)
    cv2.putText(picture, str(seq), (100, 700), cv2.FONT_HERSHEY_SIMPLEX, 16, 240, 40)
    path = folder / f"large-{seq}.jpg"
    done = cv2.imwrite(str(path), cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR))
    assert done
    return path, sha256_of(path)


def main() -> None:
    """Print the figures; the file is kept where a path is given."""
    with tempfile.TemporaryDirectory() as name:
        report = large_report(Path(name))
        used = Used()
        content = document.write(report).content
    print(f"{DEFECTS} defects: {used}, {len(content) / 2**20:.1f} MiB")  # noqa: T201
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_bytes(content)


if __name__ == "__main__":
    main()
