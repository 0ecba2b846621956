"""Joints on pictures of a floor whose rings, cracks and stains are drawn here at known places."""

import tracemalloc

import cv2
import numpy as np
import pytest
from textures import make_rig, texture

from vo_core import Estimate, InvalidTrack, ShapeMismatch, Track
from vo_core.errors import InvalidCorrection
from vo_core.joints.finder import JointFinder
from vo_core.joints.sightings import Sighting, from_csv, numbered, places_mm, to_csv

MM_PER_PX = 0.5
LENGTH_MM, WIDTH_MM = 3000, 260
WIDTH, HEIGHT, FOCAL_PX, CAMERA_MM = 320, 240, 400.0, 200.0
RIG = make_rig(
    camera={"width": WIDTH, "height": HEIGHT, "fx": FOCAL_PX, "fy": FOCAL_PX, "cx": 159.5,
            "cy": 119.5},
    mount={"height_mm": CAMERA_MM},
    pipe={"shape": "flat", "diameter_mm": None},
)  # fmt: skip
WAY_MM = np.arange(100, 2900, 25.0)
"""Where frames are taken."""
DARK_MM, BRIGHT_MM = (400.0, 1100.0, 2500.0), 1800.0


def to_px(mm):
    """Axial place to a column of the floor, or lateral place to a row."""
    return np.asarray(mm) / MM_PER_PX


@pytest.fixture(scope="module")
def plain():
    """A floor without joints; its axis runs along the middle row."""
    return 120 + 8 * texture((int(to_px(WIDTH_MM)), int(to_px(LENGTH_MM))), 5)


@pytest.fixture(scope="module")
def floor(plain):
    """Joints, and what looks a little like them."""
    x_mm = np.arange(plain.shape[1]) * MM_PER_PX
    shade = np.ones_like(plain)
    for at_mm in DARK_MM:
        shade[:, np.abs(x_mm - at_mm) <= 4] *= 0.6
    shade[:, np.abs(x_mm - BRIGHT_MM) <= 7] *= 1.3
    middle = int(to_px(WIDTH_MM / 2))
    slanted = [(int(to_px(700)), 0), (int(to_px(780)), plain.shape[0])]
    cv2.line(shade, *slanted, 0.5, int(to_px(6)))
    not_round = [(int(to_px(1400)), 0), (int(to_px(1400)), middle - int(to_px(15)))]
    cv2.line(shade, *not_round, 0.5, int(to_px(8)))
    cv2.circle(shade, (int(to_px(2100)), middle), int(to_px(25)), 0.5, -1)
    return plain * shade


def shoot(floor, x_mm, y_mm=0.0, yaw_deg=0.0):
    """The picture from a pose: the pinhole camera of `RIG`, with a lamp that lights the middle."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    ahead = (u - 159.5) * CAMERA_MM / FOCAL_PX
    right = (v - 119.5) * CAMERA_MM / FOCAL_PX
    cos, sin = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    column = to_px(x_mm + cos * ahead - sin * right)
    row = to_px(WIDTH_MM / 2 + y_mm + sin * ahead + cos * right)
    seen = cv2.remap(
        floor.astype(np.float32), column.astype(np.float32), row.astype(np.float32),
        cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    lamp = np.exp(-(ahead**2 + right**2) / (2 * 70**2))
    noise = np.random.default_rng(int(10 * abs(x_mm))).normal(0, 2, seen.shape)
    return np.clip(seen * lamp + noise, 0, 255).astype(np.uint8)


def estimate(frame, x_mm, y_mm=0.0, yaw_deg=0.0, sigma_mm=0.0, status="ok"):
    return Estimate(frame, frame / 30, x_mm, y_mm, yaw_deg, x_mm, sigma_mm, 1.0, status, sigma_mm)


def drive(floor, x_mm, rig=RIG, off_mm=0.0, sigma_mm=0.0, status="ok"):
    """Sightings and track of a swaying run; the track is `off_mm` off the truth (an array)."""
    x_mm = np.asarray(x_mm, float)
    off_mm, sigma_mm, status = (np.broadcast_to(v, x_mm.shape) for v in (off_mm, sigma_mm, status))
    finder, estimates = JointFinder(rig), []
    for frame, x in enumerate(x_mm):
        y, yaw = 12 * np.sin(x / 270), 4 * np.sin(x / 190)
        known = sigma_mm[frame], str(status[frame])
        estimates.append(estimate(frame, x + off_mm[frame], y, yaw, *known))
        finder.add(shoot(floor, x, y, yaw), estimates[-1])
    return finder.finish(), Track.from_estimates(estimates)


def test_rings_are_found_to_half_a_millimetre_and_nothing_else(floor):
    sightings, track = drive(floor, WAY_MM)
    expected = sorted([*DARK_MM, BRIGHT_MM])
    assert places_mm(track, sightings) == pytest.approx(expected, abs=0.5)
    assert [s.contrast > 0 for s in sightings] == [at == BRIGHT_MM for at in expected]
    assert all(abs(s.ahead_mm) < 15 for s in sightings)
    assert all(0 < s.sigma_mm < 1 for s in sightings)


def hidden(plain, places_mm, *, from_mm, to_mm):
    """A floor whose joints are covered from one distance beside the axis to another."""
    y_mm = np.abs(np.arange(plain.shape[0]) * MM_PER_PX - WIDTH_MM / 2)
    x_mm = np.arange(plain.shape[1]) * MM_PER_PX
    seen = ~((y_mm >= from_mm) & (y_mm < to_mm))
    shade = np.ones_like(plain)
    for at_mm in places_mm:
        shade[np.outer(seen, np.abs(x_mm - at_mm) <= 4)] = 0.6
    return plain * shade


def test_joints_whose_middle_half_is_hidden_by_silt_are_found(plain):
    silted = hidden(plain, DARK_MM, from_mm=0, to_mm=28)  # the view is 120 mm wide
    sightings, track = drive(silted, WAY_MM)
    off_mm = np.abs(places_mm(track, sightings) - sorted(DARK_MM))
    assert (off_mm < 2).all()
    assert (off_mm < 3 * np.hypot([s.sigma_mm for s in sightings], 0.5)).all()


def test_cracks_that_end_before_the_flanks_are_no_joints(plain):
    cracked = hidden(plain, DARK_MM, from_mm=20, to_mm=WIDTH_MM)
    sightings, _ = drive(cracked, WAY_MM)
    assert sightings == []


def test_a_wall_without_joints_has_none(plain):
    sightings, _ = drive(plain, WAY_MM)
    assert sightings == []


def test_a_wrong_height_does_not_move_a_ring_past_the_camera(floor):
    wrong = RIG.model_copy(
        update={"mount": RIG.mount.model_copy(update={"height_mm": 1.03 * CAMERA_MM})}
    )
    sightings, track = drive(floor, WAY_MM, wrong)
    assert places_mm(track, sightings) == pytest.approx(sorted([*DARK_MM, BRIGHT_MM]), abs=0.7)


def test_half_a_picture_between_frames_is_enough(floor):
    sightings, track = drive(floor, np.arange(100, 2900, 70.0))
    found = places_mm(track, sightings)
    for at_mm in DARK_MM:
        assert np.abs(found - at_mm).min() < 1


def test_there_and_back_a_joint_that_is_seen_twice_is_one(floor):
    x_mm = np.concatenate([WAY_MM, WAY_MM[::-1]])
    drifted = np.repeat([0.0, 5.0], len(WAY_MM))
    sightings, track = drive(floor, x_mm, off_mm=drifted)
    frames, numbers = [s.frame for s in sightings], numbered(track, sightings)
    assert frames == sorted(frames)
    assert set(numbers) == {0, 1, 2, 3}
    assert (numbers[0], numbers[-1]) == (0, 0)
    at_mm = places_mm(track, sightings)
    assert at_mm[-1] - at_mm[0] == pytest.approx(5, abs=0.5)


def test_after_a_loss_rings_are_where_the_track_goes_on(floor):
    off_mm = np.where(WAY_MM > 1110, 40.0, 0.0)  # a joint is in sight while the track jumps
    sigma_mm = np.where(WAY_MM > 1110, 30.0, 0.1)
    status = np.where((WAY_MM > 1110) & (WAY_MM < 1125), "weak", "ok")
    sightings, track = drive(floor, WAY_MM, off_mm=off_mm, sigma_mm=sigma_mm, status=status)
    true_mm = places_mm(track, sightings) - off_mm[[s.frame for s in sightings]]
    rings = np.array([*DARK_MM, BRIGHT_MM])
    # From one side only, under a lamp, a ring is found to a millimetre or two.
    assert np.abs(true_mm[:, None] - rings).min(axis=1).max() < 2
    assert np.abs(true_mm[:, None] - rings).min(axis=0).max() < 2


def test_an_error_that_keeps_its_sign_along_the_way_leaves_the_wall_whole(floor):
    sightings, track = drive(floor, WAY_MM, sigma_mm=0.02 * WAY_MM)
    assert places_mm(track, sightings) == pytest.approx(sorted([*DARK_MM, BRIGHT_MM]), abs=0.5)


def test_frames_without_a_lock_are_left_out(floor):
    finder = JointFinder(RIG)
    wrong = shoot(floor, DARK_MM[0])
    estimates = []
    for frame, x in enumerate(np.arange(500, 1000, 12.5)):
        lost = frame % 2 == 1
        estimates.append(estimate(frame, x, status="lost" if lost else "ok"))
        finder.add(wrong if lost else shoot(floor, x), estimates[-1])
    assert finder.finish() == []


def test_a_picture_of_another_size_is_refused():
    with pytest.raises(ShapeMismatch, match="320x240"):
        JointFinder(RIG).add(np.zeros((100, 100), np.uint8), estimate(0, 0.0))


def test_memory_does_not_grow_with_the_way(plain):
    finder, picture = JointFinder(RIG), shoot(plain, 1000)
    tracemalloc.start()
    held = []
    for frame, x in enumerate(np.arange(0, 20_000, 80.0)):
        finder.add(picture, estimate(frame, x))
        held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    early, late = max(held[50:125]), max(held[-125:])
    assert late < early + 100_000


def test_the_file_reads_back_and_names_joints_and_places():
    track = Track.from_estimates([estimate(n, 100.0 * n) for n in range(4)])
    sightings = [Sighting(1, 20.0, 0.25, -0.5), Sighting(2, -79.0, 0.5, -0.4), Sighting(3, 5, 1, 1)]
    sightings.append(Sighting(3, -900.0, 1.0, 0.7, wave_mm=67.7))
    text = to_csv(track, sightings, {"video": "a.mp4"})
    assert text.splitlines()[:3] == [
        "# video: a.mp4",
        "joint,frame,ahead_mm,sigma_mm,contrast,wave_mm,distance_mm",
        "0,1,20.0000,0.2500,-0.5000,0.0000,120.0000",
    ]
    assert [line[0] for line in text.splitlines()[2:]] == ["0", "0", "1", ","]
    assert from_csv(text) == sightings


def test_a_file_that_is_older_than_crests_is_read():
    older = "joint,frame,ahead_mm,sigma_mm,contrast,distance_mm\n0,1,20.0,0.25,-0.5,120.0\n"
    assert from_csv(older) == [Sighting(1, 20.0, 0.25, -0.5)]


def test_no_joints_are_a_file_with_a_header():
    track = Track.from_estimates([estimate(0, 0.0)])
    assert from_csv(to_csv(track, [])) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("frame,ahead_mm\n1,2\n", "no column contrast, sigma_mm"),
        ("frame,ahead_mm,sigma_mm,contrast\n1,x,1,1\n", "not numbers"),
        ("frame,ahead_mm,sigma_mm,contrast\n1,2\n", "not numbers"),
        ("frame,ahead_mm,sigma_mm,contrast\n1,nan,1,1\n", "not finite"),
    ],
)
def test_a_wrong_file_is_refused(text, said):
    with pytest.raises(InvalidTrack, match=said):
        from_csv(text)


def test_joints_of_another_track_are_refused():
    track = Track.from_estimates([estimate(0, 0.0)])
    with pytest.raises(InvalidCorrection, match="no frame 7"):
        places_mm(track, [Sighting(7, 0.0, 1.0, -0.5)])
