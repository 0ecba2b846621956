"""The archive through its routes: films are added by rules, tracked, stopped and repaired."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from builders import Client, clip_rig, make_clip, serving, wait_until

API = "/api/archive"
RULES = {
    "rigs": {"floor": clip_rig()},
    "rules": [
        {"name": "by road", "pattern": "{project}/{asset}_{date}.mp4", "rig": "floor"},
    ],
}


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return make_clip(tmp_path_factory.mktemp("clip") / "clip.mp4", 12).read_bytes()


@pytest.fixture
def folder(tmp_path: Path, film: bytes) -> Path:
    """Two films of a road, one elsewhere, and what is no film."""
    road = tmp_path / "films" / "Road 5"
    road.mkdir(parents=True)
    for name in ("C-1_20260331.mp4", "C-2_20260401.mp4"):
        (road / name).write_bytes(film)
    (tmp_path / "films" / "other.MP4").write_bytes(film)
    (tmp_path / "films" / "notes.txt").write_text("x")
    return tmp_path / "films"


@pytest.fixture
def client(tmp_path: Path, folder: Path) -> Iterator[Client]:
    with serving(tmp_path / "data", archive_folders=(folder,)) as made:
        yield made


def ask(client: Client, action: str, **body: Any) -> Any:
    answer = client.post(f"{API}/{action}", json=body)
    assert answer.status_code == 200, answer.text
    return answer.json()


def films(client: Client, **query: Any) -> list[dict[str, Any]]:
    answer = client.get(f"{API}/films", params=query)
    assert answer.status_code == 200, answer.text
    return list(answer.json()["films"])


def states(client: Client) -> dict[str, int]:
    return dict(client.get(f"{API}/progress").json()["states"])


def test_films_are_added_by_rules_and_tracked(client: Client, folder: Path) -> None:
    assert client.put(f"{API}/rules", json=RULES).status_code == 200
    seen = ask(client, "films/preview", paths=[str(folder)])
    assert states(client) == {}
    added = ask(client, "films", paths=[str(folder)])
    assert added == seen
    assert (added["found"], added["new"], added["known"]) == (3, 3, 0)
    assert states(client) == {"ready": 2, "unassigned": 1}
    assert ask(client, "start", where={})["changed"] == 2
    wait_until(lambda: states(client) == {"done": 2, "unassigned": 1})
    first = films(client)[0]
    assert client.inspection(first["id"])["header"] == {
        "asset_id": "C-1",
        "project": "Road 5",
        "date": "2026-03-31",
    }
