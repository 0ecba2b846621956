"""Cameras from the files of other tools, in the form in which those tools write them."""

import cv2
import numpy as np
import pytest
from textures import make_rig

from app.lab.calibration.intrinsics import read_camera
from vo_core import Camera, InvalidRig

ROS = """\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [438.78337, 0, 305.59334, 0, 437.30288, 243.73835, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 1e-05, 0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [393.65332, 0, 322.79794, 0, 0, 393.65332, 241.09067, 0, 0, 0, 1, 0]
"""

KALIBR = """\
cam0:
  T_cam_imu:
  - [0.01486, -0.99988, 0.00414, -0.02164]
  - [0.99955, 0.01496, 0.02571, -0.06467]
  - [-0.02577, 0.00375, 0.99966, 0.00981]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  camera_model: omni
  rostopic: /cam1/image_raw
"""

# What OpenCV 4's calibration tutorial leaves behind.
OPENCV = """\
%YAML:1.0
---
calibration_time: "Tue Jan 15 09:17:46 2019"
nr_of_frames: 16
image_width: 800
image_height: 600
board_width: 11
board_height: 8
square_size: 50.
fix_aspect_ratio: 1.
# flags:  +fix_aspectRatio +fix_principal_point +zero_tangent_dist
flags: 14
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.0767982411594704e+02, 2.5000000000000000e-01,
       3.9460065635631986e+02, 0., 5.0767396437527020e+02,
       3.0296756610297643e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -4.0586834094104890e-01, 2.1789156170862639e-01,
       6.6262249711316105e-04, 7.9537429812495957e-04,
       -7.2256507609112244e-02 ]
avg_reprojection_error: 1.3329975452043663e-01
"""


@pytest.fixture
def read(tmp_path):
    def read_text(text, name="camera.yaml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return read_camera(path)

    return read_text


def file_storage(form, **values):
    """As this OpenCV writes it."""
    storage = cv2.FileStorage(form, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    for name, value in values.items():
        storage.write(name, value)
    return storage.releaseAndGetString()


def test_ros_plumb_bob_is_pinhole(read):
    assert read(ROS) == Camera(
        model="pinhole", width=640, height=480,
        fx=438.78337, fy=437.30288, cx=305.59334, cy=243.73835,
        distortion=[-0.361976, 0.110510, 0.001014, 1e-05, 0.0],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("model", "coefficients", "expected"),
    [
        ("rational_polynomial", [1.2, 0.3, 0.0, 0.0, 0.01, 1.6, 0.5, 0.05], "pinhole"),
        ("equidistant", [-0.01, 0.02, -0.03, 0.01], "fisheye"),
        ("fisheye", [-0.01, 0.02, -0.03, 0.01], "fisheye"),
    ],
)
def test_other_models_of_ros(read, model, coefficients, expected):
    text = ROS.replace("plumb_bob", model).replace("cols: 5", f"cols: {len(coefficients)}")
    camera = read(text.replace("[-0.361976, 0.110510, 0.001014, 1e-05, 0]", str(coefficients)))
    assert (camera.model, camera.distortion) == (expected, coefficients)


def test_ros_message_as_it_is_echoed(read):
    camera = read(
        "header: {frame_id: camera}\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\n"
        "d: [-0.3, 0.1, 0.0, 0.0, 0.0]\nk: [400.0, 0.0, 320.0, 0.0, 401.0, 240.0, 0.0, 0.0, 1.0]\n"
    )
    assert (camera.width, camera.fx, camera.fy, camera.cy) == (640, 400.0, 401.0, 240.0)


def test_kalibr_radtan_is_pinhole_and_the_first_camera_counts(read):
    assert read(KALIBR) == Camera(
        model="pinhole", width=752, height=480,
        fx=458.654, fy=457.296, cx=367.215, cy=248.375,
        distortion=[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05],
    )  # fmt: skip


def test_kalibr_equidistant_is_fisheye(read):
    assert read(KALIBR.replace("radtan", "equidistant")).model == "fisheye"


def test_kalibr_with_the_first_line_of_opencv(read):
    assert read("%YAML:1.0\n\n" + KALIBR) == read(KALIBR)


def test_opencv_yaml_of_version_4_with_skew(read):
    assert read(OPENCV) == Camera(
        model="pinhole", width=800, height=600, skew=0.25,
        fx=507.67982411594704, fy=507.6739643752702, cx=394.60065635631986, cy=302.96756610297643,
        distortion=[-0.4058683409410489, 0.2178915617086264, 0.000662622497113161,
                    0.0007953742981249596, -0.07225650760911224],
    )  # fmt: skip


@pytest.mark.parametrize("form", [".yml", ".xml", ".json"])
def test_every_form_that_this_opencv_writes(read, form):
    text = file_storage(
        form,
        image_width=640,
        image_height=480,
        fisheye_model=1,
        camera_matrix=np.array([[300.5, 0.25, 319.5], [0, 301.5, 239.5], [0, 0, 1]]),
        distortion_coefficients=np.array([[-0.01], [0.02], [-0.03], [1e-5]]),
    )
    assert read(text, f"camera{form}") == Camera(
        model="fisheye", width=640, height=480,
        fx=300.5, fy=301.5, cx=319.5, cy=239.5, skew=0.25, distortion=[-0.01, 0.02, -0.03, 1e-5],
    )  # fmt: skip


def test_file_of_the_interactive_calibration(read):
    text = """\
<?xml version="1.0"?>
<opencv_storage>
<calibrationDate>"Mon Mar  1 15:13:22 2021"</calibrationDate>
<framesCount>20</framesCount>
<cameraResolution>
  1280 720</cameraResolution>
<cameraMatrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    9.0e+02 0. 6.4e+02 0. 9.0e+02 3.6e+02 0. 0. 1.</data></cameraMatrix>
<dist_coeffs type_id="opencv-matrix">
  <rows>1</rows>
  <cols>5</cols>
  <dt>d</dt>
  <data>
    1.3e-01 -4.0e-01 0. 0. 0.</data></dist_coeffs>
</opencv_storage>
"""
    assert read(text, "camera.xml") == Camera(
        model="pinhole", width=1280, height=720,
        fx=900.0, fy=900.0, cx=640.0, cy=360.0, distortion=[0.13, -0.4, 0.0, 0.0, 0.0],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ["ROS", "Kalibr", "OpenCV"]),
        ("some words", ["ROS", "Kalibr", "OpenCV"]),
        ("a: [1", ["not YAML, XML or JSON"]),
        ('{"a": ', ["not YAML, XML or JSON"]),
        ("<html></html>", ["not YAML, XML or JSON"]),
        (ROS.replace("camera_matrix", "matrix"), ["camera_matrix is missing", "cameraMatrix, K"]),
        (ROS.replace("image_width", "breadth"), ["image_width is missing", "width"]),
        (ROS.replace("distortion_coefficients", "lens"), ["distortion_coefficients is missing"]),
        (ROS.replace("plumb_bob", "thin_prism"), ["'thin_prism'", "plumb_bob", "equidistant"]),
        (ROS.replace("438.78337, 0, ", ""), ["camera_matrix must be a matrix", "'rows': 3"]),
        ("K: [400, 400, 320, 240]", ["camera_matrix must hold 9 numbers, but has 4"]),
        (ROS.replace("438.78337", "wide"), ["camera_matrix must be a matrix of numbers", "wide"]),
        (ROS.replace("438.78337", "0"), ["fx", "greater than 1"]),
        (ROS.replace("438.78337", ".nan"), ["fx", "finite"]),
        (ROS.replace("width: 640", "width: 640.5"), ["width", "integer"]),
        (ROS.replace("-0.361976, ", ""), ["distortion_coefficients must be a matrix"]),
        (KALIBR.replace("model: pinhole", "model: ds"), ["camera_model is 'ds'", "pinhole"]),
        (KALIBR.replace("radtan", "fov"), ["distortion_model is 'fov'", "radtan"]),
        (KALIBR.replace("resolution", "size"), ["resolution is missing"]),
    ],
)
def test_an_unusable_file_is_explained(read, text, said):
    with pytest.raises(InvalidRig) as error:
        read(text)
    for words in ("camera.yaml", *said):
        assert words in str(error.value)


def test_a_missing_file_is_said_to_be_missing(tmp_path):
    with pytest.raises(InvalidRig, match=r"none\.yaml cannot be read: No such file"):
        read_camera(tmp_path / "none.yaml")


def test_the_camera_part_of_a_rig_is_read(tmp_path):
    camera = make_rig(camera={"distortion": [0.1, -0.05, 0.0, 0.0]}).camera
    path = tmp_path / "camera.json"
    path.write_text(camera.model_dump_json())
    assert read_camera(path) == camera
