"""A long film is tracked on all idle slots at once, and gives what one run gives."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from builders import Client, children, clip_rig, make_clip, send_signal, serving, wait_until
from in_process import track

from app.jobs.messages import Limits
from app.jobs.track import chunks
from app.jobs.track.batches import Batch
from app.jobs.track.messages import TrackRequest
from vo_core import Track

TRACKER = "app.jobs.track.tracker"
FRAMES, SHARED, PACE = 240, 140, 4.0


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_clip(tmp_path_factory.mktemp("film") / "film.mp4", FRAMES)


@pytest.fixture(scope="module")
def two_slots(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A server that splits films of this length already."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chunks, "SHARED_FRAMES", SHARED)
        patch.setattr(chunks, "LEAST_FRAMES", SHARED + 40)
        with serving(tmp_path_factory.mktemp("data"), max_jobs=2, pace=PACE) as client:
            yield client


def track_of(client: Client, inspection_id: str) -> Track:
    return Track.from_csv(client.get(f"/api/inspections/{inspection_id}/track").text)


def in_one_run(film: Path) -> list[Batch]:
    messages, _ = track(TrackRequest(str(film), clip_rig(), Limits(2**30)))
    return [message for message in messages if isinstance(message, Batch)]


def test_the_joined_track_is_that_of_one_run(two_slots: Client, film: Path) -> None:
    inspection_id = two_slots.inspect(film)
    wait_until(lambda: len(children(TRACKER)) == 2)
    send_signal(TRACKER, signal.SIGKILL)  # both go on, from their checkpoints or anew
    assert two_slots.wait(inspection_id)["status"] == "done"
    runs = two_slots.data / "inspections" / inspection_id / "runs"
    wait_until(lambda: not runs.exists())
    joined = track_of(two_slots, inspection_id)
    serial = Track.from_estimates(each for batch in in_one_run(film) for each in batch.smoothed)
    assert len(joined) == len(serial) == FRAMES
    sigma_mm = np.maximum(serial.sigma_registration_mm, 0.05)
    assert np.abs(joined.distance_mm - serial.distance_mm).max() < 0.5
    assert (np.abs(joined.distance_mm - serial.distance_mm) < 2 * sigma_mm).all()
    ratio = joined.sigma_distance_mm[100:] / serial.sigma_distance_mm[100:]
    assert (ratio.min(), ratio.max()) == pytest.approx((1, 1), abs=0.05)


def test_a_film_in_chunks_can_be_stopped(two_slots: Client, film: Path) -> None:
    inspection_id = two_slots.inspect(film)
    wait_until(lambda: two_slots.inspection(inspection_id)["progress"]["frames_done"] > 10)
    two_slots.post(f"/api/inspections/{inspection_id}/cancel").raise_for_status()
    assert two_slots.wait(inspection_id)["status"] == "cancelled"
    # Its beginning is kept, which is nothing if only the second chunk has shown frames by then.
    assert len(track_of(two_slots, inspection_id)) < FRAMES
    assert children(TRACKER) == []
