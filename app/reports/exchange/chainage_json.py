"""The whole report as JSON, in a versioned schema that `app.imports.moved.chainage_json` reads.

`observations` holds derived values, like the tables. An import starts from their sources: `tags`
(what people stated), the raw `track`, its `health`, the joint `sightings`, the `mount_tilt` against
the rig, the `stance` of the camera in the pipe, the rig and the stated corrections. `counter` is
derived from the film, so an import, which has none, leaves it out.

An imported inspection is exported unchanged, so `events` omits the import. The history of the page,
PDF and HTML mention it.
"""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

import numpy as np
from pydantic import BaseModel

from app.imports.moved.chainage_json import FAMILY, VERSION
from app.imports.moved.whole_inspection import (
    MovedAttachment,
    MovedEvent,
    MovedFinding,
    MovedInspection,
    MovedRemark,
    MovedSource,
    MovedTag,
)
from app.reports.content.media_files import MediaFile, media_of, read_stored
from app.reports.report import Entry, FormatNeeds, Loss, Phrase, Report, Written
from app.reports.tables import table
from app.reports.text.legible import iso
from app.settings import MIB
from app.survey.distances.corrected import result_of
from app.survey.findings.records import Finding
from app.survey.observations.records import BROUGHT_IN

_SCHEMA = f"{FAMILY}/{VERSION}"

_HEALTH_DECIMALS = 4
_MOST_EMBEDDED_BYTES = 20 * MIB
"""Most bytes of photos and voice notes in the file: an import reads a file of 64 MiB."""
_SIZES = ("length", "width")
_HALF = re.compile("[\ud800-\udfff]")
"""A surrogate: a text of another program may contain it, UTF-8 cannot."""


def write(report: Report) -> Written:
    """Write everything, with the version of the schema; one line for each part.

    Raises:
        FormatNeeds: The photos are wanted, and too large for a text.
    """
    media = media_of(report)
    parts: dict[str, Any] = {
        "schema": _SCHEMA,
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
        "tags": _tags(report, media),
        "attachments": _attachments(report, media),
        "remarks": [_fields_of(MovedRemark, it, _exactly) for it in report.kept.remarks],
        "review": {
            "state": report.review,
            "by": report.reviewed_by,
            "at": _exactly(report.reviewed_at),
        },
        "findings": [_finding(finding) for finding in report.kept.findings],
        "code_pack": report.pack if report.kept.pack_table is not None else None,
        "report_template": report.template_in_force.model_dump(mode="json"),
        "track": {"columns": json.loads(report.raw_track.to_json())["columns"]},
        "health": {
            "columns": {
                name: [round(value, _HEALTH_DECIMALS) for value in column.tolist()]
                for name, column in report.health.items()
            }
        },
        "sightings": [asdict(sighting) for sighting in report.sightings],
        "mount_tilt": asdict(tilt) if (tilt := report.corrected.tilt) else None,
        "stance": asdict(report.initial_pose),
    }
    losses: list[Loss] = []
    if report.extras.photos:
        parts["media"] = _embedded(media, losses)
    lines = ",\n".join(f"{_text(name)}: {_text(part)}" for name, part in parts.items())
    return Written(f"{{\n{lines}\n}}\n".encode(), tuple(losses))


def _fields_of(
    kind: type[BaseModel], row: object, at: Callable[[datetime | None], str | None] = iso
) -> dict[str, Any]:
    """Return the fields of a part as the import reads them, None for those that the row lacks."""
    found = {name: getattr(row, name, None) for name in kind.model_fields}
    return {
        name: at(value) if isinstance(value, datetime) else value for name, value in found.items()
    }


def _finding(finding: Finding) -> Mapping[str, Any]:
    fields = _fields_of(MovedFinding, finding, _exactly)
    sizes = {name: size and asdict(size) for name, size in fields.items() if name in _SIZES}
    return fields | sizes


def _inspection(report: Report) -> Mapping[str, Any]:
    return {
        **_fields_of(MovedInspection, report),
        "rig": report.rig.model_dump(mode="json"),
        "source": _fields_of(MovedSource, report.source),
        "video": report.source.video,
        "frames": len(report.track),
        "distance_m": report.distance_m,
        "distance_u95_m": report.u95_m,
        "distance_raw_m": report.raw_distance_m,
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
    events = (event for event in report.events if event.action != BROUGHT_IN)
    return [_fields_of(MovedEvent, event) for event in events]


def _tags(report: Report, media: Mapping[str, MediaFile]) -> list[Mapping[str, Any]]:
    return [
        {
            **_fields_of(MovedTag, entry),
            "fields": entry.tag.to_json(),
            "photo_sha256": _own_photo_sha256(entry),
            "photo": media[entry.id].path if entry.id in media else None,
            "created_by": entry.tagged_by,
            "created_at": iso(entry.tagged_at),
        }
        for entry in sorted(report.entries, key=lambda entry: entry.seq)
    ]


def _own_photo_sha256(entry: Entry) -> str | None:
    """Return the digest of the photo of its frame, which need not be the main one."""
    own = (photo for photo in entry.photos if photo.of in ("", entry.id))
    return next((photo.sha256 for photo in own), None)


def _attachments(report: Report, media: Mapping[str, MediaFile]) -> list[Mapping[str, Any]]:
    known = {entry.id for entry in report.entries}
    return [
        {
            **_fields_of(MovedAttachment, one, _exactly),
            "strokes": [stroke.model_dump(exclude_none=True) for stroke in one.strokes],
            "file": media[one.id].path if one.id in media else None,
        }
        for one in report.kept.attachments
        if one.observation_id in known
    ]


def _exactly(at: datetime | None) -> str | None:
    """Return a moment to the microsecond: the names of photos follow the order of attachments."""
    return None if at is None else at.astimezone(UTC).isoformat()


def _embedded(media: Mapping[str, MediaFile], losses: list[Loss]) -> Mapping[str, str]:
    found, size = {}, 0
    for file in media.values():
        content = read_stored(file.stored)
        if isinstance(content, str):
            losses.append(Loss(f"file_{content}", file.entry, name=file.path))
            continue
        size += len(content)
        if size > _MOST_EMBEDDED_BYTES:
            most = _MOST_EMBEDDED_BYTES // MIB
            raise FormatNeeds(
                f"The photos have more than {most} MiB, which is too much "
                "for a JSON file; the archive file has them beside it.",
                Phrase("failure.photos_too_large", most=most),
            )
        found[file.path] = base64.b64encode(content).decode()
    return found


def _text(part: object) -> str:
    return _HALF.sub("\ufffd", json.dumps(part, ensure_ascii=False, allow_nan=False))
