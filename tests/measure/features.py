"""Measures the pages of OGC API Features; not a test.

    python tests/measure features [--features 100000] [--postgres]

Stores so many registered assets, inspections and observations at random places in 20 projects, and
asks a server for pages of 1,000: the first, one in the middle, the last, and with a box that holds
a hundredth of them, with a token that sees everything and with one that is limited to a project.
Prints the median and the longest time of each, the whole answer read, and the processor time of the
server, which other work on the machine changes less.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from datetime import date
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import httpx
import numpy as np
import psutil
from mapped_assets import MADE_AT, Inspected, Registered, inspection_row, registered_row
from postgres import postgres_server
from sqlalchemy import insert
from steps import TOKEN, Server

from app.access.access import create_token
from app.storage.database.database import Database, stored_at
from app.storage.database.tables import (
    Base,
    IndexedDefect,
    IndexedInspection,
    Inspection,
    ObservationRow,
    RegisteredAsset,
)
from app.storage.folder.tokens import Role, TokenFile
from app.storage.index.defect_index import INDEX_VERSION
from app.survey.assets.box import box_around

AT_ONCE = 1_000
ROUNDS = 7
BOX = "101,3,101.1,3.1"
"""A hundredth of the area of the places."""


def rows(features: int) -> Iterator[dict[type[Base], dict[str, Any]]]:
    """Yield an asset with an inspection and an observation, indexed already."""
    chance = np.random.default_rng(35)
    for number in range(features):
        name, project = f"CUL-{number:06d}", f"Road {number % 20}"
        lon, lat = (float(part) for part in chance.uniform((101, 3), (102, 4)))
        line = [[lon, lat], [lon + 0.0003, lat + 0.0002]]
        inspection = inspection_row(number, Inspected(name, "2026-01-01", (), project))
        of = {
            "revision": 0, "project": project, "asset": name, "folded": name,
            "surveyed_on": date(2026, 1, 1),
        }  # fmt: skip
        seen = {"seq": 1, "frame": 0, "created_at": MADE_AT}
        observation_id = f"00000000-0000-4000-8000-{number:012x}"
        key = {"inspection_id": inspection["id"]}
        yield {
            RegisteredAsset: registered_row(Registered(name, line, project)),
            Inspection: inspection,
            ObservationRow: dict(
                **key, **seen, id=observation_id, fields={"frame": 0}, photo_frame=0,
                created_by="test",
            ),
            IndexedInspection: dict(
                **key, **of, **box_around(line), index_version=INDEX_VERSION, finished_at=MADE_AT,
                newest_event=None, name=name, asset_normalised_id=name, line=line, defects=1,
                worst_severity=3,
            ),
            IndexedDefect: dict(
                **key, **of, **seen, observation_id=observation_id, inspection=name, code="BAB",
                severity=3, label="Crack", distance_m=12.3, lon=lon, lat=lat, clock_hours=0,
            ),
        }  # fmt: skip


def fill(database: Database, features: int) -> None:
    """Store them."""
    waiting: list[dict[type[Base], dict[str, Any]]] = []

    def store(session: Any) -> None:
        for table in waiting[0]:
            session.execute(insert(table), [row[table] for row in waiting])

    for row in rows(features):
        waiting.append(row)
        if len(waiting) == AT_ONCE:
            database.write(store)
            waiting.clear()
    if waiting:
        database.write(store)


def ask(server: Server, token: str, kind: str, **query: Any) -> tuple[float, dict[str, Any]]:
    """Return the time of a page in milliseconds, and the page."""
    address = f"{server.url}/ogc/collections/{kind}/items?{urlencode({'limit': 1000} | query)}"
    began_s = time.perf_counter()
    answer = httpx.get(address, headers={"Authorization": f"Bearer {token}"}, timeout=60)
    return 1000 * (time.perf_counter() - began_s), answer.raise_for_status().json()


def write_times(server: Server, features: int, limited: str) -> None:
    """Print a row for each collection and place."""
    sys.stdout.write("| collection | page | matched | median ms | longest ms | processor ms |\n")
    sys.stdout.write("|---|---|---|---|---|---|\n")
    process = psutil.Process(server.pid)
    for kind in ("assets", "inspections", "observations"):
        keys = {
            place: {"assets": f"CUL-{at - 1:06d}", "inspections": f"{at - 1:032x}"}.get(
                kind, f"{at - 1:032x}.00000000-0000-4000-8000-{at - 1:012x}"
            )
            for place, at in (("middle", features // 2), ("last", max(features - 1000, 1)))
        }
        for place, token, query in (
            ("first", TOKEN, {}),
            ("middle", TOKEN, {"after": keys["middle"]}),
            ("last", TOKEN, {"after": keys["last"]}),
            ("box", TOKEN, {"bbox": BOX}),
            ("limited, first", limited, {}),
            ("limited, last", limited, {"after": keys["last"]}),
            ("limited, box", limited, {"bbox": BOX}),
        ):
            before = process.cpu_times()
            asked = [ask(server, token, kind, **query) for _ in range(ROUNDS)]
            after = process.cpu_times()
            spent_s = after.user + after.system - before.user - before.system
            times_ms = [time_ms for time_ms, _ in asked]
            matched = asked[0][1]["numberMatched"]
            figures = f"{np.median(times_ms):.0f} | {max(times_ms):.0f} | "
            figures += f"{1000 * spent_s / ROUNDS:.0f}"
            sys.stdout.write(f"| {kind} | {place} | {matched} | {figures} |\n")
            sys.stdout.flush()


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--features", type=int, default=100_000)
    parser.add_argument("--postgres", action="store_true")
    stated = parser.parse_args()
    with ExitStack() as stack:
        data = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "data"
        data.mkdir()
        url = None
        if stated.postgres:
            url = stack.enter_context(postgres_server()).new_database()
        database = Database(stored_at(url, data))
        fill(database, stated.features)
        database.close()
        limited = create_token(TokenFile(data), "limited", Role.VIEWER, frozenset({"Road 7"}))
        settings = {"database": url} if url else {}
        with Server(data, **settings) as server:
            write_times(server, stated.features, limited)


if __name__ == "__main__":
    main()
