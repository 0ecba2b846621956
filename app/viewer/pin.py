"""A defect on the wall, as the 3D view draws it."""

from __future__ import annotations

from dataclasses import dataclass

from app.survey.adjustment.adjusted_track import Source

Color = tuple[int, int, int]

_SEVERITY_COLORS: tuple[Color, ...] = (
    (154, 166, 178),
    (86, 204, 150),
    (190, 212, 78),
    (252, 202, 56),
    (255, 136, 44),
    (255, 62, 66),
)
_UNRATED: Color = (124, 176, 255)
COLORS = (*_SEVERITY_COLORS, _UNRATED)


@dataclass(frozen=True, slots=True)
class Pin:
    """A defect on the wall."""

    id: str
    distance_m: float
    clock: float | None
    """In (0, 12]; None on a floor."""
    u95_m: float | None
    """Half of the 95 % interval of the distance; None where it is unknown."""
    severity: int | None
    """From 0, a note, to 5, act now; None if not rated."""
    label: str
    """Code and name, in the viewer's language."""
    source: Source | None = None
    """What the distance rests on; None where it is not known."""
    number: int = 0
    """Number of the observation, which names it on a stand-alone page."""
    lateral_m: float = 0.0
    """Distance to the right of the axis; used on a floor only."""
    clock_to: float | None = None
    """Other end of a sector that runs clockwise from `clock`."""
    finish_m: float | None = None
    """Other end of a stretch that begins at `distance_m`."""
    measured_m: tuple[tuple[tuple[float, float, float], ...], ...] = ()
    """Lines that were measured on the wall, through world points; a polygon ends where it begins.
    """

    @property
    def color(self) -> Color:
        """Colour of its severity."""
        return _UNRATED if self.severity is None else _SEVERITY_COLORS[self.severity]
