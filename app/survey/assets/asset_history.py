"""What became of the defects of an asset from survey to survey.

A defect of a later survey is the same as one of an earlier survey if it has the same main code and
the same role in a stretch, lies at the same distance within their 95 % intervals and the tolerance
of a click, and at most an hour of the clock away. The characters of a code may differ, because a
crack that grows becomes a fracture. Where the walls of two surveys are aligned, its place on the
wall counts instead of its distance: then only the interval of the alignment and the tolerance of a
click separate two defects. Surveys from the other end have other distances; without an alignment a
defect matches within its own direction only.

A survey shows that a defect is gone, or that one is new, only if it covered the place: it reached
beyond the whole interval in which the defect lies.

`static/components/desk/compare/matching.js` has the same rules for two runs, which it also
aligns by their joints or from both ends; a test compares both.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from math import hypot
from typing import Literal, get_args

from app.survey.assets.aligned import AlignedSurveys
from app.survey.places.spans import SAME_M

Change = Literal["first", "new", "grown", "unchanged", "gone"]
"""What one survey shows about a defect: `first` if no earlier one covered the place, `new` if one
did and saw nothing, `grown` or `unchanged` (not worse) if it was seen before, else `gone`.
"""
CHANGES: tuple[Change, ...] = get_args(Change)
_QUANTITIES = ("severity", "quant1", "quant2")
"""What may grow; the first one that did is named."""

UNSTATED_U95_M = 0.3
"""Half-width assumed for a distance without an interval, as another program measured it: counters
of cables are read to a tenth of a metre, and slip."""
_SPOT_M = 0.1
"""Distance between two people's clicks on the same defect."""
_CLOCK_REACH_H = 1
"""A clock position is entered as a whole hour."""


@dataclass(frozen=True)
class Seen:
    """A defect as one survey saw it."""

    inspection_id: str
    observation_id: str
    code: str
    distance_m: float
    u95_m: float | None
    clock: int | None
    severity: int | None
    clock_to: int | None = None
    """Where the sector that begins at `clock` ends, clockwise; None if that is one hour only.
    From 12 to 12 is all round."""
    role: str | None = None
    """A where a stretch starts, C where it changes, B where it finishes; None outside one."""
    quant1: float | None = None
    """First quantity of its code, like a width in mm; the second one follows."""
    quant2: float | None = None

    @property
    def reach_m(self) -> float:
        """Half of the interval in which it lies."""
        return UNSTATED_U95_M if self.u95_m is None else self.u95_m


@dataclass(frozen=True)
class Survey:
    """One survey of the asset, with its defects that have a code and a distance."""

    on: date
    direction: str
    """Direction of the header; surveys of different directions are not compared."""
    defects: Sequence[Seen]
    end_m: float | None = None
    """Distance that it reached; None if what it does not show means nothing, as nobody has looked
    for defects yet."""

    def covers(self, seen: Seen) -> bool:
        """Return whether it would have shown a defect that another survey saw."""
        return self.end_m is not None and seen.distance_m + seen.reach_m <= self.end_m + SAME_M


@dataclass(frozen=True)
class Growth:
    """A quantity of a defect that is larger than when it was stated before."""

    quantity: str
    """severity, quant1 or quant2."""
    before: float
    after: float


@dataclass
class Trace:
    """One defect through the surveys, oldest first."""

    direction: str
    seen: list[Seen] = field(default_factory=list)
    days: list[date] = field(default_factory=list)
    surveys: list[int] = field(default_factory=list)
    """Places of the surveys that saw it in the list of all surveys."""

    @property
    def first_severity(self) -> int | None:
        """The first severity that was stated; `last_severity` is the last one."""
        return next((one.severity for one in self.seen if one.severity is not None), None)

    @property
    def last_severity(self) -> int | None:
        """The last severity that was stated."""
        return next((one.severity for one in self.seen[::-1] if one.severity is not None), None)

    @property
    def has_grown(self) -> bool:
        """Whether it is more severe than when it was first seen."""
        first, last = self.first_severity, self.last_severity
        return first is not None and last is not None and last > first

    @property
    def growth(self) -> Growth | None:
        """What has grown from the sightings before to the last one."""
        return _growth(self.seen[:-1], self.seen[-1])


Alignments = Mapping[tuple[int, int], AlignedSurveys]
"""By the places of the earlier and the later survey in the list of all surveys."""


def traces_of(surveys: Sequence[Survey], alignments: Alignments | None = None) -> list[Trace]:
    """Follow every defect through the surveys.

    Args:
        surveys: Oldest first.
        alignments: Of the surveys whose walls were aligned.
    Returns:
        Each defect of each survey in exactly one trace, in the order of their last distances.
    """
    known: dict[str, list[Trace]] = {}
    for place, survey in enumerate(surveys):
        by_code: dict[str, list[Seen]] = {}
        for seen in survey.defects:
            by_code.setdefault(seen.code, []).append(seen)
        for code, defects in by_code.items():
            traces = known.setdefault(code, [])
            nearby = [_before(trace, place, survey, alignments or {}) for trace in traces]
            matched = _matched([each for each in nearby if each is not None], defects)
            for number, seen in enumerate(defects):
                trace = matched.get(number)
                if trace is None:
                    trace = Trace(survey.direction)
                    traces.append(trace)
                trace.seen.append(seen)
                trace.days.append(survey.on)
                trace.surveys.append(place)
    found = [trace for traces in known.values() for trace in traces]
    return sorted(found, key=lambda trace: trace.seen[-1].distance_m)


def changes_of(trace: Trace, surveys: Sequence[Survey]) -> list[Change | None]:
    """Return what each survey shows about a defect.

    Args:
        trace: The defect.
        surveys: All that `traces_of` was given.
    Returns:
        One for each survey; None where it shows nothing about it: another direction, the place not
        covered, not seen yet, or still gone.
    """
    seen_in = dict(zip(trace.surveys, trace.seen, strict=True))
    changes: list[Change | None] = []
    before: list[Seen] = []
    state: Change | None = None
    was_looked_for = False
    for place, survey in enumerate(surveys):
        change: Change | None = None
        seen = seen_in.get(place)
        if seen is not None:
            change = _change_of(before, seen, was_looked_for=was_looked_for)
            before.append(seen)
        elif survey.direction == trace.direction and survey.covers(
            before[-1] if before else trace.seen[0]
        ):
            was_looked_for = True
            change = "gone" if before and state != "gone" else None
        state = change or state
        changes.append(change)
    return changes


def _change_of(before: Sequence[Seen], seen: Seen, *, was_looked_for: bool) -> Change:
    if not before:
        return "new" if was_looked_for else "first"
    return "unchanged" if _growth(before, seen) is None else "grown"


def _growth(before: Sequence[Seen], after: Seen) -> Growth | None:
    for name in _QUANTITIES:
        stated = [value for one in before if (value := getattr(one, name)) is not None]
        value = getattr(after, name)
        if stated and value is not None and value > stated[-1]:
            return Growth(name, stated[-1], value)
    return None


def counted(changes: Sequence[Change | None]) -> dict[Change, int]:
    """Return how often each change occurs: of all defects in one survey."""
    return {change: changes.count(change) for change in CHANGES}


@dataclass(frozen=True)
class _Before:
    """The last sighting of a defect, as the survey that is compared would see it."""

    trace: Trace
    seen: Seen
    is_aligned: bool

    def reach_m(self, after: Seen) -> float:
        """How far apart the two may lie: on aligned walls no absolute distance counts."""
        apart_m = self.seen.reach_m if self.is_aligned else hypot(self.seen.reach_m, after.reach_m)
        return _SPOT_M + apart_m + SAME_M

    def is_same(self, after: Seen) -> bool:
        """Whether the other sighting is one of this defect."""
        seen = self.seen
        if seen.role != after.role or abs(after.distance_m - seen.distance_m) > self.reach_m(after):
            return False
        if seen.clock is None or after.clock is None:
            return True
        return _hours_apart(_sector(seen, seen.clock), _sector(after, after.clock)) <= (
            _CLOCK_REACH_H
        )


def _before(trace: Trace, place: int, survey: Survey, alignments: Alignments) -> _Before | None:
    """Return the last sighting of a trace for the survey at a place; None if it says nothing."""
    aligned = alignments.get((trace.surveys[-1], place))
    moved = None if aligned is None else _moved(aligned, trace.seen[-1])
    if moved is not None:
        return _Before(trace, moved, is_aligned=True)
    if trace.direction != survey.direction:
        return None
    return _Before(trace, trace.seen[-1], is_aligned=False)


def _moved(aligned: AlignedSurveys, seen: Seen) -> Seen | None:
    """Return a defect of the earlier survey as the later one would see it, with the interval of the
    alignment.
    """
    tie = aligned.of_earlier(seen.distance_m)
    if tie is None:
        return None
    hours = [seen.clock, seen.clock_to]
    if aligned.is_opposite and None not in hours:  # clockwise is the other way round
        hours.reverse()
    clock, clock_to = (
        None if hour is None else round(aligned.later_clock(hour, tie)) % 12 or 12 for hour in hours
    )
    return replace(seen, distance_m=tie.distance_m, u95_m=tie.u95_m, clock=clock, clock_to=clock_to)


def _matched(before: Sequence[_Before], defects: Sequence[Seen]) -> dict[int, Trace]:
    """Match the defects, by their number, with traces: the nearest pairs first."""
    by_place = sorted(before, key=lambda each: each.seen.distance_m)
    places_m = [each.seen.distance_m for each in by_place]
    widest_m = max((each.seen.reach_m for each in before), default=0.0)
    pairs = []
    for number, seen in enumerate(defects):
        reach_m = _SPOT_M + hypot(seen.reach_m, widest_m) + SAME_M
        first = bisect_left(places_m, seen.distance_m - reach_m)
        last = bisect_right(places_m, seen.distance_m + reach_m)
        pairs += [
            (abs(seen.distance_m - places_m[place]), number, place)
            for place in range(first, last)
            if by_place[place].is_same(seen)
        ]
    matched: dict[int, Trace] = {}
    taken: set[int] = set()
    for _, number, place in sorted(pairs):
        if number not in matched and place not in taken:
            matched[number] = by_place[place].trace
            taken.add(place)
    return matched


def _sector(seen: Seen, clock: int) -> tuple[int, int]:
    """Return the hours from and to, clockwise."""
    if (clock, seen.clock_to) == (12, 12):  # all round, as in `hour_bits`
        return 1, 12
    return clock, clock if seen.clock_to is None else seen.clock_to


def _hours_apart(one: tuple[int, int], other: tuple[int, int]) -> int:
    """Return the hours between two sectors, 0 where they overlap."""
    if _is_within(other[0], one) or _is_within(one[0], other):
        return 0
    return min((other[0] - one[1]) % 12, (one[0] - other[1]) % 12)


def _is_within(hour: int, sector: tuple[int, int]) -> bool:
    return (hour - sector[0]) % 12 <= (sector[1] - sector[0]) % 12
