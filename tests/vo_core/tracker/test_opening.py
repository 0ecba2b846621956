"""The first frames of a film: which are kept, and until when."""

import numpy as np

from vo_core.tracker.opening import Opening

IMAGE = np.zeros((48, 64), np.uint8)


def test_the_first_frames_are_kept_apart_from_the_callers_pictures():
    opening, image = Opening(), IMAGE.copy()
    opening.keep(image, 0.5)
    image[:] = 9
    ((kept, t_s),) = opening.frames
    assert (kept.max(), t_s) == (0, 0.5)


def test_a_closed_opening_keeps_nothing_more():
    opening = Opening()
    opening.keep(IMAGE, 0.0)
    opening.close()
    opening.keep(IMAGE, 0.1)
    assert opening.frames == ()


def test_an_opening_ends_by_itself_after_some_seconds_or_with_large_pictures():
    long, large = Opening(), Opening()
    for n in range(200):
        long.keep(IMAGE, n / 30)
        large.keep(np.zeros((3000, 4000), np.uint8), n / 30)
    assert (len(long), len(large)) == (0, 0)


def test_only_the_second_frame_shows_a_slow_film():
    opening = Opening()
    assert not opening.is_slow(0.0)
    opening.keep(IMAGE, 0.0)
    assert opening.is_slow(0.5)
    assert not opening.is_slow(0.04)
    opening.keep(IMAGE, 0.5)
    assert not opening.is_slow(9.0)
