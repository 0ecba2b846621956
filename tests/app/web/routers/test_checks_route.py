"""The checks look at an inspection as it stands: header, tags, photos, pictures, corrections."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import av
import numpy as np
from builders import Client, wait_until

TAG = "7d444840-9dc0-4d2a-8a6a-000000000001"


def checks(client: Client, run: str) -> list[dict[str, Any]]:
    answer = client.get(f"/api/inspections/{run}/checks").raise_for_status()
    return list(answer.json()["checks"])


def films(client: Client, problem: str) -> list[dict[str, Any]]:
    """Films of all inspections with a problem, once the search knows them."""
    answer = client.get("/api/archive/quality", params={"problem": problem}).raise_for_status()
    return list(answer.json()["films"])


def test_lost_and_dark_frames_a_lost_photo_and_a_zero_are_checked(
    shared: Client, clip: Path, tmp_path: Path
) -> None:
    dark = with_dark_frames(clip, tmp_path / "dark.mp4", range(10, 20))
    inspection_id = shared.inspect(dark, header={"asset_id": "CUL-1"})
    shared.wait(inspection_id)
    shared.tag(inspection_id, TAG, frame=2, code="BAB").raise_for_status()
    shared.put(
        f"/api/inspections/{inspection_id}/corrections",
        json={"zero": {"frame": 39, "offset_m": 0.0}},
    ).raise_for_status()
    (shared.data / "inspections" / inspection_id / "photos" / f"{TAG}-2.jpg").unlink()

    found = {check["code"]: check for check in checks(shared, inspection_id)}

    empty = [c for c in checks(shared, inspection_id) if c["code"] == "header_field_empty"]
    assert "asset_id" not in [check["params"]["field"] for check in empty]
    assert "operator" in [check["params"]["field"] for check in empty]
    assert {"no_start", "no_finish", "length_unknown"} <= found.keys()
    assert found["lost"]["level"] == "warn"
    assert found["lost"]["params"] == {"percent": 25.0, "frames": 10}
    poor = [c["params"] for c in checks(shared, inspection_id) if c["code"] == "poor_pictures"]
    assert {"complaint": "too_dark", "percent": 25.0} in poor
    for problem, name in (("lost", "lost_share"), ("too_dark", "dark_share")):
        (film,) = wait_until(partial(films, shared, problem))
        assert (film["inspection_id"], film[name]) == (inspection_id, 0.25)
    for code in ("photo_missing", "before_zero"):
        assert (found[code]["level"], found[code]["observation_id"]) == ("block", TAG)
        assert "No. 1" in found[code]["detail"]


def with_dark_frames(clip: Path, out: Path, dark: range) -> Path:
    """The same video with the light off for a while."""
    with av.open(str(clip)) as source, av.open(str(out), "w") as target:
        shape = source.streams.video[0]
        stream = target.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = shape.width, shape.height, "yuv420p"
        for number, frame in enumerate(source.decode(video=0)):
            picture = frame.to_ndarray(format="gray") * np.uint8(number not in dark)
            target.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="gray")))
        target.mux(stream.encode())
    return out
