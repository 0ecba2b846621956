"""The measurement of findings: what counts as found and as false, and pictures with masks."""

import cv2
import numpy as np
import pytest

from app.lab.findings import photographs
from app.lab.findings.painting import Truth
from app.lab.findings.scoring import score
from vo_core.findings.finding import Finding

pytestmark = pytest.mark.unit

LINE = np.stack([np.linspace(0, 200, 80), np.full(80, 10.0)], 1)
CRACK = Truth("crack", LINE, 200.0, 2.0)
STAIN = Truth("stain", np.array([[500, 0], [600, 0], [600, 80], [500, 80]], float), 100.0, 80.0)


def finding(kind, outline):
    return Finding(kind, np.asarray(outline, float), None, None, None, 0.5)


def test_a_crack_is_found_if_findings_lie_on_half_of_it():
    for share, is_found in ((0.4, False), (0.6, True)):
        part = finding("crack", LINE[: round(share * 80)] + [0, 3])
        (case,) = score(10.0, [CRACK], [part]).cases
        assert (case.finding is part) == is_found


def test_a_finding_beside_every_defect_is_false_and_a_part_of_one_is_not():
    beside, part = finding("crack", LINE + [0, 30]), finding("crack", LINE[:20])
    assert score(10.0, [CRACK, STAIN], [beside, part]).false == (beside,)


def test_an_area_is_found_by_whatever_lies_in_its_box():
    inside = finding("roots", STAIN.outline_mm * 0.9 + [50, 5])
    assert score(10.0, [STAIN], [inside]).cases[0].finding is inside


def written(folder, name, *, size=128):
    rng = np.random.default_rng(1)
    picture = (130 + 10 * rng.standard_normal((128, 128, 3))).clip(0, 255).astype(np.uint8)
    mask = np.zeros((size, 128), np.uint8)
    for image, value in ((picture, (30, 30, 30)), (mask, 255)):
        cv2.line(image, (15, 20), (115, 95), value, 2)
    cv2.imwrite(str(folder / f"{name}.png"), picture)
    cv2.imwrite(str(folder / f"{name}_mask.png"), mask)


def test_photographs_are_compared_with_their_masks(tmp_path):
    written(tmp_path, "one")
    values = dict(photographs.rows(tmp_path))
    assert list(values) == ["chainage", "frangi", "sato", "meijering"]
    assert values["chainage"][0] > 0.95


@pytest.mark.parametrize("is_empty", [True, False])
def test_a_folder_without_usable_pictures_is_refused_with_the_reason(tmp_path, is_empty):
    if not is_empty:
        written(tmp_path, "one", size=100)
    with pytest.raises(photographs.NoPictures, match="mask"):
        photographs.pictures(tmp_path)
