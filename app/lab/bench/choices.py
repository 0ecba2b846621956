"""What one call of the bench renders and measures, and the table that it writes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from app.lab.bench.run import METHODS, OURS, BenchRow, Method, Progress, bench, time_track
from app.lab.bench.tables import to_forward_markdown, to_markdown, to_short_markdown
from app.lab.peers import FORWARD_PEERS
from app.lab.simulation import SCENARIOS, Scenario, with_drawn_rig
from vo_core.rig import Rig

FORWARD_NAMES = (
    "forward", "forward_crooked", "forward_looking_around", "forward_stream", "forward_slow",
    "forward_parts", "forward_pumping", "forward_wobble",
)  # fmt: skip
"""The forward view as crews have it; each has its own rig, drawn at random."""


@dataclass(frozen=True)
class Choice:
    """A choice of scenarios and methods."""

    mark: str
    """Name of the figures in the documents."""
    names: Sequence[str]
    length_mm: float
    """Usual path of each scenario; a scenario with a shorter one keeps it."""
    methods: Mapping[str, Callable[[Rig], Method]]
    track_runs: int = 0
    """How often `chainage track` is timed."""
    table: Callable[[Sequence[BenchRow]], str] | None = None
    """Writes a short table; None: all tables."""

    def scenarios(self, length_mm: float | None = None, seed: int = 1) -> list[Scenario]:
        """Return the scenarios that can be rendered here, forward rigs drawn from this seed."""
        chosen = [SCENARIOS[name] for name in self.names if SCENARIOS[name].is_available]
        return [
            (with_drawn_rig(one, seed) if one.name in FORWARD_NAMES else one).shortened(
                self.length_mm if length_mm is None else length_mm
            )
            for one in chosen
        ]

    def measure(self, length_mm: float | None, seed: int, on_progress: Progress) -> str:
        """Run the bench; return its tables as Markdown."""
        rows = bench(self.scenarios(length_mm, seed), methods=self.methods, on_progress=on_progress)
        if self.table is not None:
            return self.table(rows)
        return to_markdown(rows, time_track(SCENARIOS["nominal"], self.track_runs, on_progress))


CHOICES: Mapping[str, Choice] = {
    # A short path, as the paper's method takes a tenth of a second per frame.
    "": Choice(
        "bench",
        [*(name for name in SCENARIOS if name not in FORWARD_NAMES), *FORWARD_NAMES],
        2000.0,
        METHODS,
        track_runs=3,
    ),
    # One scenario for each way in which the field spoils a film, over the path of the targets.
    "--field": Choice(
        "bench-field",
        (
            "nominal", "low_texture", "dirty_lens", "drop_outs", "network_jitter", "stop_dead",
            "bounce", "climb", "rolling_shutter", "low_bit_rate",
        ),
        6000.0,
        {OURS: METHODS[OURS]},
        table=to_short_markdown,
    ),
    "--forward": Choice(
        "bench-forward",
        FORWARD_NAMES,
        9000.0,
        {OURS: METHODS[OURS], **FORWARD_PEERS},
        table=to_forward_markdown,
    ),
}  # fmt: skip
"""By the option that chooses it."""
