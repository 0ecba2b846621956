"""The whole report as JSON, in a versioned schema that `app.imports.chainage_json` reads.

`observations` holds derived values, like the tables. An import starts from their sources: `tags`
(what people stated), the raw `track`, its `health`, the joint `sightings`, the `mount_tilt` against
the rig, the `stance` of the camera in the pipe, the rig and the stated corrections. `counter` is
derived from the film, so an import, which has none, leaves it out.

An imported inspection is exported unchanged, so `events` omits the import. The history of the page,
PDF and HTML mention it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from app.reports.report import Report, Written
from app.reports.tables import table
from app.reports.tables.table import iso
from app.survey.corrected import result_of
from app.survey.records import BROUGHT_IN
from vo_core import Track

SCHEMA = "chainage-report/2"
"""Version 2 added `tags`, `track`, `health` and `sightings` to version 1."""

_HEALTH_DECIMALS = 4
_HALF = re.compile("[\ud800-\udfff]")
"""A surrogate: a text of another program may contain it, UTF-8 cannot."""


def write(report: Report) -> Written:
    """Write everything, with the version of the schema; one line for each part."""
    parts = {
        "schema": SCHEMA,
        "exported_at": iso(report.made_at),
        "inspection": _inspection(report),
        "corrections": {
            "stated": report.corrected.stated.to_json(),
            "result": result_of(report.corrected),
            "error": report.corrected.error,
        },
        "counter": _counter(report),
        "observations": table.rows(report),
        "events": _events(report),
        "tags": _tags(report),
        "track": {"columns": _columns(report.raw_track)},
        "health": {
            "columns": {
                name: [round(value, _HEALTH_DECIMALS) for value in column.tolist()]
                for name, column in report.health.items()
            }
        },
        "sightings": [asdict(sighting) for sighting in report.sightings],
        "mount_tilt": asdict(tilt) if (tilt := report.corrected.tilt) else None,
        "stance": asdict(report.stance),
    }
    lines = ",\n".join(f"{_text(name)}: {_text(part)}" for name, part in parts.items())
    return Written(f"{{\n{lines}\n}}\n".encode())


def _inspection(report: Report) -> Mapping[str, Any]:
    source = report.source
    return {
        "id": report.id,
        "name": report.name,
        "status": report.status,
        "header": report.header,
        "labels": list(report.labels),
        "rig": report.rig.model_dump(mode="json"),
        "source": {
            "kind": source.kind,
            "filename": source.filename,
            "size": source.size,
            "sha256": source.sha256,
        },
        "video": source.video,
        "frames": len(report.track),
        "distance_m": report.distance_m,
        "distance_u95_m": report.u95_m,
        "distance_raw_m": report.raw_distance_m,
        "revision": report.revision,
        "warning": report.warning,
        "error": report.error,
        "error_code": report.error_code,
        "created_at": iso(report.created_at),
        "finished_at": iso(report.finished_at),
    }


def _counter(report: Report) -> Mapping[str, Any] | None:
    """Return what the burnt-in counter and the raw track say about each other; None without one.

    Lengths are in mm; the readings are not in the report.
    """
    counter = report.counter
    if counter.readings is None:
        return None
    found = counter.comparison
    comparison = None
    if found is not None:
        comparison = {
            "scale": found.scale,
            "scale_sigma": None if found.scale is None else found.sigma,
            "length": None if found.length is None else asdict(found.length),
            "camera_mm": found.camera_mm,
            "camera_sigma_mm": found.camera_sigma_mm,
            "agrees": found.agrees,
            "faults": [asdict(fault) for fault in found.faults],
        }
    return {
        "unit": counter.unit,
        "frames": len(counter.readings.reading),
        "legible_frames": int((~np.isnan(counter.readings.reading)).sum()),
        "comparison": comparison,
    }


def _events(report: Report) -> list[Mapping[str, Any]]:
    return [
        {
            "at": iso(event.at),
            "who": event.who,
            "action": event.action,
            "observation_id": event.observation_id,
            "before": event.before,
            "after": event.after,
            "remark": event.remark,
        }
        for event in report.events
        if event.action != BROUGHT_IN
    ]


def _tags(report: Report) -> list[Mapping[str, Any]]:
    return [
        {
            "id": entry.id,
            "seq": entry.seq,
            "fields": entry.tag.to_json(),
            "photo_sha256": entry.photo.sha256 if entry.photo else None,
            "created_by": entry.tagged_by,
            "created_at": iso(entry.tagged_at),
            "edited_by": entry.edited_by,
            "edited_at": iso(entry.edited_at),
        }
        for entry in sorted(report.entries, key=lambda entry: entry.seq)
    ]


def _columns(track: Track) -> Any:
    """Return the columns of track.json, rounded like track.csv."""
    return json.loads(track.to_json())["columns"]


def _text(part: object) -> str:
    return _HALF.sub("\ufffd", json.dumps(part, ensure_ascii=False, allow_nan=False))
