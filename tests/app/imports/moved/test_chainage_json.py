"""A report in JSON, read back: derived values follow from it, and faults are reported in place."""

import json
from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_reports import reports
from reports import AT, health_columns, report, track_of

from app.errors import InvalidImport
from app.imports.moved.chainage_json import is_chainage_json, read
from app.reports.exchange.chainage_json import write
from app.survey.adjustment.adjust import adjust
from app.survey.distances.corrected import Corrected
from app.survey.distances.stated import Joints, Length, Mark, Stated, Zero
from app.survey.observations.records import Event
from vo_core.geometry.initial_pose import InitialPose
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting
from vo_core.rig import Tolerance
from vo_core.track import COLUMNS

STATED = Stated(
    zero=Zero(frame=3, offset_m=0.25),
    lengths=(Length(first_frame=0, last_frame=499, length_m=24.5),),
    joints=Joints(use=False, marked=(Mark(frame=32, pixel=(127.5, 79.5)),)),
)


@pytest.fixture
def exported():
    """A report with everything that an import takes."""
    track = track_of(24.6)
    made = report()
    return replace(
        made,
        source=replace(made.source, video=dict(made.source.video) | {"width": 256, "height": 160}),
        corrected=Corrected(STATED, adjust(track, made.rig, STATED, []), None),
        health=health_columns(
            Health(0.9, 0.3, 0.0, n / 1000, 0.05) for n in range(len(track))
        ),
        sightings=(Sighting(16, 12.5, 1.25, -0.2), Sighting(48, -3.0, 1.5, -0.25)),
        events=(
            Event(inspection_id=made.id, observation_id=made.entries[0].id, action="created",
                  who="Ali", at=AT, before=None, after={"frame": 0}, remark=None),
            Event(inspection_id=made.id, observation_id=None, action="corrected", who="Siti",
                  at=AT + timedelta(hours=1), before={}, after=STATED.to_json(), remark="taped"),
        ),
    )  # fmt: skip


def changed(exported, **parts):
    """The file with other parts."""
    return json.dumps(json.loads(write(exported).content) | parts).encode()


def edited(exported, path, value):
    """The file with another value at a place such as tags.0.fields.code."""
    content = json.loads(write(exported).content)
    *way, last = [int(step) if step.isdigit() else step for step in path.split(".")]
    part = content
    for step in way:
        part = part[step]
    part[last] = value
    return json.dumps(content).encode()


def test_everything_that_was_stated_or_measured_comes_back(exported):
    found = read(write(exported).content)
    about = found.about
    assert (about.id, about.name, about.status) == (exported.id, exported.name, "done")
    assert about.header == exported.header
    assert found.rig == exported.rig
    assert about.source.filename == exported.source.filename
    assert (about.source.size, about.source.sha256) == (123456, "ab" * 32)
    assert about.video.model_dump().items() >= exported.source.video.items()
    assert (about.created_at, about.finished_at) == (AT, AT)
    assert found.stated == STATED
    for name in COLUMNS:
        was, is_now = getattr(exported.raw_track, name), getattr(found.track, name)
        assert (was == is_now).all() if name == "status" else np.allclose(was, is_now, atol=6e-5)
    taken = health_columns(found.health)
    assert all(np.allclose(taken[name], was) for name, was in exported.health.items())
    assert found.sightings == exported.sightings
    assert [tag.stated.to_json() for tag in found.tags] == [
        entry.tag.to_json() for entry in exported.entries
    ]
    assert [(t.id, t.seq, t.created_by, t.created_at, t.edited_at) for t in found.tags] == [
        (e.id, e.seq, e.tagged_by, e.tagged_at, e.edited_at) for e in exported.entries
    ]
    for event, was in zip(found.events, exported.events, strict=True):
        assert (event.at, event.who, event.action) == (was.at, was.who, was.action)
        assert (event.before, event.after, event.remark) == (was.before, was.after, was.remark)
        assert event.observation_id == was.observation_id


def test_an_export_of_before_the_tolerances_is_read(exported):
    content = json.loads(write(exported).content)
    for name in ("sigma_registration_mm", "z_mm", "pitch_deg", "roll_deg", "looking_around"):
        del content["track"]["columns"][name]
    del content["stance"]
    del content["inspection"]["rig"]["tolerance"]
    found = read(json.dumps(content).encode())
    track = found.track
    assert (track.sigma_registration_mm == track.sigma_distance_mm).all()
    assert not np.concatenate([track.z_mm, track.pitch_deg, track.roll_deg]).any()
    assert found.initial_pose == InitialPose()
    assert found.rig.tolerance == Tolerance()
    assert found.stated.joints.use is False


def test_what_follows_from_it_is_the_same(exported):
    found = read(write(exported).content)
    again = adjust(found.track, found.rig, found.stated, found.sightings)
    was = adjust(exported.raw_track, exported.rig, STATED, exported.sightings)
    assert again.track.distance_mm == pytest.approx(was.track.distance_mm, abs=1e-3)
    assert again.scale == pytest.approx(was.scale, abs=1e-9)


def test_parts_that_a_later_writer_adds_are_passed_over(exported):
    assert read(changed(exported, weather={"rain_mm": 3})).about.name == "Culvert 41"


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        ("tags.0.fields.code", "bab", "tags.0.fields.code: String should match"),
        ("tags.2.fields.quant1", "2", "tags.2.fields.quant1: Input should be a valid number"),
        ("tags.0.fields.distance_m", 3.2, "tags.0.fields.distance_m: Extra inputs"),
        ("tags.1.seq", 1, "two tags have the same seq"),
        ("tags.0.fields.pixel", [256.0, 10.0], "tags.0.fields.pixel: (256, 10) is outside"),
        ("tags.0.created_at", "2026-09-14T09:42:00", "tags.0.created_at: must be an instant"),
        ("inspection.rig.camera.fx", 0.5, "camera.fx: Input should be greater than 1"),
        ("inspection.video.width", 100, "the video has 100 x"),
        ("inspection.header.start_lat", 91, "start_lat must be a number"),
        ("inspection.header.material", [1], "inspection.header.material"),
        ("inspection.name", "a\nb", "inspection.name: String should match"),
        ("corrections.stated.lengths.0.length_m", 0, "length_m: Input should be greater than 0"),
        ("corrections.stated.wheel", 1, "corrections.stated.wheel: Extra inputs"),
        ("track.columns.quality.3", 1.5, "track.columns.quality.3: Input should be less"),
        ("track.columns.frame.7", 9, "frames must be 0, 1, 2, ... without a gap"),
        ("track.columns.time_s.7", 99.0, "time_s must not fall"),
        ("track.columns.status", ["ok"], "the same number of rows"),
        ("sightings.0.frame", 500, "sightings.0.frame: the track has no frame 500"),
        ("health.columns.overlap", [0.5], "the same number of rows"),
        ("schema", "chainage-report/1", "version 1, which holds no track"),
        ("schema", "chainage-report/3", "version 3, and this Chainage reads 2"),
        ("schema", "other/2", "no report of Chainage"),
        ("schema", None, "no report of Chainage"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_reported_with_its_place(exported, path, value, sentence):
    with pytest.raises(InvalidImport) as refused:
        read(edited(exported, path, value))
    assert sentence in str(refused.value)
    assert str(refused.value).endswith(".")


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (b'"size": 123456', b'"size": NaN', "NaN is no number"),
        (b'"height_mm": 900', b'"height_mm": 1e999', "1e999 is too large"),
        (b'"height_mm": 900', b'"height_mm": 900, "height_mm": 901', "occurs twice"),
        (b'"tags"', b'"tags', "is not JSON"),
        (b'"Culvert 41"', b'"Culvert \\ud800"', "contains half a character"),
        (b'"Culvert 41"', b'"Culvert \xff"', "is not in UTF-8"),
        (b'"header": {', b'"header": {"n": ' + 5000 * b"9" + b", ", "cannot be read"),
    ],
)
def test_json_that_readers_take_differently_is_refused(exported, old, new, sentence):
    content = write(exported).content
    assert old in content
    with pytest.raises(InvalidImport, match=sentence):
        read(content.replace(old, new, 1))


def test_files_of_other_kinds_are_refused():
    for content in (
        b"",
        b"[]",
        b"{}",
        b"null",
        b"[" * 100_000,
        b"PK\x03\x04",
        b"report_id,seq\r\n",
    ):
        assert not is_chainage_json(content)
        with pytest.raises(InvalidImport):
            read(content)


def test_a_report_is_known_as_one(exported):
    assert is_chainage_json(write(exported).content)


def test_many_faults_are_reported_shortly(exported):
    with pytest.raises(InvalidImport) as refused:
        read(edited(exported, "track.columns.x_mm", ["x"] * 500))
    assert "and 490 more" in str(refused.value)
    assert len(str(refused.value)) < 4000


@given(made=reports())
def test_any_report_is_json_that_states_its_distances(made):
    content = json.loads(write(made).content)
    assert [row["distance_m"] for row in content["observations"]] == [
        entry.distance_m for entry in made.entries
    ]
    assert len(content["track"]["columns"]["frame"]) == len(made.raw_track)
    outcome = outcome_of(write(made).content)
    if isinstance(outcome, str):  # a text that the API takes from nobody
        assert outcome.endswith(".")
    else:
        stated = [entry.tag.to_json() for entry in made.entries]
        assert [tag.stated.to_json() for tag in outcome.tags] == stated


@given(data=st.data())
def test_a_damaged_file_is_refused_in_a_sentence_or_read(data):
    content = bytearray(write(report()).content)
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
    outcome = outcome_of(bytes(content))
    assert not isinstance(outcome, str) or outcome.endswith(".")


def outcome_of(content):
    """The inspection, or the sentence that refuses it."""
    try:
        return read(content)
    except InvalidImport as refused:
        return str(refused)
