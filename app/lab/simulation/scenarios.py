"""The named inspections that `chainage simulate` can render."""

from __future__ import annotations

from collections.abc import Mapping

from app.lab.simulation.down_scenarios import DOWN
from app.lab.simulation.forward_scenarios import FORWARD
from app.lab.simulation.scenario import Scenario

SCENARIOS: Mapping[str, Scenario] = {scenario.name: scenario for scenario in (*DOWN, *FORWARD)}
"""Scenarios by name, in the order in which they are listed and run."""
