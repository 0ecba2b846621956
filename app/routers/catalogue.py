"""What forms are filled from."""

from __future__ import annotations

from dataclasses import asdict

from fastapi import APIRouter

from app.catalogue import codes
from app.catalogue.presets import PRESETS
from app.schemas import CodeOut, PresetOut, PresetsOut

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/codes")
def all_codes() -> list[CodeOut]:
    """The code pack, in the order of the standard."""
    return [CodeOut(**asdict(code)) for code in codes()]


@router.get("/presets")
def presets() -> PresetsOut:
    """Rigs to begin with."""
    return PresetsOut(
        presets=[
            PresetOut(name=preset.name, rig=preset.rig.model_dump(mode="json"))
            for preset in PRESETS
        ]
    )
