"""Which defects of two surveys are the same, by their places on the aligned walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

from app.survey.assets.aligned import AlignedSurveys
from app.survey.assets.asset_history import Change, Seen, Survey, changes_of, traces_of
from app.survey.distances.interval import half_width_m
from app.survey.observations.defects import is_defect
from app.survey.places.place import ObservationView


@dataclass(frozen=True)
class ComparedDefect:
    """A defect of one or both surveys."""

    observation: str | None
    """In the later survey; None if it is gone or was not covered."""
    earlier_observation: str | None
    change: Change
    offset_m: float | None
    """Distance in the later survey minus where the earlier one has it, for a defect of both."""
    offset_u95_m: float | None
    """Half of the 95 % interval of the alignment there."""


@dataclass(frozen=True)
class Coded:
    """The observations of one survey."""

    views: Sequence[ObservationView]
    direction: str
    """Direction of the header."""
    end_m: float | None
    """Distance that it reached; None if nobody has looked for defects in it yet."""

    def survey(self, name: str, on: date) -> Survey:
        """Return it for `traces_of`."""
        seen = [found for view in self.views if (found := _seen(name, view)) is not None]
        return Survey(on, self.direction, seen, self.end_m)


def compared_defects(
    later: Coded, earlier: Coded, aligned: AlignedSurveys | None
) -> list[ComparedDefect]:
    """Match the defects of two surveys, by distance alone where their walls are not aligned."""
    surveys = [earlier.survey("earlier", date.min), later.survey("later", date.max)]
    found = []
    for trace in traces_of(surveys, {} if aligned is None else {(0, 1): aligned}):
        by = {seen.inspection_id: seen for seen in trace.seen}
        new, old = by.get("later"), by.get("earlier")
        change = changes_of(trace, surveys)[1]
        if change == "first" and new and earlier.end_m is not None and aligned is not None:
            change = "new" if aligned.of_later(new.distance_m) else "first"
        if change is None:
            continue
        offset_m, u95_m = _offset(aligned, old, new)
        found.append(ComparedDefect(_id_of(new), _id_of(old), change, offset_m, u95_m))
    return found


def _id_of(seen: Seen | None) -> str | None:
    return None if seen is None else seen.observation_id


def _offset(
    aligned: AlignedSurveys | None, old: Seen | None, new: Seen | None
) -> tuple[float | None, float | None]:
    if old is None or new is None:
        return None, None
    tie = None if aligned is None else aligned.of_earlier(old.distance_m)
    if tie is None:
        return new.distance_m - old.distance_m, None
    return new.distance_m - tie.distance_m, half_width_m(tie.sigma_mm)


def _seen(survey: str, view: ObservationView) -> Seen | None:
    tag, place = view.row.tag, view.place
    if tag.code is None or place is None or not is_defect(tag.code, tag.severity):
        return None
    return Seen(
        survey,
        view.row.id,
        tag.code,
        place.distance_mm / 1000,
        place.u95_m,
        view.clock,
        tag.severity,
        clock_to=tag.clock_to,
        role=tag.continuous and tag.continuous[0],
        quant1=tag.quant1,
        quant2=tag.quant2,
    )
