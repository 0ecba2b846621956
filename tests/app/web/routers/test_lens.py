"""A camera is measured by an uploaded film of a calibration board."""

from __future__ import annotations

from pathlib import Path

import av
import boards
import pytest
from builders import Client, assert_error

PICTURES = 10
BOARD = {"columns": 9, "rows": 6, "square_mm": boards.SQUARE_MM, "model": "pinhole"}


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two pictures a second of a checkerboard in a careful hand."""
    path = tmp_path_factory.mktemp("board") / "board.mp4"
    studio, board = boards.Studio(boards.PINHOLE), boards.checkerboard()
    with av.open(path, "w") as container:
        stream = container.add_stream("libx264", rate=2, options={"crf": "10"})
        stream.width, stream.height = boards.PINHOLE.width, boards.PINHOLE.height
        stream.pix_fmt = "yuv420p"
        for tilt, place_mm in boards.poses(PICTURES, 330.0, 0.3):
            picture = studio.shoot(board, tilt, place_mm)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="gray")))
        container.mux(stream.encode(None))
    return path


def test_the_focal_length_is_found_and_is_known_to_a_fifth_of_a_percent(
    shared: Client, film: Path
) -> None:
    upload = shared.upload(film.read_bytes(), film.name)
    found = shared.post(f"/api/uploads/{upload}/lens", json=BOARD).json()
    assert found["camera"]["fx"] == pytest.approx(boards.PINHOLE.fx, rel=0.003)
    assert found["camera"]["width"] == boards.PINHOLE.width
    assert 0 < found["focal_percent"] < 0.2
    assert found["pictures"] >= 10
    wrong = BOARD | {"marker_mm": 2 * boards.SQUARE_MM}
    other = shared.post(f"/api/uploads/{upload}/lens", json=wrong)
    assert "markers" in assert_error(other, 422, "invalid_calibration")
