"""A mount that is not as its rig says is named: during the tracking, afterwards, in an import."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from builders import PATIENCE_S, Client
from textures import make_rig

from app.lab.simulation import SCENARIOS, simulate
from vo_core.track import metadata_of


def notices(client: Client, inspection_id: str) -> list[dict[str, Any]]:
    corrections = client.get(f"/api/inspections/{inspection_id}/corrections").json()
    return list(corrections["result"]["notices"])


def test_a_tilted_mount_is_named_live_and_afterwards(shared: Client, tmp_path: Path) -> None:
    scenario = replace(
        SCENARIOS["nominal"].shortened(200.0), true_rig=make_rig(mount={"pitch_deg": 3.0}), seed=9
    )
    rig = scenario.rig.model_dump(mode="json")
    inspection_id = shared.inspect(simulate(scenario, tmp_path).video, rig=rig)
    with shared.socket(f"/api/inspections/{inspection_id}/live") as socket:
        header: dict[str, Any] = {"notices": []}
        while not header["notices"]:
            message = socket.recv(PATIENCE_S)
            header = json.loads(message[4 : 4 + int.from_bytes(message[:4], "big")])
            socket.send(json.dumps({"type": "ack", "seq": header["seq"]}))
    assert header["notices"] == ["looks_ahead"]

    assert shared.wait(inspection_id)["status"] == "done"
    found = notices(shared, inspection_id)
    params = {"turned_deg": 3.0, "tolerance_deg": 1.0, "seen_deg": 3.0}
    assert found == [{"code": "looks_ahead", "params": params}]
    file = shared.data / "inspections" / inspection_id / "track.csv"
    assert metadata_of(file.read_text().splitlines())["mount_pitch_deg"].startswith(("2.9", "3.0"))

    report = shared.get(f"/api/inspections/{inspection_id}/exports/json").content
    answer = shared.post("/api/imports", params={"filename": "report.json"}, content=report)
    (imported,) = answer.json()["inspections"]
    assert notices(shared, imported["id"]) == found
