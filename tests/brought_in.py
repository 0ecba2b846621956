"""The report of an imported survey, without a server."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

from reports import ENTERED, entry

from app.imports.surveys.survey import ImportedSurvey
from app.inspections.brought_in.imports import _track, in_order, rig_of
from app.reports.report import Photo, Report, Source


def reported(made: Report, survey: ImportedSurvey) -> Report:
    """What is reported of an import: its rows as tags that rest on the track made of them."""
    rows = in_order(survey.observations)
    track = _track(rows, survey.surveyed_m)
    roles = {"A": "start", "C": "change", "B": "finish"}
    entries = []
    for n, row in enumerate(rows):
        stated = row.tag(0).to_json()
        known = {name: stated.get(name) for name in ENTERED}
        entries.append(
            entry(
                n + 1,
                **known,
                distance_m=round(float(track.distance_mm[n]) / 1000, 3),
                time_s=row.time_s,
                u95_m=None,
                at_joint=bool(stated.get("at_joint")),
                cont_id=int(row.stretch[1:]) if row.stretch else None,
                cont_role=roles[row.stretch[0]] if row.stretch else None,
                photo=Photo(row.photo, None, None) if row.photo else None,
            )
        )
    source = Source("import", "old.txt", 1, "ab" * 32, {})
    rig = rig_of(survey.header)
    along = sorted(entries, key=lambda it: (it.distance_m, it.time_s or 0.0, it.seq))
    end_m = round(float(track.distance_mm[-1]) / 1000, 3) if len(track) else None
    return replace(
        made,
        header=survey.header,
        entries=tuple(along),
        source=source,
        rig=rig,
        distance_m=end_m,
        name=survey.name,
        made_at=made.made_at + timedelta(days=3),
    )
