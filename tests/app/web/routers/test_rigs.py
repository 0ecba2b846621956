"""The library of rigs: kept by name, used by inspections, renamed, deleted and put back."""

from __future__ import annotations

from builders import Client, assert_error, clip_rig

RIG = "/api/rigs/11111111-2222-4333-8444-555555555555"
OTHER = "/api/rigs/21111111-2222-4333-8444-555555555555"


def test_a_rig_is_kept_renamed_deleted_and_put_back(shared: Client) -> None:
    kept = {"name": "Crawler 2", "rig": clip_rig()}
    assert shared.put(RIG, json=kept).status_code == 204
    (found,) = shared.get("/api/rigs").json()["rigs"]
    assert (found["name"], found["rig"], found["used_by"]) == ("Crawler 2", clip_rig(), [])
    assert_error(shared.put(OTHER, json=kept), 409, "rig_name_taken")
    broken = kept | {"name": "Broken", "rig": clip_rig() | {"pipe": {"shape": "circular"}}}
    assert "diameter_mm" in assert_error(shared.put(OTHER, json=broken), 422, "invalid_rig")
    assert shared.put(RIG, json=kept | {"name": "Crawler 3"}).status_code == 204
    assert [rig["name"] for rig in shared.get("/api/rigs").json()["rigs"]] == ["Crawler 3"]
    assert shared.delete(RIG).status_code == 204
    assert shared.get("/api/rigs").json()["rigs"] == []
    assert_error(shared.delete(RIG), 404, "rig_not_found")
    assert shared.put(RIG, json=kept).status_code == 204
    assert shared.delete(RIG).status_code == 204


def test_it_says_which_inspections_use_it(shared: Client, own: str) -> None:
    shared.put(OTHER, json={"name": "Sled", "rig": clip_rig()})
    shared.patch(f"/api/inspections/{own}", json={"header": {"rig_id": "Sled"}})
    (sled,) = shared.get("/api/rigs").json()["rigs"]
    assert [user["id"] for user in sled["used_by"]] == [own]
    assert shared.delete(OTHER).status_code == 204
