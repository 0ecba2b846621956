"""Measures time and memory of the PDF over 100 inspections, each with a track and photos.

Run as `python tests/measure collection [FILE.pdf [LANGUAGE]]`. The inspections are stored in a
data folder and read from it, as the server does; another process makes them.
"""

from __future__ import annotations

import hashlib
import shutil
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np

from app.storage.blobs import keys
from app.storage.database.tables import Inspection

INSPECTIONS = 100
DEFECTS = 14
FRAMES = 2500
_ROADS = ("FT 5 Jalan Klang–Banting", "FT 31 Jalan Banting–Semenyih", "B 11", "")
_MATERIALS = ("concrete", "corrugated_steel", "masonry", "")


def surveys(data: Path, count: int) -> list[str]:
    """Store many inspections of 12.5 m, copies of one with other headers and photos; return their
    ids.
    """
    from app.storage.blobs.blobs import Blobs
    from app.storage.blobs.folder import FolderBlobs
    from app.storage.database.database import Database
    from app.storage.folder.files import DataFolder
    from app.storage.records.imports import ImportStore, Rows
    from app.storage.records.inspections import InspectionStore
    from app.storage.records.observations import ObservationStore
    from measure.long_films import add_long_survey

    first = add_long_survey(data, DEFECTS, FRAMES)
    folder = DataFolder(data, reserve_bytes=0)
    database = Database(folder.database)
    blobs: Blobs = FolderBlobs(folder.root)
    row = InspectionStore(database).get(first)
    tags = ObservationStore(database).listed(first)
    ids = []
    for number in range(1, count + 1):
        inspection_id = f"{number:032x}"
        shutil.copytree(folder.inspection(first), folder.inspection(inspection_id))
        values = {column.name: getattr(row, column.name) for column in row.__table__.columns}
        values |= {"id": inspection_id, "name": f"Run {number}", "header": header(number)}
        own = []
        for seq, tag in enumerate(tags):
            jpeg = photo(100 * number + seq)
            blobs.put(keys.photo(inspection_id, tag.id, tag.frame), jpeg)
            digest = hashlib.sha256(jpeg).hexdigest()
            own.append(replace(tag, inspection_id=inspection_id, photo_sha256=digest))
        ImportStore(database).add([Rows(Inspection(**values), own, [])])
        ids.append(inspection_id)
    database.close()
    folder.close()
    return ids


def header(number: int) -> dict[str, object]:
    """Return the header of an inspection; some lack a material, a road, or coordinates."""
    found: dict[str, object] = {
        "asset_id": f"CUL-{number:04d}", "project": "Klang", "road": _ROADS[number % 4],
        "material": _MATERIALS[number % 3 if number % 10 else 3], "year": 1950 + 10 * (number % 6),
        "date": f"2026-0{1 + number % 9}-14", "client": "Jabatan Kerja Raya", "shape": "circular",
        "start_node": "UP", "end_node": "DN", "direction": "with_flow", "height_mm": 900,
    }  # fmt: skip
    lat, lon = 2.9 + 0.004 * (number * 7 % 23), 101.4 + 0.003 * (number * 5 % 31)
    if number % 9:
        found |= {"start_lat": lat, "start_lon": lon, "end_lat": lat + 1e-4, "end_lon": lon + 5e-5}
    return found


def photo(seed: int) -> bytes:
    """Return a JPEG of its own, about as large as a frame of concrete in 1280x720."""
    noise = np.random.default_rng(seed).normal(110, 20, (180, 320)).clip(0, 255).astype(np.uint8)
    picture = cv2.cvtColor(cv2.resize(noise, (1280, 720)), cv2.COLOR_GRAY2BGR)
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 85])[1].tobytes()


def measured(data: Path, ids: Sequence[str], out: Path, language: str) -> str:
    """Write the document; return what that takes."""
    from app.data_folder import reading
    from app.reports.content.translator import Translator
    from app.reports.pdf import collection
    from app.settings import Settings
    from measure.used import Used

    settings = Settings(data=data, company_name="Jurutera Pembetung Sdn Bhd")
    with reading(settings) as records, out.open("wb") as file:
        used = Used()
        missing = collection.write(
            file,
            ids,
            partial(records.reports.builder.report, language=language),
            Translator(language, "m"),
            begin=lambda _name: None,
            done=lambda: None,
        )
        assert not missing
        return str(used)


def main() -> None:
    """Print the figures; the file is kept where a path is given."""
    with tempfile.TemporaryDirectory() as name:
        data = Path(name) / "data"
        with ProcessPoolExecutor(1, get_context("spawn")) as other:  # whose memory is not measured
            ids = other.submit(surveys, data, INSPECTIONS).result()
        out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(name) / "report.pdf"
        found = measured(data, ids, out, sys.argv[2] if len(sys.argv) > 2 else "en")
        size_mb = out.stat().st_size / 2**20
    print(  # noqa: T201
        f"{INSPECTIONS} inspections of {DEFECTS} defects: {found}, {size_mb:.1f} MiB"
    )


if __name__ == "__main__":
    main()
