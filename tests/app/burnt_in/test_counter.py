"""The counter of rendered films is found and read as it is shown, and nothing else is."""

import numpy as np
import pytest
from counter_films import GREEN, CounterFilm, Text, write
from measure.counter import compared

from app.burnt_in.box import Box
from app.burnt_in.counter import burnt_in, read_counter

AT = (60, 400)
SHORT = {"frames": 15, "speed": 0.9, "rate_hz": 10}


@pytest.fixture
def reading(tmp_path):
    """Readings of a film, and how they compare with its truth."""

    def read(film, within=None):
        path = tmp_path / "film.mp4"
        truth = write(film, path)
        readings = read_counter(path, burnt_in(path, within).place)
        return readings, compared(readings, truth, film.step)

    return read


@pytest.mark.parametrize(
    ("film", "unit"),
    [
        pytest.param(
            CounterFilm(**SHORT, font="segments", height_px=26, colour=GREEN, backing="box"),
            "m",
            marks=pytest.mark.long,
        ),
        pytest.param(
            CounterFilm(
                **SHORT, font="dots", backing="box", height_px=14, is_interlaced=True, crf=30,
                counter=Text("DIST: {value:.1f} FT", AT),
            ),
            "ft",
            marks=pytest.mark.long,
        ),
        pytest.param(
            CounterFilm(
                frames=30, speed=0.12, step=0.01, font="mono", height_px=12, wall=170,
                counter=Text("{value:+.2f}m", AT),
            ),
            "m",
            marks=pytest.mark.long,
        ),
    ],
    ids=["segments", "interlaced feet", "signed metres"],
)  # fmt: skip
def test_a_counter_is_found_and_read(reading, film, unit):
    readings, found = reading(film)
    assert readings.place is not None
    assert readings.place.unit == unit
    assert found.wrong == 0
    assert found.right + found.near >= 0.95 * found.legible


def test_every_frame_has_a_row_before_the_counter_appears_and_after_it_is_reset(reading):
    readings, found = reading(
        CounterFilm(
            frames=30, speed=0.9, hidden=((0, 9),), jumps=((20, 0.0),),
            counter=Text("{value:06.1f}", AT),
        )
    )  # fmt: skip
    assert found.wrong == 0
    assert found.right + found.near >= 0.95 * found.legible
    assert np.isnan(readings.reading[:9]).all()
    assert not np.isnan(readings.reading[10:]).any()
    assert readings.reading[19] > 12
    assert readings.reading[-1] < 3
    header, *rows = readings.to_csv().splitlines()
    assert header == "frame,time_s,reading,unit,confidence"
    assert len(rows) == 30
    assert rows[0] == "0,0.000000,,,0.000"
    frame, time_s, value, unit, confidence = rows[15].split(",")
    assert (frame, time_s, unit) == ("15", "1.500000", "")
    assert value == f"{readings.reading[15]:.1f}"
    assert 0.6 <= float(confidence) <= 1


def test_a_date_a_clock_and_a_diameter_are_no_counter(reading):
    others = (Text("17.05.2019", (60, 30)), Text("{clock}", (420, 30)), Text("DN 0.30 m", AT))
    readings, found = reading(CounterFilm(frames=12, counter=None, others=others))
    assert readings.place is None
    assert found.answers == ()


def test_a_box_may_hold_other_lines_too(reading):
    film = CounterFilm(
        **SHORT, others=(Text("228", (60, 340)), Text("221", (60, 370)), Text("{clock}", (60, 30)))
    )
    readings, found = reading(film, Box(40, 330, 340, 450))
    assert found.right + found.near >= 0.95 * found.legible
    assert found.wrong == 0
    assert 395 < readings.place.box.top < 415


def test_in_a_stated_box_the_counter_may_count_whole_feet(reading):
    film = CounterFilm(frames=15, start=40, step=1, speed=2.2, counter=Text("{value:04.0f}", AT))
    _, found = reading(film, Box(50, 390, 200, 440))
    assert found.right + found.near >= 0.95 * found.legible
