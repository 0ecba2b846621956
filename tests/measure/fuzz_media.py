"""Tries thousands of damaged and malicious media files; prints the outcomes as a table.

    python tests/measure fuzz_media --rounds 5000 --served 200 --seed 1

Every round does one to four things to the bytes of a whole clip (tests/hostile.py) and gives the
file to the code of the children, each in a process of its own under their limits.  `--served` of
the rounds go through a real server too: upload, inspection, track, a page that asks meanwhile.
Exits with 1 if the server failed once, or a child met something that nobody had foreseen.  A file
that did so is kept in `--keep`.
"""

# ruff: noqa: T201
from __future__ import annotations

import argparse
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
    slowest_s: float = 0.0

    def count(self, *ends: str) -> int:
        """Return the number of files with these outcomes."""
        return sum(n for (_, end), n in self.tally.items() if end in ends)

    @property
    def faults(self) -> int:
        """Number of faults, which must be 0."""
        return self.count("unforeseen") + self.server["server failure"]


def main() -> int:
    """Run; return 1 if something was wrong."""
    options = _options()
    found = attack(options.rounds, options.served, options.seed, options.keep)
    _print_table(found.tally)
    print(f"\nslowest file {found.slowest_s:.1f} s, seed {options.seed}")
    served = sorted(found.server.items())
    print("through the server: " + ", ".join(f"{kind} {n}" for kind, n in served))
    return int(bool(found.faults))


def attack(rounds: int, served: int, seed: int, keep: Path | None = None) -> Attacks:
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
                found.slowest_s = max(found.slowest_s, verdict.seconds)
                if verdict.end in BAD:
                    _keep(keep, path, n, verdict)
                if n in through_server:
                    found.server[_served(client, path)] += 1
    return found


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5000)
    parser.add_argument("--served", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for files that a child did not survive")
    return parser.parse_args()


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


def _keep(folder: Path | None, path: Path, n: int, verdict: Verdict) -> None:
    print(f"round {n}: {verdict.end}: {verdict.said.strip()[-1500:]}", file=sys.stderr)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{n}-{verdict.end.replace(' ', '-')}{path.suffix}").write_bytes(
            path.read_bytes()
        )


def _print_table(tally: Counter[tuple[str, str]]) -> None:
    columns = ("whole", "partial", "clear failure", *BAD)
    print("| seed | attacks | " + " | ".join(columns) + " |")
    print("|---" * (len(columns) + 2) + "|")
    for name in [*sorted({name for name, _ in tally}), "all"]:
        counts = [
            sum(n for (each, kind), n in tally.items() if kind == column and name in (each, "all"))
            for column in columns
        ]
        print(f"| {name} | {sum(counts)} | " + " | ".join(map(str, counts)) + " |")


if __name__ == "__main__":
    sys.exit(main())
