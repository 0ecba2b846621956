import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from viewer_client import make_rig

from app.survey.places.spans import is_within
from app.viewer.geometry import (
    Frustum,
    PinHit,
    Section,
    dashed,
    octahedron,
    phi_of_clock,
    plank,
    strip,
    torus,
    tube,
)
from app.viewer.pin import Pin
from app.viewer.pins import along_wall, pin_under
from app.viewer.trail import STEP_MM, Thinner
from app.viewer.views import view_of
from vo_core import Pose, Rig, wall_point

PIPE = Section(radius_m=0.15, half_width_m=0.15)
FLOOR = Section(radius_m=None, half_width_m=0.7)
REACH = (0.0, 6.0)


def make_wide_rig(view: str) -> Rig:
    rig = make_rig(view=view).model_dump(mode="json")
    rig["camera"] |= {"model": "fisheye", "fx": 250.0, "fy": 250.0}
    return Rig.model_validate(rig)


@given(
    x=st.floats(0.1, 5.9),
    clock=st.floats(0.01, 12.0),
    y=st.floats(-0.1, 0.1),
    z=st.floats(-0.1, 0.1),
)
def test_ray_from_inside_hits_the_point_aimed_at(
    x: float, clock: float, y: float, z: float
) -> None:
    phi = phi_of_clock(clock)
    target = np.array([x, 0.15 * np.sin(phi), 0.15 * np.cos(phi)])
    origin = np.array([3.0, y, z])

    hit = PIPE.hit(origin.tolist(), (target - origin).tolist(), REACH)

    assert hit is not None
    assert hit.distance_m == pytest.approx(x, abs=1e-9)
    around = (hit.clock_h - clock + 6) % 12 - 6  # 12 and 0 are one place
    assert around == pytest.approx(0, abs=1e-6)


@given(origin=st.tuples(*[st.floats(-1e6, 1e6)] * 3), direction=st.tuples(*[st.floats(-1, 1)] * 3))
def test_hit_lies_on_the_drawn_wall_whatever_the_ray(origin, direction) -> None:
    for section in (PIPE, FLOOR):
        hit = section.hit(origin, direction, REACH)
        assert hit is None or (is_within(hit.distance_m, REACH) and abs(hit.lateral_m) <= 0.71)


def test_floor_is_hit_from_above_and_missed_beside() -> None:
    hit = FLOOR.hit((1.0, 0.2, -1.0), (0.0, 0.0, 1.0), REACH)
    assert hit is not None
    assert (hit.distance_m, hit.clock_h, hit.lateral_m) == (1.0, None, 0.2)
    assert FLOOR.hit((1.0, 0.9, -1.0), (0.0, 0.0, 1.0), REACH) is None


@pytest.mark.parametrize("shape", ["circular", "flat"])
def test_click_through_the_camera_agrees_with_the_core(shape: str) -> None:
    rig = make_rig(shape=shape)
    truth = wall_point(rig, (500.0, 100.0), Pose(x_mm=1000.0))
    # Down view, no turn: picture right is forward, picture down is the robot's right.
    ray = ((500.0 - 319.5) / 1194, (100.0 - 239.5) / 1194, 1.0)
    camera_z = (0.15 if shape == "circular" else 0.0) - 0.23

    hit = Section.of(rig).hit((1.0, 0.0, camera_z), ray, REACH)

    assert hit is not None
    assert truth is not None
    assert 1000 * hit.distance_m == pytest.approx(truth.distance_mm)
    assert hit.clock_h == (None if shape == "flat" else pytest.approx(truth.clock_h))


@pytest.mark.parametrize(
    ("mesh", "away_from"),
    [
        (tube(0.15, 1.5, inward=True), "axis inverted"),
        (strip(PIPE, -0.4, 0.2)[0], "axis inverted"),
        (tube(0.15, 1.5, inward=False), "axis"),
        (torus(0.15, 0.01), "ring"),
        (octahedron(), "origin"),
    ],
)
def test_front_sides_face_the_right_way(mesh, away_from: str) -> None:
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middles = corners.mean(axis=1)
    outward = middles.copy()
    if away_from != "origin":
        outward[:, 0] = 0
    if away_from == "ring":
        outward = middles - 0.15 * outward / np.linalg.norm(outward, axis=1, keepdims=True)
    facing = np.einsum("ni,ni->n", normals, outward)

    assert (facing < 0).all() if away_from == "axis inverted" else (facing > 0).all()


@pytest.mark.parametrize("floor", [plank(1.0, 0.5), strip(FLOOR, -0.5, 0.3)[0]])
def test_floor_faces_up(floor) -> None:
    corners = floor.vertices[floor.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] < 0).all()


@given(row=st.floats(0, 1), first_clock=st.floats(0.5, 11.5))
def test_picture_lies_where_its_rows_belong(row: float, first_clock: float) -> None:
    """Its rows run to the right along the developed wall, as clock positions fall."""
    arc_from = 0.15 * phi_of_clock(first_clock)
    mesh, uv = strip(PIPE, arc_from, arc_from + 0.3)

    x, y, z = (np.interp(row, uv[:65, 1], mesh.vertices[:65, axis]) for axis in range(3))

    clock = (np.degrees(np.arctan2(y, -z)) / 30) % 12
    expected = (first_clock - 0.3 * row / 0.15 * 6 / np.pi) % 12
    assert x == 0
    assert (clock - expected + 6) % 12 - 6 == pytest.approx(0, abs=0.01)  # corners of 64 sides


@pytest.mark.parametrize(("mesh", "sides"), [(torus(1.0, 0.1), 64), (tube(1, 1, inward=True), 64)])
def test_dashes_leave_their_share_and_as_many_pieces(mesh, sides: int) -> None:
    left = dashed(mesh, sides, dashes=16, share=0.5)
    angles = np.arctan2(*left.vertices[left.faces].mean(axis=1)[:, 1:].T)
    gaps = np.diff(np.unique(angles.round(3)))

    assert len(left.faces) == len(mesh.faces) / 2
    assert (gaps > 1.2 * 2 * np.pi / sides).sum() in (15, 16)


def make_pins(section: Section) -> list[Pin]:
    clocks = (6.0, 3.0, 12.0) if section.radius_m else (None, None, None)
    return [
        Pin(name, x, clock, 0.01, 3, "BAB", lateral_m=y)
        for name, x, clock, y in zip("abc", (1.0, 2.0, 4.0), clocks, (0.0, 0.3, -0.2), strict=True)
    ]


@given(
    section=st.sampled_from([PIPE, FLOOR]),
    number=st.integers(0, 2),
    x=st.floats(0.2, 5.8),
    y=st.floats(-0.05, 0.05),
)
def test_click_on_a_pin_s_head_is_a_click_on_the_pin(
    section: Section, number: int, x: float, y: float
) -> None:
    pins = make_pins(section)
    origin = np.array([x, y, section.axis_z_m])
    pin, reach = pins[number], 0.6 * 0.15
    if section.radius_m is None:
        head = np.array([pin.distance_m, pin.lateral_m, -0.4 * section.scale_m])
    else:
        phi = phi_of_clock(pin.clock)
        head = np.array([pin.distance_m, reach * np.sin(phi), reach * np.cos(phi)])

    hit = pin_under(pins, "inside", section, origin.tolist(), (head - origin).tolist())

    assert hit is not None
    assert hit == PinHit(pin.id) or abs(x - pin.distance_m) > 1  # another may stand in the way


@pytest.mark.parametrize("section", [PIPE, FLOOR])
def test_click_beside_a_pin_is_a_click_on_the_wall(section: Section) -> None:
    pins = make_pins(section)
    origin = (2.0, 0.0, section.axis_z_m)
    for beside in ((1.8, 0.0, 0.1), (2.3, 0.14, 0.0), (2.0, -0.14, 0.02)):
        ray = np.subtract(beside, origin)
        assert pin_under(pins, "inside", section, origin, ray.tolist()) is None
    assert pin_under([], "inside", section, origin, (0.0, 1.0, 0.0)) is None
    assert pin_under(pins, "inside", section, origin, (0.0, 0.0, 0.0)) is None


@pytest.mark.parametrize("view", ["down", "forward"])
@pytest.mark.parametrize("wide", [False, True])
def test_frustum_ends_before_the_wall(view: str, wide: bool) -> None:
    rig = make_wide_rig(view) if wide else make_rig(view=view)
    frustum = Frustum.of(rig)
    half_height = frustum.depth_m * np.tan(frustum.fov_rad / 2)
    corners = np.array(
        [
            [sx * half_height * frustum.aspect, sy * half_height, frustum.depth_m]
            for sx in (-1, 1)
            for sy in (-1, 1)
        ]
    )
    world = corners @ frustum.rotation.T + [0, 0, 0.15 - 0.23]

    assert (np.hypot(world[:, 1], world[:, 2]) < 0.15).all()
    assert frustum.depth_m > 0.02


def test_frustum_has_the_camera_s_field_of_view() -> None:
    frustum = Frustum.of(make_rig())
    assert frustum.fov_rad == pytest.approx(2 * np.arctan(239.5 / 1194))
    assert frustum.aspect == pytest.approx(639 / 479)


@given(
    aspect=st.floats(0.4, 3.0), length=st.floats(0.5, 9.0), section=st.sampled_from([PIPE, FLOOR])
)
def test_overview_shows_the_whole_culvert(aspect: float, length: float, section: Section) -> None:
    view = view_of("overview", section, (0.0, length), 0.0, aspect)
    forward = view.look_at - view.position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, -1.0])
    right /= np.linalg.norm(right)
    half = section.half_width_m
    corners = np.array([[x, y, z] for x in (0, length) for y in (-half, half) for z in (-0.15, 0)])

    sight = corners - view.position
    depth = sight @ forward
    assert (depth > 0).all()
    tan_v = np.tan(view.fov_rad / 2)
    assert (np.abs(sight @ right) <= depth * tan_v * aspect).all()
    assert (np.abs(sight @ np.cross(right, forward)) <= depth * tan_v).all()


def test_overview_of_a_long_culvert_shows_the_robot_and_stands_still() -> None:
    views = [view_of("overview", PIPE, (0.0, 100.0), x, 1.5) for x in np.arange(0, 100, 0.5)]
    for x, view in zip(np.arange(0, 100, 0.5), views, strict=True):
        assert abs(view.look_at[0] - x) < 9
    assert len({tuple(view.position) for view in views}) < 30


def test_standing_robot_adds_nothing_to_its_path() -> None:
    rng = np.random.default_rng(0)
    jitter = rng.uniform(-3, 3, (2, 5000))
    assert len(Thinner().thin(jitter[0], jitter[1], np.ones(5000))) == 1


def test_path_grows_with_the_way() -> None:
    xs = np.arange(0, 5001, 0.5)
    kept = Thinner().thin(xs, np.zeros_like(xs), np.ones_like(xs))
    assert len(kept) == 5000 / STEP_MM + 1


def test_a_measured_line_follows_the_wall_between_its_points() -> None:
    ends = np.array([[1.0, 0.15, 0.0], [1.2, -0.13, 0.075]])  # from 3 o'clock over the invert to 8
    lines = along_wall(PIPE, ends)
    assert np.ptp(np.hypot(*lines[..., 1:].reshape(-1, 2).T)) < 1e-9
    assert (lines[1:, 0] == lines[:-1, 1]).all()
    assert (lines[0, 0, 0], lines[-1, 1, 0]) == (1.0, 1.2)
