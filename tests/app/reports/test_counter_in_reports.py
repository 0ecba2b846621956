"""The burnt-in counter on the page of the measurement, in the page for browsers, and as data."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import numpy as np
import pypdfium2
import pytest
from reports import report

from app.burnt_in.box import Box
from app.burnt_in.comparison import with_track
from app.burnt_in.counter import CounterReadings
from app.burnt_in.finder import CounterPlace
from app.inspections.counters import CounterView
from app.reports import pdf
from app.reports.content.measurement import correction_rows
from app.reports.content.translator import Translator
from app.reports.exchange import chainage_json
from app.reports.html import web_page
from app.reports.report import Report
from app.survey.adjustment.adjust import adjust
from app.survey.distances.corrected import Corrected
from app.survey.distances.stated import Stated, Typed
from app.tracking.pictures.counter_files import KeptCounter

SCALE = 0.98
STUCK = slice(200, 240)
RESET_AT = 400


@pytest.fixture(scope="module")
def made() -> Report:
    """Counts in feet, 2 % too little; sticks once, and is set to 0 once; two readings miss."""
    plain = report()
    track = plain.raw_track
    steps = SCALE * np.diff(track.distance_mm, prepend=0.0) / 304.8
    steps[STUCK] = 0
    feet = np.cumsum(steps)
    feet[RESET_AT:] -= feet[RESET_AT]
    feet[[10, 11]] = np.nan
    place = CounterPlace(Box(20, 20, 120, 40), 1, "ft", has_fields=False)
    readings = CounterReadings(
        track.time_s, np.round(feet, 1), np.ones(len(feet)), place, problem=None
    )
    kept = KeptCounter("read", place=place)
    found = with_track(readings, track)
    return replace(plain, counter=CounterView("read", kept, readings, "ft", found, "1"))


def text_of(content: bytes) -> str:
    with pypdfium2.PdfDocument(io.BytesIO(content)) as document:
        pages = [page.get_textpage().get_text_range() for page in document]
    return " ".join(" ".join(pages).split())


@pytest.mark.parametrize("write", [pdf.write, web_page.write])
def test_length_and_faults_of_the_counter_are_told(made: Report, write) -> None:
    content = write(made).content
    text = text_of(content) if content.startswith(b"%PDF") else content.decode()
    assert "Burnt-in counter" in text
    assert f"{len(made.track) - 2} of {len(made.track)} frames are legible" in text
    assert f"scale {made.counter.comparison.scale:.3f} ±" in text
    stuck, reset = made.counter.comparison.faults
    first_m, last_m = (
        made.track.distance_mm[frame] / 1000 for frame in (stuck.first_frame, stuck.last_frame)
    )
    assert f"2: stuck from {first_m:.2f} m to {last_m:.2f} m (it counted 0.0" in text
    where_m = made.track.distance_mm[reset.last_frame] / 1000
    assert f"set to another value at {where_m:.2f} m, by -" in text


def test_what_a_person_typed_is_not_said_to_be_the_cameras() -> None:
    plain = report()
    last = len(plain.raw_track) - 1
    stated = Stated(typed=(Typed(frame=0, distance_m=2.0), Typed(frame=last, distance_m=7.0)))
    t = Translator("en", "m")
    adjusted = adjust(plain.raw_track, plain.rig, stated, [])
    rows = dict(correction_rows(replace(plain, corrected=Corrected(stated, adjusted, None)), t))
    assert rows["Zero"] == "that of the typed distances"
    assert "Scale" not in rows


def test_the_json_report_has_them_as_data(made: Report) -> None:
    counter = json.loads(chainage_json.write(made).content)["counter"]
    assert (counter["unit"], counter["legible_frames"]) == ("ft", len(made.track) - 2)
    compared = counter["comparison"]
    assert compared["scale"] == pytest.approx(SCALE, abs=2 * compared["scale_sigma"])
    assert [fault["kind"] for fault in compared["faults"]] == ["stuck", "reset"]


def test_a_counter_without_a_unit_is_not_compared(made: Report) -> None:
    readings = replace(made.counter.readings, place=replace(made.counter.readings.place, unit=""))
    counter = replace(made.counter, readings=readings, unit=None, comparison=None)
    text = text_of(pdf.write(replace(made, counter=counter)).content)
    assert "The film shows no unit and nobody has stated it" in text
    assert "Counter and camera" not in text


def test_a_film_without_a_counter_has_no_such_part() -> None:
    plain = report()
    assert "Burnt-in counter" not in text_of(pdf.write(plain).content)
    assert json.loads(chainage_json.write(plain).content)["counter"] is None
