"""Tries thousands of damaged and malicious media files; `resilience` runs it.

Every round does one to four things to the bytes of a whole clip (tests/hostile.py) and gives the
file to the code of the children, each in a process of its own under their limits.  `--served` of
the rounds go through a real server too: upload, inspection, track, a page that asks meanwhile.
"""

# ruff: noqa: T201
from __future__ import annotations

import random
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import httpx
from builders import Client, serving
from hostile import KINDS, RIG, Edit, edited, write_seeds
from ready_tracker import ReadyTracker, Verdict

BAD = ("crashed", "timed out", "unforeseen")
_REFUSALS = (422, 504)
"""Statuses that clearly refuse a file that is no video."""


@dataclass
class Attacks:
    """The outcomes of the files."""

    tally: Counter[tuple[str, str]] = field(default_factory=Counter)
    """By seed and outcome."""
    server: Counter[str] = field(default_factory=Counter)
    """Outcomes of those that went through a server."""

    def count(self, *ends: str) -> int:
        """Return the number of files with these outcomes."""
        return sum(n for (_, end), n in self.tally.items() if end in ends)

    @property
    def faults(self) -> int:
        """Number of faults, which must be 0."""
        return self.count("unforeseen") + self.server["server failure"]


def attack(rounds: int, served: int, seed: int) -> Attacks:
    """Try several files, some of them through a server too; Ctrl+C ends with the outcomes so
    far.
    """
    rng = random.Random(seed)  # noqa: S311  (to be repeated)
    found = Attacks()
    with (
        tempfile.TemporaryDirectory() as place,
        serving(Path(place) / "data") as client,
        ReadyTracker(RIG) as tracker,
    ):
        seeds = write_seeds(Path(place))
        through_server = set(rng.sample(range(rounds), min(served, rounds)))
        with suppress(KeyboardInterrupt):
            for n in range(rounds):
                name = rng.choice(sorted(seeds))
                path = Path(place) / f"round{Path(name).suffix}"
                path.write_bytes(_mutation(rng, seeds, name))
                verdict = tracker.verdict(path)
                found.tally[name, _column(verdict)] += 1
                if verdict.end in BAD:
                    print(
                        f"round {n}: {verdict.end}: {verdict.said.strip()[-1500:]}", file=sys.stderr
                    )
                if n in through_server:
                    found.server[_served(client, path)] += 1
    return found


def _mutation(rng: random.Random, seeds: dict[str, bytes], name: str) -> bytes:
    edits = [
        Edit(rng.choice(list(KINDS)), rng.random(), rng.randrange(2**16))
        for _ in range(rng.randint(1, 4))
    ]
    return edited(seeds[name], edits, rng.choice(sorted(seeds.values())))


def _column(verdict: Verdict) -> str:
    return verdict.end if verdict.end in ("whole", "partial", *BAD) else "clear failure"


def _served(client: Client, path: Path) -> str:
    """Return the outcome for a user who uploads the file, while somebody else uses the server."""
    try:
        created = client.create(path, rig=RIG)
        if created.status_code in _REFUSALS:
            return "refused"
        if created.status_code != 201:
            return "server failure"
        inspection_id = created.json()["id"]
        begun_s = time.monotonic()
        while (ended := client.inspection(inspection_id))["status"] in ("queued", "running"):
            if client.get("/healthz", timeout=5).status_code != 200:
                return "server failure"
            if time.monotonic() - begun_s > 120:
                return "never ended"
            time.sleep(0.05)
        track = client.get(f"/api/inspections/{inspection_id}/track?format=json")
        client.delete(f"/api/inspections/{inspection_id}")
        if track.status_code != 200:
            return "server failure"
    except (httpx.HTTPError, ValueError, KeyError) as error:
        print(f"server failure: {error!r}", file=sys.stderr)
        return "server failure"
    if ended["status"] == "failed":
        return "clear failure"
    return "partial result" if ended["warning"] else "whole"
