"""Throughput from the times at which films ended, and reasons of failures."""

from datetime import UTC, datetime, timedelta

import pytest

from app.archive.reasons import grouped
from app.archive.throughput import throughput
from app.storage.archive.films import Ended, Failure

BEGIN = datetime(2026, 11, 1, tzinfo=UTC)


def ended(*at_s: float) -> list[Ended]:
    """Films of 1000 bytes and 50 frames; the newest first."""
    return [Ended(BEGIN + timedelta(seconds=each), 1000, 50) for each in sorted(at_s)[::-1]]


def test_the_rate_is_that_of_the_films_that_ended_last() -> None:
    rate = throughput(ended(0, 10, 20, 30))
    assert rate is not None
    assert (rate.fps, rate.films_per_h, rate.bytes_per_s) == (5.0, 360.0, 100.0)
    assert rate.eta_s(2000) == 20.0


def test_a_night_without_a_server_does_not_slow_the_rate_down() -> None:
    rate = throughput(ended(0, 10, 20, 30_020, 30_030))
    assert rate is not None
    assert rate.films_per_h == pytest.approx(360)


@pytest.mark.parametrize("at_s", [(), (0,), (5, 5)])
def test_without_two_ends_there_is_no_rate(at_s: tuple[float, ...]) -> None:
    assert throughput(ended(*at_s)) is None


def test_failures_of_one_reason_are_one_group() -> None:
    failures = [
        Failure(f"{n}", f"film {n}", f"/films/clip{n}.mp4", code, text.format(n=n))
        for n, (code, text) in enumerate(
            [
                ("tracking_stalled", "Frame {n} took 12.5 s."),
                ("unreadable_video", "clip{n}.mp4 is no MP4."),
                ("unreadable_video", "clip{n}.mp4 is no MP4."),
                ("odd", "Nobody knows."),
                ("rig_video_mismatch", "The video has {n} x 100 px."),
            ]
        )
    ]
    groups = [(group.count, group.reason, group.repair) for group in grouped(failures)]
    assert groups == [
        (2, "The film is no MP4.", "film"),
        (1, "Nobody knows.", None),
        (1, "The video has … x … px.", "rig"),
        (1, "Frame … took … s.", "retry"),
    ]
