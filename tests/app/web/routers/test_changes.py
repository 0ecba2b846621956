"""Two walls are compared on request; the earlier one is a ruler; defects are matched on them."""

import json

import cv2
import numpy as np
import pytest
from builders import Client, assert_error, wait_until
from surveys import Survey, another

from app.access.access import create_token
from app.storage.folder.tokens import Role, TokenFile
from vo_core import Rig
from vo_core.mosaic.layout import Layout

pytestmark = pytest.mark.server

TILES = range(-1, 3)
SHIFT_MM = 40.0


@pytest.fixture(scope="module")
def pair(survey: Survey, shared: Client) -> tuple[str, str]:
    """Two copies of the inspection; the wall of the later one begins 40 mm further on."""
    earlier, later = another(survey, shared, name="2024"), another(survey, shared, name="2026")
    paint(shared, earlier, 1)
    paint(shared, later, 1, SHIFT_MM)
    return later, earlier


def paint(client: Client, inspection_id: str, seed: int, shift_mm: float = 0.0) -> None:
    """Give an inspection a wall of its own, as if it had been driven for two metres."""
    folder = client.data / "inspections" / inspection_id
    layout = Layout.of(Rig.parse(json.loads((folder / "rig.json").read_text())))
    rng = np.random.default_rng(seed)
    shape = (layout.height_px, (len(TILES) + 1) * layout.width_px)
    noise = rng.standard_normal(shape).astype(np.float32)
    sigma = 3.0 / layout.mm_per_px
    grey = 118 + 60 * sigma * cv2.GaussianBlur(noise, (0, 0), sigma)
    first = round(shift_mm / layout.mm_per_px)
    (folder / "wall").mkdir(exist_ok=True)
    for number, index in enumerate(TILES):
        tile = grey[:, first + number * layout.width_px :][:, : layout.width_px]
        _, jpeg = cv2.imencode(".jpg", np.clip(tile, 50, 255).astype(np.uint8))
        (folder / "wall" / f"{index}.jpg").write_bytes(
            cv2.imencode(".jpg", cv2.cvtColor(cv2.imdecode(jpeg, 0), cv2.COLOR_GRAY2BGR))[1]
        )


def url(later: str, earlier: str) -> str:
    return f"/api/inspections/{later}/changes/{earlier}"


def compared(client: Client, later: str, earlier: str) -> dict:
    answer = client.post(url(later, earlier))
    assert answer.status_code == 202, answer.text

    def ended() -> dict | None:
        found = client.get(url(later, earlier)).json()
        return found if found["state"] in ("done", "failed") else None

    return wait_until(ended)


def test_the_map_leads_to_the_earlier_wall_and_defects_are_matched_on_it(
    shared: Client, pair: tuple[str, str]
) -> None:
    later, earlier = pair
    assert shared.get(url(later, earlier)).json()["state"] == "none"
    for each, clock in ((earlier, 7), (later, 6)):
        answer = shared.put(
            f"/api/inspections/{each}/observations/{each[:8]}-0000-4000-8000-000000000000",
            json={"frame": 5, "code": "BAB", "clock_from": clock},
        )
        assert answer.status_code == 200, answer.text
    found = compared(shared, later, earlier)
    assert (found["state"], found["direction"], found["gaps"]) == ("done", "same", [])
    assert found["differences"] is None  # nobody has searched the walls
    for point in found["map"]:
        moved_mm = point["earlier_axial_mm"] - point["axial_mm"]
        assert moved_mm == pytest.approx(SHIFT_MM, abs=3 * point["sigma_mm"])
        assert abs(point["arc_mm"]) < 1
        assert point["roll_deg"] is None  # a floor
    (match,) = found["matched"]
    assert match["change"] == "unchanged"
    assert match["offset_m"] == pytest.approx(SHIFT_MM / 1000, abs=0.01)
    assert match["offset_u95_m"] == 0.01


def test_the_earlier_wall_is_a_ruler_that_a_person_applies(
    shared: Client, pair: tuple[str, str]
) -> None:
    later, earlier = pair
    compared(shared, later, earlier)

    def offered() -> dict | None:
        found = shared.get(f"/api/inspections/{later}/ruler").json()
        return found if found["earlier_id"] == earlier else None

    for each, day in ((earlier, "2024-05-01"), (later, "2026-05-01")):
        header = {"asset_id": "CUL-WALL", "date": day}
        assert shared.patch(f"/api/inspections/{each}", json={"header": header}).status_code == 200
    offer = wait_until(offered)
    assert offer["state"] == "done"
    assert offer["zero"]["offset_m"] == pytest.approx(SHIFT_MM / 1000, abs=0.003)
    body = {"earlier_id": earlier, "version": "another", "remark": "by the wall of 2024"}
    assert_error(
        shared.post(f"/api/inspections/{later}/ruler", json=body), 409, "nothing_to_measure_by"
    )
    answer = shared.post(
        f"/api/inspections/{later}/ruler", json=body | {"version": offer["version"]}
    )
    assert answer.status_code == 200, answer.text
    assert answer.json()["stated"]["zero"] == offer["zero"]
    events = shared.get(f"/api/inspections/{later}/events").json()["events"]
    assert events[0]["remark"] == "by the wall of 2024"


def test_a_wall_that_was_painted_anew_is_compared_anew(
    shared: Client, pair: tuple[str, str]
) -> None:
    later, earlier = pair
    compared(shared, later, earlier)
    paint(shared, later, 2)

    def unlike() -> bool:
        return shared.get(url(later, earlier)).json()["code"] == "not_recognised"

    wait_until(unlike)
    assert shared.get(url(later, earlier)).json()["map"] == []
    paint(shared, later, 1, SHIFT_MM)


def test_what_cannot_be_compared_is_refused_in_words(
    shared: Client, survey: Survey, done: str, pair: tuple[str, str]
) -> None:
    _, earlier = pair
    assert_error(shared.post(url(earlier, earlier)), 422, "invalid_request")
    assert_error(shared.get(url(earlier, "0" * 32)), 404, "inspection_not_found")
    assert_error(shared.delete(url(done, earlier)), 409, "not_running")
    wide = json.loads((shared.data / "inspections" / done / "rig.json").read_text())
    wide["pipe"] |= {"shape": "circular", "diameter_mm": 900.0}
    other = another(survey, shared, rig=wide)
    found = compared(shared, other, earlier)
    assert (found["state"], found["code"]) == ("failed", "other_pipe")
    assert "different pipes" in found["detail"]
    bare = another(survey, shared)
    for tile in (shared.data / "inspections" / bare / "wall").iterdir():
        tile.unlink()
    assert compared(shared, bare, earlier)["code"] == "no_wall"
    assert shared.delete(f"/api/inspections/{bare}").status_code == 204
    assert_error(shared.get(url(bare, earlier)), 404, "inspection_not_found")


def test_a_token_of_one_project_cannot_compare_with_another_project(
    shared: Client, survey: Survey, pair: tuple[str, str]
) -> None:
    own = another(survey, shared, header={"asset_id": "O-1", "project": "Ost"})
    token = create_token(TokenFile(shared.data), "ost", Role.OPERATOR, frozenset({"Ost"}))
    limited = {"Authorization": f"Bearer {token}"}
    for method in ("GET", "POST", "DELETE"):
        answer = shared.request(method, url(own, pair[1]), headers=limited)
        assert_error(answer, 404, "inspection_not_found")
        answer = shared.request(method, url(pair[0], own), headers=limited)
        assert_error(answer, 404, "inspection_not_found")
