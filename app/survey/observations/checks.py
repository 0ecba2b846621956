"""The checks before a report is issued: what blocks it, and what a reviewer would question.

Every rule is a function that yields issues. An issue has a code and numbers, from which a page and
a report make a sentence in their language.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from app.survey.catalogue.table import Code, CodeTable
from app.survey.distances.corrected import Corrected
from app.survey.distances.film_quality import LOST_PERCENT, POOR_PERCENT, share
from app.survey.distances.intended_use import IntendedUse
from app.survey.distances.interval import U95, half_width_m
from app.survey.distances.track_rows import is_unmeasured
from app.survey.fields.header import number_of, required_to_issue
from app.survey.observations.defects import END_CODES, START_CODE
from app.survey.places.place import ObservationView
from app.survey.places.spans import SAME_M, SAME_MM
from app.survey.places.stretches import Stretch, stretches
from app.survey.rounding import metres
from vo_core import Track
from vo_core.image.health import complained
from vo_core.scale.evidence import TAPE_SIGMA_MM

Param = str | int | float
Level = Literal["block", "warn"]

SAME_PLACE_MM = 10.0
"""Distances this close count as equal: they are shown to a centimetre."""
SEVERE = 4
BETWEEN_CODES = "/"
"""Stands between codes any of which would do, as `or` would be a word of one language."""
JOINT_CODES = ("BAI", "BAJ")
"""Codes of EN 13508-2 that occur only at joints: intruding sealing material, displaced joint."""


@dataclass(frozen=True)
class Issue:
    """One objection to a report."""

    level: Level
    code: str
    observation_id: str | None = None
    params: Mapping[str, Param] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """Everything that the rules look at."""

    header: Mapping[str, Any]
    views: list[ObservationView]
    table: CodeTable
    corrected: Corrected
    track: Track
    health: Mapping[str, NDArray[np.floating]]
    """Health of each frame, (N,), by the fields of `Health`."""
    photo_is_there: Callable[[ObservationView], bool]
    is_outdated: bool = False
    """Whether an older program tracked the film."""
    use: IntendedUse = field(default_factory=IntendedUse)
    """What the distances are meant for."""

    @property
    def known_mm(self) -> float | None:
        """Length of the asset from the header, else from the corrections."""
        value = self.header.get("known_length_m")
        if isinstance(value, int | float) and not isinstance(value, bool) and value > 0:
            return 1000 * float(value)
        closure = self.corrected.adjusted.closure if self.corrected.adjusted else None
        return closure.known_mm if closure else None

    @property
    def reached_mm(self) -> float | None:
        """The greatest distance of the run."""
        return float(self.track.distance_mm.max()) if len(self.track) else None

    def view_of(self, observation_id: str) -> ObservationView:
        """Return the observation with this id."""
        return self._by_id[observation_id]

    @cached_property
    def _by_id(self) -> dict[str, ObservationView]:
        return {view.row.id: view for view in self.views}


def run(case: Case) -> list[Issue]:
    """Run all rules: issues that block first, each kind in the order of RULES."""
    issues = [issue for rule in RULES for issue in rule(case)]
    return sorted(issues, key=lambda issue: issue.level)  # "block" sorts before "warn"


def header_fields(case: Case) -> Iterator[Issue]:
    """Report required fields that are empty."""
    for name in required_to_issue(case.header):
        if name == "abandon_reason":
            yield Issue("block", "abandoned_without_reason")
        else:
            yield Issue("block", "header_field_empty", params={"field": name})


def start_and_finish(case: Case) -> Iterator[Issue]:
    """Check the first and the last observation, and say where they belong; packs of other families
    have other codes for them.
    """
    there = {view.row.tag.code for view in case.views}
    in_pack = {row.code for row in case.table.rows}
    if START_CODE in in_pack and START_CODE not in there:
        yield Issue("block", "no_start", params={"needed": START_CODE, **_start_place(case)})
    if in_pack.issuperset(END_CODES) and there.isdisjoint(END_CODES):
        needed = BETWEEN_CODES.join(END_CODES)
        yield Issue("block", "no_finish", params={"needed": needed, **_end_place(case)})


def _start_place(case: Case) -> dict[str, Param]:
    """Return the frame nearest to the zero point; nothing without a track."""
    if not len(case.track):
        return {}
    frame = int(np.abs(case.track.distance_mm).argmin())
    return {"frame": frame, "distance_m": metres(float(case.track.distance_mm[frame]))}


def _end_place(case: Case) -> dict[str, Param]:
    """Return the frame at the greatest distance, or the place of an observation ahead of it."""
    if not len(case.track):
        return {}
    frame = int(case.track.distance_mm.argmax())
    reached_mm = float(case.track.distance_mm[frame])
    placed = [(view.place.distance_mm, view) for view in case.views if view.place is not None]
    far_mm, far = max(placed, key=lambda each: each[0], default=(reached_mm, None))
    if far is None or far_mm <= reached_mm:
        return {"frame": frame, "distance_m": metres(reached_mm)}
    place: dict[str, Param] = {"frame": far.row.frame, "distance_m": metres(far_mm)}
    if far.row.tag.pixel is not None:
        place["u"], place["v"] = far.row.tag.pixel
    return place


def order(case: Case) -> Iterator[Issue]:
    """Check that start and end stand once, in this order, around all others, and agree with the
    header.
    """
    starts = [view for view in case.views if view.row.tag.code == START_CODE]
    ends = [view for view in case.views if view.row.tag.code in END_CODES]
    for views, code in ((starts, "start_twice"), (ends, "end_twice")):
        for view in views[1:]:
            yield _about(view, "block", code, other=views[0].row.seq)
    condition = case.header.get("end_condition")
    for view in ends[:1]:
        if condition and view.row.tag.code != END_CODES[condition == "abandoned"]:
            yield _about(view, "block", "end_contradicts", code=str(view.row.tag.code))
    if ends and starts and _is_before(ends[0], starts[0]):
        yield _about(ends[0], "block", "end_before_start")
        return
    for view in case.views:
        if view in starts or view in ends:
            continue
        if starts and _is_before(view, starts[0]):
            yield _about(view, "warn", "before_start")
        if ends and _is_before(ends[0], view):
            yield _about(view, "warn", "after_end")


def _is_before(one: ObservationView, other: ObservationView) -> bool:
    """Return whether an observation lies before another one beyond both intervals."""
    if one.place is None or other.place is None:
        return False
    u95_mm = 1000 * max(one.place.u95_m or 0.0, other.place.u95_m or 0.0)
    return other.place.distance_mm - one.place.distance_mm > u95_mm + SAME_PLACE_MM


def distances(case: Case) -> Iterator[Issue]:
    """Report observations at impossible distances."""
    for view in case.views:
        place = view.place
        if place is None:
            yield _about(view, "block", "not_tracked")
            continue
        u95_m = place.u95_m or 0.0
        u95_mm = 1000 * u95_m
        distance = {"distance_m": metres(place.distance_mm), "u95_m": u95_m}
        if place.distance_mm + u95_mm < -SAME_MM:
            yield _about(view, "block", "before_zero", **distance)
        known_mm = case.known_mm
        if known_mm is not None and place.distance_mm - u95_mm > known_mm + SAME_MM:
            known_m = metres(known_mm)
            yield _about(view, "block", "beyond_end", known_length_m=known_m, **distance)


def codes(case: Case) -> Iterator[Issue]:
    """Check that each code is in the pack and has all that it requires."""
    known: dict[str, list[Code]] = {}
    for row in case.table.rows:
        known.setdefault(row.code, []).append(row)
    for view in case.views:
        code = view.row.tag.code
        if code is None:
            yield _about(view, "block", "no_code")
        elif code not in known:
            yield _about(view, "block", "unknown_code", code=code)
        else:
            yield from _characters(view, known[code])
            yield from _needs(view, case.table)


def no_longer_fit(case: Case, table: CodeTable) -> list[Issue]:
    """Return what the codes would lack with another table that they do not lack with their own."""
    known = [*codes(case)]
    return [issue for issue in codes(replace(case, table=table)) if issue not in known]


def _characters(view: ObservationView, rows: list[Code]) -> Iterator[Issue]:
    tag = view.row.tag
    char1, char2 = tag.char1 or "", tag.char2 or ""
    firsts = {row.char1 for row in rows}
    seconds = {row.char2 for row in rows if row.char1 == char1}
    for name, value, allowed in (("char1", char1, firsts), ("char2", char2, seconds)):
        if value in allowed:
            continue
        if not value:
            yield _missing(view, name)
        else:
            params = {"code": str(tag.code), "field": name, "value": value}
            yield _about(view, "block", "unknown_character", **params)
        return


def _needs(view: ObservationView, table: CodeTable) -> Iterator[Issue]:
    tag = view.row.tag
    row = table.find(tag.code, tag.char1, tag.char2)
    if row is None or (tag.continuous or "").startswith("B"):
        return  # the finish of a stretch repeats its start
    if row.needs_clock == "yes" and view.clock is None:
        yield _missing(view, "clock_from")
    for name, need, (least, most) in zip(
        ("quant1", "quant2"), (row.needs_q1, row.needs_q2), row.bounds, strict=True
    ):
        value = getattr(tag, name)
        if need == "yes" and value is None:
            yield _missing(view, name)
        if value is not None and least is not None and value < least:
            yield _about(view, "block", "too_small", field=name, value=value, bound=least)
        if value is not None and most is not None and value > most:
            yield _about(view, "block", "too_large", field=name, value=value, bound=most)


def _missing(view: ObservationView, name: str) -> Issue:
    return _about(view, "block", "attribute_missing", code=str(view.row.tag.code), field=name)


def photos(case: Case) -> Iterator[Issue]:
    """Check that named photos exist and that severe observations have one."""
    for view in case.views:
        if view.row.has_photo and not case.photo_is_there(view):
            yield _about(view, "block", "photo_missing")
        severity = view.row.tag.severity
        if not view.row.is_photographed and severity is not None and severity >= SEVERE:
            yield _about(view, "warn", "severe_without_photo", severity=severity)


def stretch_rules(case: Case) -> Iterator[Issue]:
    """Check that each stretch has one start, one finish, one code and a length."""
    for stretch in stretches(view.row for view in case.views):
        number = {"stretch": stretch.number}
        if stretch.is_open:
            yield Issue("block", "open_stretch", stretch.starts[0].id, number)
        elif not stretch.starts:
            row = (stretch.finishes + stretch.changes)[0]
            yield Issue("block", "stretch_without_start", row.id, number)
        elif len(stretch.starts) > 1 or len(stretch.finishes) > 1:
            row = (stretch.starts + stretch.finishes)[-1]
            yield Issue("block", "stretch_number_twice", row.id, number)
        else:
            yield from _one_stretch(case, stretch)


def _one_stretch(case: Case, stretch: Stretch) -> Iterator[Issue]:
    start = stretch.starts[0]
    number = {"stretch": stretch.number}
    names = ("code", "char1", "char2")
    for row in (*stretch.changes, *stretch.finishes):
        if any(getattr(row.tag, name) != getattr(start.tag, name) for name in names):
            yield Issue("block", "stretch_codes_differ", row.id, number)
    length_mm = _length_mm(case, stretch)
    if length_mm is None:
        return
    values = number | {"length_m": metres(length_mm)}
    if length_mm < -SAME_PLACE_MM:
        yield Issue("block", "stretch_falls", stretch.finishes[0].id, values)
    elif length_mm < SAME_PLACE_MM:
        yield Issue("warn", "stretch_is_point", start.id, values)
    asset_mm = case.known_mm or case.reached_mm
    if asset_mm and length_mm > asset_mm / 2 + SAME_MM:
        percent = round(100 * length_mm / asset_mm, 1)
        yield Issue("warn", "stretch_long", start.id, values | {"percent": percent})


def _length_mm(case: Case, stretch: Stretch) -> float | None:
    ends = [case.view_of(rows[0].id).place for rows in (stretch.starts, stretch.finishes)]
    if ends[0] is None or ends[1] is None:
        return None
    return ends[1].distance_mm - ends[0].distance_mm


def overlapping_stretches(case: Case) -> Iterator[Issue]:
    """Report the same code at the same clock position on overlapping lengths."""
    found: dict[tuple[Any, ...], list[tuple[Stretch, float, float]]] = {}
    for stretch in stretches(view.row for view in case.views):
        if not stretch.starts or not stretch.finishes:
            continue
        start, finish = case.view_of(stretch.starts[0].id), case.view_of(stretch.finishes[0].id)
        if start.place is not None and finish.place is not None:
            ends = (start.place.distance_mm, finish.place.distance_mm)
            found.setdefault(_kind(start), []).append((stretch, *ends))
    pairs = [pair for alike in found.values() for pair in combinations(alike, 2)]
    for (one, low, high), (other, begin, end) in sorted(pairs, key=_by_number):
        if min(high, end) - max(low, begin) > SAME_PLACE_MM:
            numbers = {"stretch": one.number, "other": other.number}
            yield Issue("warn", "stretches_overlap", other.starts[0].id, numbers)


def _by_number(pair: tuple[tuple[Stretch, float, float], ...]) -> tuple[int, ...]:
    return tuple(stretch.number for stretch, _, _ in pair)


def duplicates(case: Case) -> Iterator[Issue]:
    """Report each repetition of a code at the same distance and clock position."""
    seen: dict[tuple[Any, ...], list[tuple[float, int]]] = {}
    for view in case.views:
        if view.place is None or not view.row.tag.code or view.row.tag.continuous:
            continue
        distance_mm, kind = view.place.distance_mm, _kind(view)
        # Neighbours lie in the same cell of this length or in an adjacent one.
        cell = math.floor(distance_mm / SAME_PLACE_MM)
        near = [
            seq
            for beside in (cell - 1, cell, cell + 1)
            for other_mm, seq in seen.get((*kind, beside), ())
            if abs(distance_mm - other_mm) < SAME_PLACE_MM
        ]
        if near:
            yield _about(view, "warn", "duplicate", other=min(near))
        else:
            seen.setdefault((*kind, cell), []).append((distance_mm, view.row.seq))


def _kind(view: ObservationView) -> tuple[Any, ...]:
    tag = view.row.tag
    return (tag.code, tag.char1, tag.char2, view.clock)


def remarks(case: Case) -> Iterator[Issue]:
    """Require a remark where a code has Z for "other": only the remark explains it."""
    for view in case.views:
        tag = view.row.tag
        if "Z" in (tag.char1, tag.char2) and not tag.remark:
            yield _about(view, "warn", "other_without_remark")


def joints(case: Case) -> Iterator[Issue]:
    """Report codes of joints where there is no joint."""
    adjusted = case.corrected.adjusted
    if adjusted is None or not adjusted.joints:
        return
    for view in case.views:
        code = view.row.tag.code
        if code in JOINT_CODES and view.place is not None and view.place.joint is None:
            yield _about(view, "warn", "no_joint_near", code=str(code))


def pictures(case: Case) -> Iterator[Issue]:
    """Report what clients reject videos for: light, blur, speed, a dirty lens."""
    for name, frames in complained(case.health).items():
        percent = round(100 * share(frames), 1)
        if percent > POOR_PERCENT:
            yield Issue("warn", "poor_pictures", params={"complaint": name, "percent": percent})


def the_run(case: Case) -> Iterator[Issue]:
    """Check the program, lost frames, the length, and the corrections."""
    if case.is_outdated:
        yield Issue("warn", "outdated")
    yield from _sources(case)
    yield from _uncertain(case)
    known_mm, reached_mm = case.known_mm, case.reached_mm
    if known_mm is None:
        yield Issue("warn", "length_unknown")
    elif case.header.get("end_condition") == "complete" and reached_mm is not None:
        yield from _end(case, known_mm, reached_mm)
    if case.corrected.error is not None:
        yield Issue("block", "correction_failed")
    adjusted = case.corrected.adjusted
    for closure in adjusted.closures if adjusted else ():
        if not closure.is_plausible and case.corrected.stated.forced:
            residual = {
                "residual_mm": round(closure.residual_mm, 1),
                "residual_percent": round(closure.residual_percent, 2),
            }
            yield Issue("warn", "length_forced", params=residual)


def _sources(case: Case) -> Iterator[Issue]:
    """Report frames whose distance is not the camera's: carried by a counter, typed, or unknown."""
    is_lost, adjusted = case.track.status == "lost", case.corrected.adjusted
    frames = {"lost": is_lost}
    if (
        adjusted is not None
        and adjusted.carried is not None
        and len(adjusted.track) == len(is_lost)
    ):
        carried = adjusted.carried.is_carried
        by = "counter_carries" if adjusted.carrier == "counter" else "typed_carries"
        frames = {"lost": is_lost & ~carried, by: carried}
    for code, found in frames.items():
        count, percent = int(np.count_nonzero(found)), round(100 * share(found), 1)
        if percent > LOST_PERCENT:
            yield Issue("warn", code, params={"percent": percent, "frames": count})


def _uncertain(case: Case) -> Iterator[Issue]:
    """Report frames whose interval is of no use, such as those between two typed distances: that of
    the far end, which an inspection is called by, says nothing of them.
    """
    if is_unmeasured(case.track):
        return
    most_m = case.use.most_m(metres(case.reached_mm or 0.0))
    percent = round(100 * share(U95 * case.track.sigma_distance_mm / 1000 > most_m + SAME_M), 1)
    if percent > LOST_PERCENT:
        yield Issue("warn", "uncertain", params={"percent": percent})


def pipe(case: Case) -> Iterator[Issue]:
    """Compare the pipe of the header with that of the rig, which gives the distances their scale;
    they may differ by the interval of what the rig states.
    """
    adjusted = case.corrected.adjusted
    if adjusted is None or is_unmeasured(case.track):
        return
    of_rig, known = adjusted.rig.pipe, adjusted.rig.tolerance
    is_round = case.header.get("shape") in (None, "circular")
    for name, unit_mm, rig_mm, sigma_mm in (
        ("height_mm", 1.0, of_rig.diameter_mm if is_round else None, known.diameter_mm),
        ("unit_length_m", 1000.0, of_rig.segment_length_mm, known.segment_length_mm),
    ):
        stated = number_of(case.header.get(name))
        if stated is None or rig_mm is None:
            continue
        stated_mm = stated * unit_mm
        if abs(stated_mm - rig_mm) > U95 * sigma_mm + SAME_MM:
            sizes = {"header_mm": round(stated_mm, 1), "rig_mm": round(rig_mm, 1)}
            yield Issue("warn", "rig_pipe_differs", params={"field": name, **sizes})


def _end(case: Case, known_mm: float, reached_mm: float) -> Iterator[Issue]:
    far = case.track.distance_mm.argmax()
    sigma_mm = math.hypot(float(case.track.sigma_distance_mm[far]), TAPE_SIGMA_MM)
    short_mm = known_mm - reached_mm
    if short_mm > 1000 * half_width_m(sigma_mm) + SAME_MM:
        lengths = {"short_m": metres(short_mm), "known_length_m": metres(known_mm)}
        yield Issue("warn", "end_not_reached", params=lengths)


def _about(view: ObservationView, level: Level, code: str, /, **params: Param) -> Issue:
    return Issue(level, code, view.row.id, {"seq": view.row.seq, **params})


Rule = Callable[[Case], Iterator[Issue]]
RULES: tuple[Rule, ...] = (
    header_fields,
    start_and_finish,
    order,
    codes,
    distances,
    stretch_rules,
    photos,
    the_run,
    pipe,
    pictures,
    duplicates,
    overlapping_stretches,
    remarks,
    joints,
)
