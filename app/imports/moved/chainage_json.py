"""Reads the report in JSON: everything from which distances are derived.

`app.reports.exchange.chainage_json` writes it.

Derived values (`observations`, results) are not read but computed anew. Photos and voice notes may
be in the file; the film never is.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydantic import ValidationError
from pydantic_core import ErrorDetails

from app.errors import InvalidImport
from app.imports.moved.chainage_json_schema import File, Parts
from app.imports.moved.moved_media import require_media
from app.imports.moved.whole_inspection import MovedFile, WholeInspection
from vo_core import Rig, Track
from vo_core.errors import InvalidRig, RigVideoMismatch
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting

FAMILY, VERSION = "chainage-report", 2

_SHOWN_FAULTS = 10
_MOST_PARTS = 1_000_000
"""Most values and lists in all events together: ten for each."""

_HALF_CHARACTER = re.compile(rb"\\u[dD][89a-fA-F]")
"""An escaped surrogate; most belong to a pair."""


def read(content: bytes) -> WholeInspection:
    """Check a file strictly and return its inspection.

    Raises:
        InvalidImport: The file is not JSON or not of this schema or version, or a value is not
        allowed; the text names faults and places.
    """
    values = _parsed(content)
    _require_version(values)
    file = _checked(values)
    about = file.inspection
    try:
        rig = Rig.parse(about.rig)
        rig.require_picture_size(about.video.width, about.video.height)
    except (InvalidRig, RigVideoMismatch) as error:
        raise InvalidImport(f"The file cannot be imported: {error}") from error
    track = _track(file.track.columns)
    health = [Health(*row) for row in zip(*file.health.columns.in_order(), strict=True)]
    _require(_beyond_the_track(file, len(track)) + _outside_the_picture(file, rig))
    _require_few_parts(file)
    return WholeInspection(
        about=about,
        rig=rig,
        stated=file.corrections.stated,
        track=track,
        health=tuple(health),
        sightings=tuple(Sighting(**sighting.model_dump()) for sighting in file.sightings),
        tilt=MountTilt(**file.mount_tilt.model_dump()) if file.mount_tilt else None,
        initial_pose=InitialPose(**file.stance.model_dump()) if file.stance else AS_STATED,
        tags=tuple(sorted(file.tags, key=lambda tag: tag.seq)),
        events=tuple(file.events),
        attachments=tuple(file.attachments),
        remarks=tuple(file.remarks),
        review=file.review,
        findings=tuple(file.findings),
        code_pack=file.code_pack,
        report_template=file.report_template,
        files={path: _embedded(path, text) for path, text in file.media.items()},
    )


def _track(columns: Any) -> Track:
    dtypes = {"frame": np.int64, "status": np.str_}
    return Track(
        **{
            name: np.array(getattr(columns, name), dtypes.get(name, np.float64))
            for name in type(columns).model_fields
        }
    )


def _embedded(path: str, text: str) -> MovedFile:
    try:
        content = base64.b64decode(text, validate=True)
    except ValueError as error:
        raise InvalidImport(f"The file cannot be imported: {path} is not in base64.") from error
    require_media(path, content)
    return MovedFile(len(content), hashlib.sha256(content).hexdigest(), content=content)


def is_chainage_json(content: bytes) -> bool:
    """Return whether the file declares this format, in any version."""
    head = content[:4096].removeprefix(b"\xef\xbb\xbf").lstrip()
    return head.startswith(b"{") and b'"schema"' in head and FAMILY.encode() in head


def _parsed(content: bytes) -> Any:
    """Parse JSON, refusing what other readers would interpret differently.

    Raises:
        InvalidImport: The text is not JSON, repeats a name, or contains NaN or infinity.
    """
    try:
        values = json.loads(
            content.decode("utf-8-sig"),
            parse_constant=_refused_number,
            parse_float=_finite,
            object_pairs_hook=_said_once,
        )
        if _HALF_CHARACTER.search(content):
            json.dumps(values, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        text = error.object[max(error.start - 20, 0) : error.start]
        raise InvalidImport(
            f"The file cannot be imported: a text contains half a character after {text!r}."
        ) from error
    except UnicodeDecodeError as error:
        raise InvalidImport(f"The file is not in UTF-8 (byte {error.start}).") from error
    except json.JSONDecodeError as error:
        raise InvalidImport(
            f"The file is not JSON: {error.msg} in line {error.lineno}, column {error.colno}."
        ) from error
    except (ValueError, RecursionError) as error:
        raise InvalidImport(f"The file cannot be read: {error}.") from error
    return values


def _refused_number(name: str) -> None:
    raise ValueError(f"{name} is no number")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {text[:40]} is too large")
    return value


def _said_once(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        (twice, _), *_ = Counter(name for name, _ in pairs).most_common(1)
        raise ValueError(f"{twice!r:.60} occurs twice in one object")
    return found


def _require_version(values: Any) -> None:
    schema = values.get("schema") if isinstance(values, dict) else None
    found = re.fullmatch(rf"{FAMILY}/([0-9]{{1,9}})", schema) if isinstance(schema, str) else None
    if found is None:
        raise InvalidImport(
            f"The file is no report of Chainage: its schema is not {FAMILY}/{VERSION}."
        )
    version = int(found[1])
    if version < VERSION:
        raise InvalidImport(
            f"The file is of version {version}, which holds no track. Export the inspection again "
            "with this version of Chainage."
        )
    if version > VERSION:
        raise InvalidImport(
            f"The file is of version {version}, and this Chainage reads {VERSION}. Import it with "
            "a newer Chainage."
        )


def _checked(values: Any) -> Parts:
    try:
        return File.model_validate(values)
    except ValidationError as error:
        _require([_reason(fault) for fault in error.errors(include_url=False)])
        raise


def _reason(fault: ErrorDetails) -> str:
    # Of a union every branch is reported; its names follow the field's in the path.
    where = ".".join(str(step) for step in fault["loc"]) or "the file"
    found = fault["input"]
    is_short = isinstance(found, str | int | float | bool)
    shown = f" (found {found!r:.60})" if is_short else ""
    return f"{where:.120}: {fault['msg'].removeprefix('Value error, ')}{shown}"


def _require(reasons: Sequence[str]) -> None:
    if not reasons:
        return
    more = len(reasons) - _SHOWN_FAULTS
    shown = [*reasons[:_SHOWN_FAULTS], *([f"and {more} more"] if more > 0 else [])]
    raise InvalidImport(f"The file cannot be imported: {'; '.join(shown)}.")


def _require_few_parts(file: Parts) -> None:
    """Limit the content of events, which has no schema: an empty list of two bytes takes 60 in
    memory.
    """
    parts: list[object] = [it for event in file.events for it in (event.before, event.after)]
    seen = 0
    while parts:
        part = parts.pop()
        inner = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
        seen += len(inner)
        if seen > _MOST_PARTS:
            raise InvalidImport(
                f"The file cannot be imported: its events contain more than {_MOST_PARTS} things."
            )
        parts.extend(inner)


def _beyond_the_track(file: Parts, rows: int) -> list[str]:
    reasons = [
        f"sightings.{n}.frame: the track has no frame {sighting.frame}"
        for n, sighting in enumerate(file.sightings)
        if sighting.frame >= rows
    ]
    healthy = len(file.health.columns.overlap)
    if healthy > rows:
        reasons.append(f"health.columns: {healthy} rows, but the track has {rows}")
    return reasons


def _outside_the_picture(file: Parts, rig: Rig) -> list[str]:
    width, height = rig.camera.width, rig.camera.height
    marks = enumerate(file.corrections.stated.joints.marked)
    pixels = [
        *((f"tags.{n}.fields", tag.fields.pixel) for n, tag in enumerate(file.tags)),
        *((f"corrections.stated.joints.marked.{n}", mark.pixel) for n, mark in marks),
    ]
    return [
        f"{where}.pixel: ({pixel[0]:g}, {pixel[1]:g}) is outside the picture of {width} x {height}"
        for where, pixel in pixels
        if pixel is not None
        and not (-0.5 <= pixel[0] <= width - 0.5 and -0.5 <= pixel[1] <= height - 0.5)
    ]
