"""Measures how long the search over all inspections takes; not a test.

    python tests/measure search [--inspections 10000] [--defects 15] [--postgresql]

Stores and indexes inspections with observations, their remarks drawn at random, then asks for a
page with each filter and each order. The times are those of the queries, without HTTP. The CPU is
that of this process, and so all of it with SQLite: what an idle machine takes. Prints a table in
Markdown.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, date, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any, get_args

import numpy as np
from builders import clip_rig
from postgres import postgres_server
from sqlalchemy import text
from sqlalchemy.orm import Session

from app.storage.database.database import Database, stored_at
from app.storage.database.tables import EventRow, Inspection, ObservationRow
from app.storage.index.asset_index import AssetIndex
from app.storage.index.defect_index import DefectFacts, DefectIndex, InspectionFacts
from app.survey.catalogue import built_in
from app.survey.clock_hours import hour_bits
from app.survey.film_quality import FilmQuality
from app.survey.search_terms import AssetFilter, DefectFilter, DefectSort, Page

NOW = datetime(2026, 1, 1, tzinfo=UTC)
WORDS = ("wet", "wall", "joint", "root", "crack", "über", "résidus", "dripping", "steel", "apron")
ROUNDS = 9
FILTERS: dict[str, dict[str, Any]] = {
    "none": {},
    "code BAB": {"code": "BAB"},
    "code B": {"code": "B"},
    "severity from 4": {"severity_from": 4},
    "text: resid": {"text": "resid"},
    "text: uber culvert 17": {"text": "uber culvert 17"},
    "text that nothing has": {"text": "zzz"},
    "asset": {"asset": "CUL-00017"},
    "project": {"project": "Road 3"},
    "10 to 20 m": {"from_m": 10, "to_m": 20},
    "11 to 1 o'clock": {"clock_hours": hour_bits(11, 1)},
    "one year": {"after": date(2020, 1, 1), "before": date(2020, 12, 31)},
    "seven filters at once": {
        "code": "BA", "severity_from": 3, "text": "wet", "from_m": 5, "to_m": 50,
        "clock_hours": hour_bits(9, 3), "after": date(2019, 1, 1),
    },
}  # fmt: skip


def write(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


@contextmanager
def new_database(*, is_postgresql: bool) -> Iterator[Database]:
    """Open an empty database, which is gone afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        if not is_postgresql:
            database = Database(Path(folder) / "chainage.db")
            yield database
            database.close()
            return
        with postgres_server() as server:
            database = Database(stored_at(server.new_database(), Path(folder)))
            yield database
            database.close()


def fill(database: Database, index: DefectIndex, inspections: int, defects: int) -> None:
    """Store and index the inspections."""
    chance = np.random.default_rng(15)
    for number in range(inspections):
        at = NOW - timedelta(days=int(chance.integers(3650)))
        inspection_id, asset = f"{number:032x}", f"CUL-{number % (inspections // 3):05d}"
        facts = [defect(chance, seq, at) for seq in range(1, defects + 1)]
        database.write(partial(store, inspection_id, at, facts))
        token = index.token(inspection_id)
        assert token is not None
        shares = [float(share) for share in chance.random(7).round(3) ** 8]
        film = FilmQuality(9000, *shares)
        project, name = f"Road {number % 40}", f"Culvert {number}"
        index.put(
            inspection_id,
            token,
            InspectionFacts(name, project, asset, at.date(), 60.0, 0.1, film, None, None),
            facts,
        )


def defect(chance: np.random.Generator, seq: int, at: datetime) -> DefectFacts:
    """Draw a defect."""
    codes = built_in().rows
    code, clock = codes[int(chance.integers(len(codes)))], int(chance.integers(1, 13))
    return DefectFacts(
        observation_id=str(uuid.UUID(bytes=chance.bytes(16))), seq=seq, frame=40 * seq,
        code=code.code, char1=None, char2=None, label=code.label, label_ms=code.label_ms,
        labels=(code.label, *code.labels.values()),
        quant1=None, unit1=None, quant2=None, unit2=None, severity=int(chance.integers(6)),
        continuous=None, distance_m=round(float(chance.uniform(0, 60)), 3), distance_u95_m=0.05,
        clock=clock, clock_to=None, clock_hours=hour_bits(clock),
        remark=" ".join(chance.choice(WORDS, 8)), created_at=at,
    )  # fmt: skip


def store(inspection_id: str, at: datetime, facts: list[DefectFacts], session: Session) -> None:
    """Store an inspection with its observations and their events."""
    inspection = Inspection(
        id=inspection_id, name="x", status="done", rig=clip_rig(), header={}, source_kind="upload",
        source_filename="a.mp4", source_size=1, source_sha256=64 * "0", video_file="video.mp4",
        video={}, created_at=at, queued_at=at, finished_at=at,
    )  # fmt: skip
    session.add(inspection)
    session.flush()
    for one in facts:
        fields = {"frame": one.frame, "code": one.code, "remark": one.remark}
        row = ObservationRow(
            inspection_id=inspection_id, id=one.observation_id, seq=one.seq, frame=one.frame,
            fields=fields, created_at=at, created_by="x",
        )  # fmt: skip
        session.add(row)
        session.add(EventRow.now(inspection, "created", "x", None, fields))


def page(sort: Any, *, descending: bool = True, offset: int = 0) -> Page[Any]:
    """Return a page of fifty rows."""
    return Page(sort=sort, descending=descending, offset=offset, limit=50)


def questions(database: Database, index: DefectIndex, defects: int) -> dict[str, Callable[[], Any]]:
    """Return what is asked, by its name in the table."""
    newest = page("created_at")
    asked: dict[str, Callable[[], Any]] = {
        f"defects, {name}": partial(index.defects, DefectFilter(**wanted), newest)
        for name, wanted in FILTERS.items()
    }
    for sort in get_args(DefectSort):
        in_order = page(sort, descending=False)
        asked[f"defects by {sort}"] = partial(index.defects, DefectFilter(), in_order)
    last = page("created_at", offset=defects - 50)
    assets, by_name = AssetIndex(database), page("asset", descending=False)
    return asked | {
        "defects, the last page": partial(index.defects, DefectFilter(), last),
        "assets": partial(assets.assets, AssetFilter(), by_name),
        "assets, text: road 3": partial(assets.assets, AssetFilter(text="road 3"), by_name),
        "surveys of an asset": partial(assets.inspections_of, "CUL-00017", 50),
        "films by lost_share": partial(index.films, None, page("lost_share")),
        "films that are too fast": partial(index.films, "too_fast", page("too_fast_share")),
        "pending": index.pending,
    }


def timed_ms(ask: Callable[[], Any]) -> tuple[float, float, float]:
    """Return the median and the largest time of several rounds, and the median of their CPU."""
    times_ms, cpu_ms = [], []
    for _ in range(ROUNDS):
        began_s, cpu_s = time.perf_counter(), time.process_time()
        ask()
        times_ms.append(1000 * (time.perf_counter() - began_s))
        cpu_ms.append(1000 * (time.process_time() - cpu_s))
    return statistics.median(times_ms), max(times_ms), statistics.median(cpu_ms)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--inspections", type=int, default=10_000)
    parser.add_argument("--defects", type=int, default=15, help="of each inspection")
    parser.add_argument("--postgresql", action="store_true")
    stated = parser.parse_args()
    with new_database(is_postgresql=stated.postgresql) as database:
        index, began_s = DefectIndex(database), time.perf_counter()
        fill(database, index, stated.inspections, stated.defects)
        if stated.postgresql:  # as its own daemon does now and then
            database.write(lambda session: session.execute(text("ANALYZE")))
        total = stated.inspections * stated.defects
        took_s = time.perf_counter() - began_s
        write(f"{stated.inspections} inspections, {total} defects: stored in {took_s:.0f} s")
        write("\n| question | median ms | largest ms | CPU ms |\n|---|---|---|---|")
        for name, ask in questions(database, index, total).items():
            median_ms, most_ms, cpu_ms = timed_ms(ask)
            write(f"| {name} | {median_ms:.0f} | {most_ms:.0f} | {cpu_ms:.0f} |")


if __name__ == "__main__":
    main()
