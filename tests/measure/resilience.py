"""Makes the table of docs/operating.md: attacks tried, faults survived, load sustained; not a test.

    python tests/measure resilience [--files 5000] [--rounds 200] [--seconds 45] [--write FILE.md]

Runs `fuzz_media`, `faults` and `load` one after the other, 40 minutes on two quiet cores.
Ends with 1 if a server failed or something acknowledged was lost.
"""

# ruff: noqa: T201
from __future__ import annotations

import argparse
import logging
import sys
import tempfile
from pathlib import Path

from app.lab.markdown_figures import replace_figures, write_figures
from measure.faults import Storm, Tally
from measure.fuzz_media import Attacks, attack
from measure.load import LOADS, Held, holding, percentile

MARK = "resilience"
"""Name of the table's markers in its file."""


def main() -> int:
    """Run everything; return 1 if anything was lost."""
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--files", type=int, default=5000)
    arguments.add_argument("--rounds", type=int, default=200)
    arguments.add_argument("--seconds", type=float, default=45)
    arguments.add_argument("--write", type=Path, help="put the table between its markers here")
    asked = arguments.parse_args()
    if asked.write:  # fails now, not after 40 minutes
        replace_figures(asked.write.read_text("utf-8"), MARK, "")
    logging.disable()
    rows: list[str] = []

    def add(*cells: str) -> None:
        rows.append(f"| {' | '.join(cells)} |")
        print(rows[-1], flush=True)

    add("what", "tried", "result")
    add("---", "---", "---")
    attacks = attack(asked.files, asked.files // 25, seed=1)
    add(*_attacked(attacks))
    with tempfile.TemporaryDirectory() as folder:
        storm = Storm(Path(folder), seed=1)
        storm.run(asked.rounds)
    for row in _survived(storm.tally):
        add(*row)
    for name, held in holding(list(LOADS), asked.seconds):
        add(*_held(name, held))
    if asked.write:
        command = (
            f"python tests/measure resilience --files {asked.files} --rounds {asked.rounds} "
            f"--seconds {asked.seconds:g}"
        )
        write_figures(asked.write, MARK, command, "\n".join(rows))
    return int(bool(attacks.faults or storm.tally.faults))


def _attacked(found: Attacks) -> tuple[str, str, str]:
    whole, part, refused = map(found.count, ("whole", "partial", "clear failure"))
    return (
        "damaged and hostile media files",
        f"{sum(found.tally.values())}, {sum(found.server.values())} of them through a server",
        f"{whole} whole, {part} in part, {refused} clear failures, "
        f"{found.count('crashed', 'timed out', 'unforeseen')} children lost, "
        f"{found.server['server failure']} server failures",
    )


def _survived(tally: Tally) -> list[tuple[str, str, str]]:
    workers = tally.tracker_kills + tally.camera_kills + tally.media_kills
    writes = tally.acknowledged_tags + tally.acknowledged_pieces
    return [
        (
            "kill -9 under load",
            f"{tally.rounds} rounds, {tally.server_kills} of the server, {workers} of its children",
            f"{tally.resumes} times resumed from a checkpoint, {tally.tracks_that_differ} of "
            f"{tally.tracks_compared} tracks differ, {tally.damaged_databases} databases damaged, "
            f"{tally.orphans + tally.stuck} processes or inspections left hanging",
        ),
        ("acknowledged writes", f"{writes} tags and pieces of uploads", f"{tally.lost} lost"),
    ]


def _held(name: str, held: Held) -> tuple[str, str, str]:
    load = LOADS[name]
    viewers = 1 + sum(map(len, load.pauses_s))
    frames = sum(it.frames for it in held.recorded)
    lost = sum(it.frames - it.rows for it in held.recorded)
    left_out = sum(it.left_out for it in held.recorded)
    return (
        "load on two cores, with a browser on them",
        f"{load.cameras} live at {load.rate_hz} frames/s, {viewers} viewers",
        f"{lost} of {frames} poses lost, {left_out} interpolated; newest pose on the page p95 "
        f"{percentile(held.page, 95):.0f} ms, of a program {max(held.programs):.0f} ms; memory "
        f"{100 * held.growth:+.1f} %",
    )


if __name__ == "__main__":
    sys.exit(main())
