"""Rendered culvert inspections of exactly known motion: samples, test truth, rig planning."""

from app.simulation.render import RenderedFrame, render
from app.simulation.rigs import drawn_rigs
from app.simulation.scenario import Scenario
from app.simulation.scenarios import SCENARIOS
from app.simulation.write import SimulatedRun, simulate

__all__ = [
    "SCENARIOS",
    "RenderedFrame",
    "Scenario",
    "SimulatedRun",
    "drawn_rigs",
    "render",
    "simulate",
]
