"""Rigs found again from rendered films of a pipe, and films from which none may be made."""

from __future__ import annotations

from dataclasses import replace

import av
import numpy as np
import pytest
from tracks import look, straight_track

from app.lab.film_rig.calibrate import KnownPipe, UnusableFilm, calibrate_film, with_lengths
from app.lab.film_rig.report import plot
from app.lab.film_rig.scale import factors_of
from app.lab.simulation import SCENARIOS, simulate
from app.lab.simulation.scenario import Shaking
from vo_core.rig import Rig

PIPE = KnownPipe(300.0)
SIZE_WH = (320, 240)


def rig_with(camera=None, mount=None):
    """The forward camera of the scenarios in a smaller picture, changed."""
    fields = SCENARIOS["forward"].rig.model_dump(exclude={"tolerance"})
    fields["camera"] |= {
        "width": 320, "height": 240, "fx": 200.0, "fy": 200.0, "cx": 159.5, "cy": 119.5
    }  # fmt: skip
    fields["camera"] |= camera or {}
    fields["mount"] |= mount or {}
    return Rig.parse(fields)


def wandering(name, rig):
    """A camera that yaws and nods by some degrees, so that perspective shows the focal length."""
    return replace(
        SCENARIOS["forward"],
        name=name,
        rig=rig,
        length_mm=350.0,
        crf=14,
        shaking=Shaking(y_mm=4.0, z_mm=4.0, yaw_deg=8.0, pitch_deg=7.0, frequencies_hz=(0.5, 1.1)),
    )


def quiet(what, done, total):
    """Show no progress."""


@pytest.fixture(scope="module")
def crooked(tmp_path_factory):
    """A lens with distortion, off the axis and tilted, and the rig found in its film."""
    true = rig_with(
        {"fx": 230.0, "fy": 230.0, "cx": 162.0, "cy": 117.0, "distortion": [-0.08, 0, 0, 0]},
        {"lateral_mm": 12.0, "height_mm": 134.0, "pitch_deg": 6.0},
    )
    run = simulate(wandering("crooked", true), tmp_path_factory.mktemp("crooked"))
    return true, run, calibrate_film(run.video, PIPE, quiet)


def test_the_lens_is_found_from_a_wandering_film(crooked):
    true, _, found = crooked
    camera, sigma = found.rig.camera, found.sigma
    assert camera.model == "pinhole"
    assert camera.fx == pytest.approx(true.camera.fx, rel=0.05)
    # Within what it states itself, three standard deviations of each.
    off = np.array(
        [
            np.log(camera.fx / true.camera.fx),
            camera.distortion[0] - true.camera.distortion[0],
            camera.cx - true.camera.cx,
            camera.cy - true.camera.cy,
            np.log(camera.fy / camera.fx),
        ]
    )
    assert (np.abs(off) < 3 * sigma).all(), off / sigma
    assert found.rig.tolerance.focal_percent == pytest.approx(100 * sigma[0], abs=0.001)


def test_axis_and_offset_are_found(crooked):
    true, _, found = crooked
    mount, tolerance = found.rig.mount, found.rig.tolerance
    # The camera wanders by 4 mm and 8 degrees about the mount's pose.
    assert abs(mount.height_mm - true.mount.height_mm) < 5 + 3 * tolerance.height_mm
    assert abs(mount.lateral_mm - true.mount.lateral_mm) < 10
    assert abs(mount.pitch_deg - true.mount.pitch_deg) < 7 + 3 * tolerance.tilt_deg
    assert mount.view == "forward"
    assert tolerance.diameter_mm == 3.0


def test_report_shows_the_grid(crooked, tmp_path):
    _, _, found = crooked
    plot(found, tmp_path / "grid.png")
    assert (tmp_path / "grid.png").read_bytes().startswith(b"\x89PNG")


JOINTS_MM, LENGTH_MM = 200.0, 600.0


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """A camera that drives straight on the axis, past joints 200 mm apart, and its rig.

    The film shows nothing of the focal length.
    """
    rig = rig_with()
    rig = rig.model_copy(
        update={"pipe": rig.pipe.model_copy(update={"segment_length_mm": JOINTS_MM})}
    )
    scenario = replace(
        SCENARIOS["forward"],
        rig=rig,
        length_mm=LENGTH_MM,
        speed_mm_s=600.0,
        acceleration_mm_s2=1200.0,
        crf=14,
        sway_mm=0.0,
        yaw_deg=0.0,
    )
    video = simulate(scenario, tmp_path_factory.mktemp("straight")).video
    return video, calibrate_film(video, PIPE, quiet)


def test_a_straight_drive_asks_for_a_length(straight):
    _, found = straight
    assert found.focal_percent > 5
    assert any("state the inspected length" in sentence for sentence in found.findings())
    assert abs(np.log(found.rig.camera.fx / 200)) < 3 * found.sigma[0]


@pytest.mark.parametrize(
    ("lengths", "source"),
    [
        ({"length_mm": LENGTH_MM}, "the inspected length"),
        ({"length_mm": LENGTH_MM, "segment_mm": JOINTS_MM}, "the inspected length and 3 joints"),
    ],
    ids=["length", "length and joints"],
)
def test_a_known_length_gives_the_focal_length(straight, lengths, source):
    video, rough = straight
    found = with_lengths(rough, video, replace(PIPE, **lengths), quiet)
    # A length counts 0.5 %, and a segment 5 mm; the rest is registration.
    assert found.rig.camera.fx == pytest.approx(200, rel=0.02)
    assert found.focal_percent < 3 < rough.focal_percent
    assert [factor.source for factor in found.factors] == [source]


def test_a_length_that_the_film_excludes_is_left_out_with_a_sentence(straight):
    video, rough = straight
    found = with_lengths(rough, video, replace(PIPE, length_mm=4500.0), quiet)
    assert any("it is not used; check the length" in said for said in found.findings())
    assert found.rig == rough.rig


@pytest.mark.parametrize(
    ("length_mm", "segment_mm", "sources", "doubt"),
    [
        (8800.0, None, ["the inspected length"], None),
        (12000.0, None, ["the inspected length"], "it is used all the same; check the length"),
        (14000.0, None, [], "it is not used; check the length"),
        (None, 1650.0, ["5 joints"], None),
        (8800.0, 1650.0, ["the inspected length and 5 joints"], None),
        (None, 860.0, ["3 joints"], "only one joint in 3 was seen"),
        (8800.0, 1300.0, ["the inspected length"], "the joints are not used"),
    ],
)
def test_lengths_are_compared_with_the_film_and_with_each_other(
    length_mm, segment_mm, sources, doubt
):
    """The film alone says 15 %; it shows 8 m and joints 1.5 m apart, in truth 10 % more."""
    rig = rig_with()
    rig = rig.model_copy(
        update={
            "pipe": rig.pipe.model_copy(update={"segment_length_mm": segment_mm}),
            "tolerance": rig.tolerance.model_copy(update={"focal_percent": 15.0}),
        }
    )
    track = straight_track(np.linspace(0.0, 8000.0, 801), np.full(801, 5.0))
    sightings = look(track, [1003.0 + 1500.0 * n for n in range(5)])
    said = factors_of(track, sightings, rig, length_mm)
    assert [factor.source for factor in said.found] == sources
    assert [doubt in sentence for sentence in said.doubts] == ([] if doubt is None else [True])
    if doubt is None:
        assert said.found[0].value == pytest.approx(1.1, abs=3 * said.found[0].sigma)
        assert said.found[0].sigma < 0.02


def write_film(file, pictures):
    with av.open(str(file), "w") as container:
        stream = container.add_stream("libx264", rate=30, options={"crf": "14"})
        stream.width, stream.height = SIZE_WH
        stream.pix_fmt = "yuv420p"
        for grey in pictures:
            planes = np.full((SIZE_WH[1] * 3 // 2, SIZE_WH[0]), 128, np.uint8)
            planes[: SIZE_WH[1]] = grey
            container.mux(stream.encode(av.VideoFrame.from_ndarray(planes, format="yuv420p")))
        container.mux(stream.encode(None))
    return file


NOISE = np.random.default_rng(3).integers(40, 200, SIZE_WH[::-1], np.uint8)


@pytest.mark.parametrize(
    ("pictures", "reason"),
    [
        ([NOISE] * 40, "stands"),
        ([np.full_like(NOISE, 90)] * 40, "too little texture"),
        ([NOISE] * 3, "too short"),
        ([np.roll(NOISE, 5 * n, axis=1) for n in range(20)], "does not show the wall of a pipe"),
    ],
    ids=["standing", "grey", "short", "sideways"],
)
def test_films_that_show_no_drive_are_refused_with_the_reason(tmp_path, pictures, reason):
    with pytest.raises(UnusableFilm, match=reason):
        calibrate_film(write_film(tmp_path / "film.mp4", pictures), PIPE, quiet)
