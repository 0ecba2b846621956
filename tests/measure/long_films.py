"""Writes a survey with many defects and frames into a data folder, like the server would.

The film repeats the packets of one second of a still picture, so that two hours of it take seconds
to write; the track is that of a robot at constant speed.
"""

from __future__ import annotations

import hashlib
import json
import math
import secrets
import uuid
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

from app.jobs.track.batches import Batch
from app.lab.simulation.render import render
from app.lab.simulation.sample import SAMPLE
from app.storage.blobs import keys
from app.storage.blobs.folder import FolderBlobs
from app.storage.database.database import Database
from app.storage.database.tables import Inspection
from app.storage.folder.files import DataFolder, sha256_of
from app.storage.records.imports import ImportStore, Rows
from app.survey.observations.records import Event, Observation
from app.survey.observations.tag import StatedTag
from app.tracking.films.runs import track_metadata
from app.tracking.pictures.videos import file_name, video_columns
from app.tracking.tracks import Tracks
from vo_core import Estimate
from vo_core.geometry.height import scale_sigma
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting
from vo_core.video_info import VideoInfo

RATE_HZ = 25
STEP_MM = 5.0
"""Distance between two frames: 7.5 m/min, a kilometre in 200,000 frames."""
WHO = "measured"
_SCALE_SIGMA = scale_sigma(SAMPLE.rig)

_CODES: tuple[dict[str, object], ...] = (
    {"code": "BAB", "char1": "C", "char2": "A", "quant1": 2.0, "severity": 3},
    {"code": "BBA", "char1": "C", "quant1": 10.0, "severity": 4},
    {"code": "BBF", "char1": "B", "severity": 2},
)
_STRETCH_EVERY = 10
"""One in this many defects starts a stretch, which the third after it finishes."""


def add_long_survey(data: Path, defects: int, frames: int) -> str:
    """Add a tracked inspection to a data folder that no server uses; return its id."""
    folder = DataFolder(data, reserve_bytes=0)
    database = Database(folder.database)
    try:
        return _add(folder, database, defects, frames)
    finally:
        database.close()
        folder.close()


def _add(folder: DataFolder, database: Database, defects: int, frames: int) -> str:
    inspection_id = secrets.token_hex(16)
    place = folder.inspection(inspection_id)
    (place / "photos").mkdir(parents=True)
    picture = next(render(SAMPLE)).image
    probed = VideoInfo(
        width=picture.shape[1], height=picture.shape[0], codec="h264", container="mov,mp4",
        pixel_format="yuv420p", frames=frames, duration_s=frames / RATE_HZ, rate_hz=RATE_HZ,
    )  # fmt: skip
    film = place / file_name(probed)
    _make_film(film, picture, frames)
    estimates = [_estimate(frame) for frame in range(frames)]
    now = datetime.now(UTC)
    inspection = Inspection(
        id=inspection_id,
        name=f"{defects} defects on {frames} frames",
        status="done",
        rig=SAMPLE.rig.model_dump(mode="json"),
        header={},
        source_kind="upload",
        source_filename="film.mp4",
        source_size=film.stat().st_size,
        source_sha256=sha256_of(film),
        video_file=film.name,
        video=video_columns(probed),
        frames_done=frames,
        distance_mm=estimates[-1].distance_mm,
        sigma_distance_mm=estimates[-1].sigma_distance_mm,
        corrections={},
        revision=0,
        created_at=now,
        queued_at=now,
        finished_at=now,
    )
    (place / "rig.json").write_text(json.dumps(inspection.rig))
    blobs = FolderBlobs(folder.root)
    tracks = Tracks(blobs, folder)
    tracks.begin(inspection_id)
    health = [(frame, _GOOD) for frame in range(frames)]
    tracks.append(inspection_id, Batch(estimates, health=health, sightings=_joints(frames)))
    tracks.finish(inspection_id, track_metadata(inspection))
    jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 60])[1].tobytes()
    observations = list(_observations(inspection_id, defects, frames, jpeg))
    for row in observations:
        blobs.put(keys.photo(inspection_id, row.id, row.frame), jpeg)
    events = [_event(inspection, row) for row in (None, *observations)]
    ImportStore(database).add([Rows(inspection, observations, events)])
    return inspection_id


def _make_film(path: Path, picture: np.ndarray[Any, Any], frames: int) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=RATE_HZ)
        stream.height, stream.width = picture.shape
        stream.pix_fmt, stream.gop_size = "yuv420p", RATE_HZ
        stream.options = {"preset": "ultrafast", "tune": "zerolatency", "crf": "34"}
        frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p")
        second = []
        for n in range(RATE_HZ):
            frame.pts = n
            second += [(bytes(packet), packet.is_keyframe) for packet in stream.encode(frame)]
        stream.encode()
        for n in range(frames):
            content, is_key = second[n % RATE_HZ]
            packet = av.Packet(content)
            packet.stream, packet.time_base = stream, stream.codec_context.time_base
            packet.pts = packet.dts = n
            packet.duration = 1
            packet.is_keyframe = is_key
            container.mux(packet)


def _estimate(frame: int) -> Estimate:
    mm = STEP_MM * frame
    registration_mm = 1.0 + 0.0005 * mm
    return Estimate(
        frame=frame, time_s=frame / RATE_HZ, x_mm=mm, y_mm=3.0 * np.sin(mm / 900), yaw_deg=0.0,
        distance_mm=mm, sigma_distance_mm=math.hypot(registration_mm, _SCALE_SIGMA * mm),
        quality=0.9, status="ok", sigma_registration_mm=registration_mm,
    )  # fmt: skip


_GOOD = Health(overlap=0.95, brightness=0.4, overexposed=0.0, sharpness=0.9, fixed_pattern=0.0)


def _joints(frames: int) -> Iterator[Sighting]:
    length_mm = SAMPLE.rig.pipe.segment_length_mm
    assert length_mm is not None
    for number in range(1, int(STEP_MM * (frames - 1) / length_mm) + 1):
        yield Sighting(round(number * length_mm / STEP_MM), 0.0, 1.0, -0.2)


def _observations(
    inspection_id: str, defects: int, frames: int, jpeg: bytes
) -> Iterator[Observation]:
    digest, now = hashlib.sha256(jpeg).hexdigest(), datetime.now(UTC)
    width, height = SAMPLE.rig.camera.width, SAMPLE.rig.camera.height
    for n in range(defects):
        frame = n * frames // defects
        # Within the middle of the picture, where every frame shows the wall.
        u, v = (0.3 + 0.4 * (n * 7 % 11) / 10) * width, (0.35 + 0.3 * (n * 5 % 7) / 6) * height
        tag = StatedTag.kept({"frame": frame, "pixel": (round(u, 1), round(v, 1))} | _fields(n))
        yield Observation(
            inspection_id=inspection_id, id=str(uuid.uuid4()), seq=n + 1, tag=tag,
            photo_frame=frame, photo_sha256=digest, created_at=now, created_by=WHO,
        )  # fmt: skip


def _fields(n: int) -> dict[str, object]:
    number, place = n // _STRETCH_EVERY + 1, n % _STRETCH_EVERY
    if place in (0, 3):
        return _CODES[1] | {"continuous": f"{'A' if place == 0 else 'B'}{number}"}
    return _CODES[n % len(_CODES)]


def _event(inspection: Inspection, row: Observation | None) -> Event:
    after = row.tag.to_json() if row else {"name": inspection.name, "header": inspection.header}
    return Event(
        inspection_id=inspection.id, observation_id=row.id if row else None, action="created",
        who=WHO, at=inspection.created_at, before=None, after=after,
    )  # fmt: skip
