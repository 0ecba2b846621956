"""A change that names what it was made of does not undo what somebody else changed meanwhile."""

from __future__ import annotations

from typing import Any

import httpx
from builders import Client

ID = "0123abcd-0000-4000-8000-00000000cafe"


def refused(answer: httpx.Response) -> dict[str, Any]:
    assert answer.status_code == 412, answer.text
    body = dict(answer.json())
    assert body.keys() == {"code", "detail", "current", "yours"}
    assert body["code"] == "changed_meanwhile"
    assert ("ETag" in answer.headers) == (body["current"] is not None)
    return body


def if_match(answer: httpx.Response) -> dict[str, str]:
    assert answer.headers["ETag"] == f'"{answer.json()["version"]}"'
    return {"If-Match": answer.headers["ETag"]}


def test_an_observation_is_changed_only_as_it_was_read(shared: Client, done: str) -> None:
    path = f"/api/inspections/{done}/observations/{ID}"
    entered = {"frame": 10, "pixel": [100, 80.5], "code": "BAB"}
    read = if_match(shared.put(path, json=entered))
    assert read == if_match(shared.get(path))
    listed = shared.get(f"/api/inspections/{done}/observations").json()["observations"]
    assert [f'"{one["version"]}"' for one in listed if one["id"] == ID] == [read["If-Match"]]

    theirs = entered | {"severity": 4}
    assert shared.put(path, json=theirs, headers=read).status_code == 200
    mine = entered | {"remark": "roots"}
    answer = shared.put(path, json=mine, headers=read)
    body = refused(answer)
    assert (body["current"], body["yours"]) == (theirs, mine)
    assert shared.get(path).json()["severity"] == 4
    assert answer.headers["ETag"] == shared.get(path).headers["ETag"]
    # What has arrived already, and is sent again for want of an answer, is no conflict.
    again = shared.put(path, json=theirs, headers=read)
    assert again.status_code == 200
    assert shared.put(path, json=mine, headers=if_match(again)).status_code == 200


def test_an_observation_that_was_deleted_does_not_come_back(shared: Client, done: str) -> None:
    path = f"/api/inspections/{done}/observations/{ID[:-1]}d"
    read = if_match(shared.put(path, json={"frame": 10}))
    assert shared.delete(path).status_code == 204
    body = refused(shared.put(path, json={"frame": 10, "code": "BAB"}, headers=read))
    assert body["current"] is None
    assert shared.get(path).status_code == 404
    assert shared.put(path, json={"frame": 10, "code": "BAB"}).status_code == 200


def test_an_observation_is_deleted_only_as_it_was_read(shared: Client, done: str) -> None:
    path = f"/api/inspections/{done}/observations/{ID[:-1]}c"
    entered = {"frame": 10, "code": "BAB"}
    read = if_match(shared.put(path, json=entered))
    theirs = shared.put(path, json=entered | {"severity": 5})
    answer = shared.delete(path, headers=read)
    body = refused(answer)
    assert (body["current"], body["yours"]) == (entered | {"severity": 5}, None)
    assert answer.headers["ETag"] == shared.get(path).headers["ETag"]
    assert shared.delete(path, headers=if_match(theirs)).status_code == 204
    assert shared.get(path).status_code == 404
    # Sent again for want of an answer, it is no conflict; and without a version it is as before.
    assert shared.delete(path, headers=read).status_code == 204
    assert shared.put(path, json=entered).status_code == 200
    assert shared.delete(path).status_code == 204


def test_a_header_is_changed_only_as_it_was_read(shared: Client, done: str) -> None:
    path = f"/api/inspections/{done}"
    read = if_match(shared.get(path))
    assert shared.patch(path, json={"header": {"asset_id": "A"}}, headers=read).status_code == 200
    answer = shared.patch(path, json={"header": {"asset_id": "B"}}, headers=read)
    body = refused(answer)
    assert answer.headers["ETag"] == shared.get(path).headers["ETag"]
    assert body["current"]["header"] == {"asset_id": "A"}
    assert body["yours"] == body["current"] | {"header": {"asset_id": "B"}}
    assert shared.patch(path, json={"header": {"asset_id": "B"}}).json()["header"] == {
        "asset_id": "B"
    }


def test_corrections_are_changed_only_as_they_were_read(shared: Client, done: str) -> None:
    path = f"/api/inspections/{done}/corrections"
    first = shared.get(path)
    read, stated = if_match(first), first.json()["stated"]
    theirs = stated | {"zero": {"frame": 3, "offset_m": 1}}
    answer = shared.put(path, json=theirs, headers=read)
    assert if_match(answer) == if_match(shared.get(path))
    mine = stated | {"zero": {"frame": 5, "offset_m": 2.5}}
    answer = shared.put(path, json=mine, headers=read)
    body = refused(answer)
    assert answer.headers["ETag"] == shared.get(path).headers["ETag"]
    assert (body["current"]["zero"], body["yours"]["zero"]) == (theirs["zero"], mine["zero"])
    assert shared.put(path, json=mine).json()["stated"]["zero"] == mine["zero"]


def test_the_schema_shows_what_a_refused_change_is_answered_with(shared: Client) -> None:
    schema = shared.get("/api/openapi.json").json()
    path = schema["paths"]["/api/inspections/{inspection_id}/corrections"]["put"]
    answer = path["responses"]["412"]["content"]["application/json"]["schema"]
    assert answer == {"$ref": "#/components/schemas/ChangedMeanwhileOut"}
    assert [one["name"] for one in path["parameters"] if one["in"] == "header"] == ["if-match"]
