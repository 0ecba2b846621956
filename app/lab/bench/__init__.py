"""The accuracy and speed tables: every method on every rendered scenario, in one run.

Where the stated rig is wrong, or silt lies in the pipe, Chainage's run is also corrected by the
joints that it saw, as `chainage correct --joints` does.

- `targets`: what Chainage must reach on each scenario.
- `run`: renders the scenarios, runs the methods and times them.
- `tables`: writes the results as Markdown and as JSON.
"""

from app.lab.bench.run import (
    FIELD_LENGTH_MM,
    FORWARD_LENGTH_MM,
    FORWARD_METHODS,
    LENGTH_MM,
    METHODS,
    OURS,
    OURS_ALONE,
    QUICK_LENGTH_MM,
    BenchRow,
    Joined,
    StepTime,
    TrackTime,
    WrongRig,
    all_scenarios,
    bench,
    by_joints,
    field_scenarios,
    forward_scenarios,
    quick_scenarios,
    time_track,
)
from app.lab.bench.tables import (
    environment,
    to_forward_markdown,
    to_json,
    to_markdown,
    to_short_markdown,
)
from app.lab.bench.targets import TARGETS

__all__ = [
    "FIELD_LENGTH_MM",
    "FORWARD_LENGTH_MM",
    "FORWARD_METHODS",
    "LENGTH_MM",
    "METHODS",
    "OURS",
    "OURS_ALONE",
    "QUICK_LENGTH_MM",
    "TARGETS",
    "BenchRow",
    "Joined",
    "StepTime",
    "TrackTime",
    "WrongRig",
    "all_scenarios",
    "bench",
    "by_joints",
    "environment",
    "field_scenarios",
    "forward_scenarios",
    "quick_scenarios",
    "time_track",
    "to_forward_markdown",
    "to_json",
    "to_markdown",
    "to_short_markdown",
]
