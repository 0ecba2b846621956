"""What one page looks at in its 3D view, and how."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Literal

from app.viewer.geometry import Cut
from app.viewer.wording import Wording

CameraMode = Literal["overview", "follow", "inside"]


@dataclass(frozen=True)
class Look:
    """What one page looks at, and how."""

    frame: int | None = None
    """Frame at which the robot is shown; None lets it follow the tracking."""
    mode: CameraMode = "overview"
    cut: Cut = "none"
    is_measuring: bool = False
    """Whether clicks set the points of the ruler, and tag nothing."""
    selected: str | None = None
    """Id of the observation whose pin is highlighted."""
    wording: Wording = field(default_factory=Wording)


ALL = frozenset(one.name for one in fields(Look))
