"""Renders culvert inspections of exactly known motion, for samples, tests and planning."""

from app.lab.simulation.render import RenderedFrame, render
from app.lab.simulation.rigs import drawn_rigs, with_drawn_rig
from app.lab.simulation.scenario import Scenario
from app.lab.simulation.scenarios import SCENARIOS
from app.lab.simulation.write import SimulatedRun, simulate

__all__ = [
    "SCENARIOS",
    "RenderedFrame",
    "Scenario",
    "SimulatedRun",
    "drawn_rigs",
    "render",
    "simulate",
    "with_drawn_rig",
]
