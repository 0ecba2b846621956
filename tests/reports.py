"""Reports without a server: an inspection with observations of every kind, and random ones."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from builders import clip_rig
from numpy.typing import NDArray

from app.reports.content.translator import Translator
from app.reports.report import Company, Entry, Loss, Photo, Phrase, Report, Source
from app.survey.adjustment.adjust import adjust
from app.survey.catalogue import built_in
from app.survey.distances.corrected import Corrected
from app.survey.distances.interval import half_width_m
from app.survey.distances.stated import Joints, Length, RigSigma, Stated, Zero
from app.survey.observations.checks import Issue
from app.survey.observations.records import Event
from app.survey.observations.tag import StatedTag
from app.survey.places.measure import Figure
from vo_core import Rig, Track
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting
from vo_core.mosaic.layout import Layout

AT = datetime(2026, 9, 14, 9, 42, tzinfo=UTC)
FPS = 30.0
LENGTH_M = 24.6
ENGLISH = Translator("en", "m")

HEADER: Mapping[str, Any] = {
    "asset_id": "CUL-0041", "start_node": "HW-UP", "end_node": "HW-DN", "direction": "with_flow",
    "date": "2026-09-14", "time": "09:42", "operator": "Operator 1", "client": "Road authority",
    "asset_type": "culvert", "shape": "circular", "height_mm": 900, "material": "concrete",
    "reference_point": "inner face of the headwall", "standard": "EN 13508-2",
    "edition": "2003+A1:2011", "end_condition": "complete", "unit_length_m": 1.5,
    "known_length_m": LENGTH_M, "known_length_source": "tape", "job_ref": "JOB-77",
    "calibration_id": "cal-1", "start_lat": 51.4525, "start_lon": 9.0, "end_lat": 51.4525,
    "end_lon": 9.0003541,
}  # fmt: skip

EVERY_FIELD: Mapping[str, Any] = {
    "asset_id": "CUL-0041", "start_node": "HW-UP", "end_node": "HW-DN",
    "direction": "against_flow", "date": "2026-09-14", "time": "09:42", "operator": "Olga",
    "client": "Roads", "asset_type": "drain", "shape": "rectangular", "height_mm": 900,
    "width_mm": 1500, "material": "bamboo", "reference_point": "third fence post",
    "standard": "EN 13508-2", "edition": "2003", "end_condition": "abandoned",
    "abandon_reason": "robot stuck in silt", "code_pack": "Pack 7", "video_files": "a.mp4;b.mp4",
    "rig_id": "rig-3", "calibration_id": "cal-9", "unit_length_m": 2.44, "camera_offset_m": 0.31,
    "reverse_of": "CUL-0040", "upstream_node": "HW-ELSE", "downstream_node": "HW-OTHER",
    "operator_certificate": "CERT-5", "reviewer": "Rita", "contractor": "Digger Ltd",
    "job_ref": "JOB-77", "client_job_ref": "ORDER-12", "purpose": "first_survey",
    "method": "walk_through", "lining_type": "tiles", "lining_material": "granite sets",
    "known_length_m": 24.6, "known_length_source": "tape", "expected_length_m": 25.5,
    "year": 1987, "cleaned": True, "cleaned_on": "2026-09-12", "weather": "foggy",
    "temperature_c": 12.5, "flow_control": "two pumps", "water_level_pct": 17,
    "location_text": "by the mill", "road": "Dorfstrasse", "road_chainage": "12+340",
    "road_chainage_end": "12+362",
    "camera": "Eyeball", "lens": "6 mm", "start_lat": 51.4525, "start_lon": 9.0,
    "end_lat": 51.4525, "end_lon": 9.0003541, "tether": True, "remarks": "mind the dog",
}  # fmt: skip
"""A value of its own for every field, outside the lists of the formats where there is one."""

OBSERVATIONS: Sequence[Mapping[str, Any]] = (
    {"distance_m": 0.0, "code": "BCD", "char1": "Z", "remark": "inlet headwall"},
    {"distance_m": 0.05, "code": "BDD", "char1": "A", "quant1": 10.0},
    {"distance_m": 3.2, "code": "BAB", "char1": "B", "char2": "A", "quant1": 2.0, "clock_from": 11,
     "cont_id": 1, "cont_role": "start", "cont_length_m": 3.2, "severity": 3},
    {"distance_m": 4.8, "code": "BAB", "char1": "B", "char2": "A", "quant1": 4.0, "clock_from": 11,
     "cont_id": 1, "cont_role": "change", "severity": 3, "remark": "wider here"},
    {"distance_m": 6.4, "code": "BAB", "char1": "B", "char2": "A", "quant1": 4.0, "clock_from": 11,
     "cont_id": 1, "cont_role": "finish", "severity": 3},
    {"distance_m": 9.75, "code": "BAJ", "char1": "B", "quant1": 18.0, "clock_from": 12,
     "clock_to": 12, "at_joint": True, "joint_no": 6, "source": "joint", "severity": 2},
    {"distance_m": 9.75, "code": "BBF", "char1": "B", "clock_from": 3, "at_joint": True,
     "joint_no": 6, "severity": 3, "remark": 'dripping; text with "quote", and comma'},
    {"distance_m": 11.0, "code": None, "remark": "=1+1"},
    {"distance_m": 12.4, "code": "BAC", "char1": "C", "clock_from": 9, "clock_to": 2,
     "severity": 5, "remark": "wall fallen in; road above: act now"},
    {"distance_m": 17.12, "code": "BAF", "char1": "F", "char2": "E", "clock_from": 9,
     "clock_to": 11, "severity": 4, "remark": "Bewehrung sichtbar, über 0,3 m – 钢筋 ظاهر"},
    {"distance_m": 20.3, "code": "BDB", "severity": 1, "remark": "scour <b>at</b> apron & wall"},
    {"distance_m": LENGTH_M, "code": "BCE", "char1": "E", "remark": "outlet headwall"},
)  # fmt: skip
"""Twelve observations of every kind: bare tag, stretch, sector, joint, any script, formula,
markup."""


DEFECTS = len(OBSERVATIONS) - 2 - 2
"""Start and end are none, and the stretch of three rows is one."""
ENTERED = (
    "code", "char1", "char2", "quant1", "quant2", "clock_from", "clock_to", "severity", "remark",
)  # fmt: skip
"""Fields of an entry that are PUT unchanged."""


def entry(seq: int, photos: Path | None = None, **fields: Any) -> Entry:
    """Build an entry like the service; `fields` as in Entry and in its tag.

    Args:
        seq: Its number.
        photos: Folder for its photo; None for no photo.
    """
    distance_m = fields.get("distance_m")
    known = {name: fields.get(name) for name in ("code", "char1", "char2")}
    defaults: dict[str, Any] = dict.fromkeys(Entry.__dataclass_fields__) | {
        "id": f"00000000-0000-4000-8000-{seq:012d}",
        "seq": seq,
        "number": seq,
        "time_s": None if distance_m is None else round(max(0.0, distance_m) * 100 / FPS, 3),
        "u95_m": None if distance_m is None else round(0.02 + 0.0025 * abs(distance_m), 3),
        "raw_m": None if distance_m is None else round(distance_m * 1.002, 3),
        "source": None if distance_m is None else "odometry",
        "to_go_m": None if distance_m is None else round(LENGTH_M - distance_m, 3),
        "at_joint": False,
        "kind": built_in().named(**known),
        "photo": photo(photos, seq) if photos else None,
        "more_photos": (),
        "voice_notes": (),
        "tagged_by": "Operator 1",
        "tagged_at": AT + timedelta(seconds=seq),
        "figures": (),
    }
    stated = {name: fields.pop(name, None) for name in ENTERED if name != "clock_from"}
    frame = fields.pop("frame", 0 if distance_m is None else round(distance_m * 100))
    defaults["tag"] = StatedTag.model_construct(
        frame=frame, clock_from=fields.get("clock_from"), **stated
    )
    return Entry(**defaults | fields)


def said(losses: Iterable[Loss]) -> list[str]:
    """What a person reads of losses, in English."""
    return [ENGLISH.loss(loss) for loss in losses]


def codes(losses: Iterable[Loss]) -> set[str]:
    """The key of each loss, such as `untracked 4` of an observation, and of each phrase in it."""
    found = set()
    for loss in losses:
        found.add(f"{loss.key} {loss.entry.seq}" if loss.entry else loss.key)
        for value in loss.values.values():
            some = value if isinstance(value, tuple) else (value,)
            found |= {one.key for one in some if isinstance(one, Phrase)}
    return found


def remarked(entry: Entry, remark: str) -> Entry:
    """Return the entry with another remark."""
    return replace(entry, tag=entry.tag.model_copy(update={"remark": remark}))


def measured(entry: Entry) -> Entry:
    """Return the entry with a width and a depth that were measured in its frame."""
    points = [
        {"frame": entry.tag.frame, "pixel": pixel} for pixel in ([100.0, 80.0], [300.0, 240.0])
    ]
    measures = [{"kind": kind, "points": points} for kind in ("width", "depth")]
    figures = (Figure("width", 23.04, 1.52, None, None), Figure("depth", 42.0, 3.2, 14.0, 0.91))
    tag = entry.tag.model_copy(update={"measures": measures})
    return replace(entry, tag=tag, figures=figures)


def photo(folder: Path, seq: int, asset: str = "CUL-0041") -> Photo:
    """Write a JPEG of 640x480 that shows its number."""
    picture = np.full((480, 640, 3), (90, 100, 110), np.uint8)
    noise = np.random.default_rng(seq).integers(0, 60, (60, 80, 3), dtype=np.uint8)
    picture += cv2.resize(noise, (640, 480), interpolation=cv2.INTER_CUBIC)
    cv2.putText(picture, str(seq), (40, 280), cv2.FONT_HERSHEY_SIMPLEX, 7, (240, 240, 240), 18)
    path = folder / f"{seq}.jpg"
    done = cv2.imwrite(str(path), picture)
    assert done
    return Photo(f"{asset}-{seq:03d}.jpg", path, hashlib.sha256(path.read_bytes()).hexdigest())


def film_source(source: Source, film: Path) -> Source:
    """Return the source of a report over this film."""
    with film.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    return replace(source, size=film.stat().st_size, sha256=sha256)


def track_of(length_m: float, rows: int = 500) -> Track:
    """Return a steady drive with a growing sigma."""
    distance = np.linspace(0, 1000 * length_m, rows)
    zero = np.zeros(rows)
    return Track(
        frame=np.arange(rows), time_s=np.arange(rows) / FPS,
        x_mm=distance, y_mm=zero, yaw_deg=zero, distance_mm=distance,
        sigma_distance_mm=10 + distance / 800, quality=np.full(rows, 0.8),
        status=np.full(rows, "ok"), sigma_registration_mm=10 + distance / 800,
        z_mm=zero, pitch_deg=zero, roll_deg=zero, looking_around=zero,
    )  # fmt: skip


def health_columns(frames: Iterable[Health]) -> dict[str, NDArray[np.float64]]:
    """Return the columns of the picture health of some frames."""
    rows = list(frames)
    return {
        field.name: np.array([getattr(health, field.name) for health in rows], np.float64)
        for field in fields(Health)
    }


def report(
    photos: Path | None = None,
    observations: Sequence[Mapping[str, Any]] = OBSERVATIONS,
    **changes: Any,
) -> Report:
    """Return the report of an inspection with these observations.

    Args:
        photos: Folder for a photo of each observation.
        observations: Fields of Entry.
        changes: Fields of Report.
    """
    rig = Rig.model_validate(clip_rig())
    track = track_of(LENGTH_M)
    stated = Stated()
    made = Report(
        id="0123456789abcdef0123456789abcdef", name="Culvert 41", status="done", made_at=AT,
        created_at=AT, finished_at=AT, revision=0, header=HEADER,
        pack=built_in().name, rig=rig,
        source=Source("upload", "CUL-0041_20260914_0942.mp4", 123456, "ab" * 32,
                      {"width": 640, "height": 480, "duration_s": 82.0, "frames": 2461,
                       "codec": "h264", "playable": True, "media_type": "video/mp4"}),
        entries=tuple(entry(n, photos, **fields) for n, fields in enumerate(observations, 1)),
        distance_m=LENGTH_M, u95_m=0.082, raw_distance_m=24.649,
        corrected=Corrected(stated, adjust(track, rig, stated, []), None),
        issues=(), events=(), track=track, raw_track=track,
        health=health_columns([]), sightings=(), wall={}, layout=None,
    )  # fmt: skip
    return replace(made, **changes)


def full_report(folder: Path, **changes: Any) -> Report:
    """Return a report in a round pipe, with everything that the formats for people show.

    It has joints, a known length, a picture of the wall, health, checks and changes.

    Args:
        folder: For photos and tiles of the wall.
        changes: Fields of Report.
    """
    rig = Rig.model_validate(ROUND)
    rows = 2400
    raw = replace(
        track_of(1.002 * LENGTH_M, rows),
        quality=0.85 + 0.1 * np.sin(np.arange(rows) / 40),
        status=np.where(abs(np.arange(rows) - 1500) < 20, "lost", "ok").astype(np.str_),
    )
    at_mm = 1.002 * 1500 * np.arange(1, 17)
    frames = np.searchsorted(raw.distance_mm, at_mm)
    sightings = tuple(
        Sighting(int(frame), float(mm - raw.distance_mm[frame]), 2.0, 0.5)
        for frame, mm in zip(frames, at_mm, strict=True)
    )
    stated = Stated(
        zero=Zero(frame=0),
        lengths=(
            Length(
                first_frame=0, last_frame=rows - 1, length_m=LENGTH_M, sigma_mm=5.0, kind="known"
            ),
        ),
        joints=Joints(use=True),
        rig_sigma=RigSigma(height_mm=2.0, focal_px=3.0),
    )
    adjusted = adjust(raw, rig, stated, sightings)
    assert adjusted.joints
    assert adjusted.closure is not None
    layout = Layout.of(rig)
    end = adjusted.track
    made = report(
        folder,
        rig=rig,
        header={**HEADER, **MORE_HEADER},
        raw_track=raw,
        track=end,
        raw_distance_m=round(float(raw.distance_mm[-1]) / 1000, 3),
        u95_m=half_width_m(float(end.sigma_distance_mm[-1])),
        corrected=Corrected(stated, adjusted, None),
        sightings=sightings,
        health=health_columns(
            Health(0.9, 0.3, 0.0, 0.4 if 600 < row < 760 else 0.9, 0.02) for row in range(rows)
        ),
        layout=layout,
        wall=wall_of(folder, layout, round(2 * LENGTH_M)),
        issues=(
            Issue("block", "no_code", f"00000000-0000-4000-8000-{8:012d}", {"seq": 8}),
            Issue("block", "header_field_empty", params={"field": "width_mm"}),
            Issue("warn", "poor_pictures", params={"complaint": "blurred", "percent": 6.6}),
        ),
        events=tuple(
            Event(id=n, inspection_id="0123456789abcdef0123456789abcdef",
                  observation_id=None if n == 0 else f"00000000-0000-4000-8000-{n:012d}",
                  action="created" if n < 12 else "changed", who="Operator 1",
                  at=AT + timedelta(minutes=n), before=None, after=None, remark=None)
            for n in range(16)
        ),
        company=Company("Jurutera Pembetung Sdn Bhd", logo_of(folder)),
    )  # fmt: skip
    entries = tuple(map(_seen_and_mapped, made.entries))
    return replace(replace(made, entries=entries), **changes)


def _seen_and_mapped(one: Entry) -> Entry:
    """Add a place on the map and, at 3 o'clock, a point on the wall that the camera sees."""
    if one.distance_m is None:
        return one
    lon = HEADER["start_lon"] + one.distance_m / LENGTH_M * (
        HEADER["end_lon"] - HEADER["start_lon"]
    )
    point = {"x_m": one.distance_m, "y_m": 0.12, "z_m": 0.434} if one.clock_from == 3 else {}
    return replace(one, lat=HEADER["start_lat"], lon=round(lon, 7), **point)


ROUND: Mapping[str, Any] = {
    "camera": {"model": "pinhole", "width": 1280, "height": 720, "fx": 620.0, "fy": 620.0,
               "cx": 639.5, "cy": 359.5},
    "mount": {"view": "down", "height_mm": 420.0, "rotation_deg": 0.0},
    "pipe": {"shape": "circular", "diameter_mm": 900.0, "segment_length_mm": 1500.0},
}  # fmt: skip

MORE_HEADER: Mapping[str, Any] = {
    "reviewer": "Nur Aisyah binti Ismail", "operator": "陈伟明 (Tan Wei Ming)",
    "operator_certificate": "CERT-1182", "client": "Jabatan Kerja Raya",
    "contractor": "தமிழ் Engineering", "road": "FT 5 Jalan Klang–Banting",
    "road_chainage": "km 12 + 340", "location_text": "قرية كامڤوڠ باڤن، left of the bridge",
    "water_level_pct": 10, "cleaned": True, "cleaned_on": "2026-09-12", "temperature_c": 29.5,
    "weather": "dry", "purpose": "routine", "method": "camera", "year": 1987,
    "code_pack": "EN 13508-2:2003+A1:2011", "camera": "down-looking, global shutter",
    "remarks": "Access by the western shoulder. Ключ у сторожа. ถนนสุขุมวิท 12. Ωμέγα.",
}  # fmt: skip


def wall_of(folder: Path, layout: Layout, tiles: int) -> dict[int, Path]:
    """Write tiles of concrete with a joint in every third one; three pictures are all of them."""
    found: dict[int, Path] = {}
    for k in range(tiles):
        if k >= 3:
            found[k] = found[k % 3]
            continue
        rng = np.random.default_rng(k)
        small = rng.normal(128, 18, (layout.height_px // 12 + 1, layout.width_px // 12 + 1))
        size_wh = (layout.width_px, layout.height_px)
        grey = cv2.resize(small, size_wh, interpolation=cv2.INTER_CUBIC)
        picture = np.dstack([grey, grey + 6, grey + 12]).clip(0, 255).astype(np.uint8)
        if k % 3 == 0:
            picture[:, :6] = 60
        found[k] = folder / f"wall-{k}.jpg"
        done = cv2.imwrite(str(found[k]), picture)
        assert done
    return found


def logo_of(folder: Path) -> Path:
    """Write a PNG with a transparent ground."""
    picture = np.zeros((120, 360, 4), np.uint8)
    cv2.circle(picture, (60, 60), 50, (80, 59, 29, 255), 14)
    cv2.line(picture, (130, 60), (340, 60), (80, 59, 29, 255), 14)
    path = folder / "logo.png"
    done = cv2.imwrite(str(path), picture)
    assert done
    return path


def advised(made: Report, tags: Mapping[int, Mapping[str, Any]]) -> Report:
    """Return the report with other fields of the tags of these numbers."""
    entries = (
        replace(entry, tag=entry.tag.model_copy(update=dict(tags.get(entry.seq, {}))))
        for entry in made.entries
    )
    return replace(made, entries=tuple(entries))


def page_of(reader: Any, destination: Any) -> int:
    """Return the index of the page to which a link of a PDF leads, as pypdf reads it."""
    if isinstance(destination, str):
        return int(reader.get_destination_page_number(reader.named_destinations[destination]))
    return int(reader.get_page_number(destination[0].get_object()))
