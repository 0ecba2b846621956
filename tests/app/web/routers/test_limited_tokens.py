"""A token limited to projects: it sees and changes nothing of others, on no route."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from builders import PATIENCE_S, TUS, Client, assert_error, wait_until
from doors import ask, bearer, example, routes_of
from surveys import Survey, another
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from app.access.access import create_token
from app.storage.database.database import FILE, Database
from app.storage.database.tables import ArchiveFilm, Base, Inspection
from app.storage.folder.tokens import Role, TokenFile
from app.survey.catalogue import example_pack
from app.web.deps import _OF_PROJECTS
from app.web.middleware import is_public

SECRET = "zzsecret"  # noqa: S105
"""In everything of the other project, and in nothing else."""
OWN, OTHER = "Ost", f"{SECRET} project"
TAG = "7d444840-9dc0-4d2a-8a6a-000000000001"
SHARED = {
    "sessions", "token_uses", "preferences", "rigs", "archive_rules", "heartbeat",
    "detectors", "notices", "acceptance_links", "idempotent_requests",
}  # fmt: skip
"""Tables of which no row belongs to a project by itself: a link does by its sections."""
NAMES_NO_PROJECT = {"/api/openapi.json"}


@dataclass(frozen=True)
class Foreign:
    """What is of the other project, by the parameter of a path that names it."""

    ids: dict[str, str]

    def url(self, path: str) -> str:
        return re.sub(r"{(\w+)(:\w+)?}", lambda m: self.ids.get(m[1], example(m[1])), path)


@pytest.fixture(scope="module")
def own(shared: Client, survey: Survey) -> str:
    return another(survey, shared, name="Ours", header={"asset_id": "O-1", "project": OWN})


@pytest.fixture(scope="module")
def foreign(shared: Client, survey: Survey, own: str) -> Foreign:
    header = {"asset_id": f"{SECRET}-1", "project": OTHER, "operator": SECRET}
    theirs = another(survey, shared, name=SECRET, header=header)
    shared.tag(theirs, TAG, code="BAB", severity=4, remark=SECRET).raise_for_status()
    shared.tag(own, TAG, code="BAB", severity=4).raise_for_status()
    shared.put(f"/api/inspections/{theirs}/labels", json={"labels": [SECRET]}).raise_for_status()
    shared.put(f"/api/register/assets/{SECRET}-1", json={"project": OTHER}).raise_for_status()
    shared.post("/api/register/projects", json={"name": f"{SECRET} made"}).raise_for_status()
    link = shared.post("/api/acceptance-links", json={"inspections": [theirs], "note": SECRET})
    ordered = {"number": SECRET, "asset_id": f"{SECRET}-1", "reason": SECRET}
    template = shared.get("/api/report-templates/").json()["template"]
    shared.put(f"/api/report-templates/{OTHER}", json=template).raise_for_status()
    pack = {"name": SECRET, "project": OTHER}
    shared.post("/api/packs", params=pack, content=example_pack()).raise_for_status()
    add(shared.data, film(SECRET, OTHER))
    order = shared.post("/api/bulk-exports", json={"inspections": [theirs], "formats": ["csv"]})
    wait_until(lambda: shared.get("/api/archive/defects").json()["pending"] == 0)
    return Foreign(
        {
            "inspection_id": theirs,
            "observation_id": TAG,
            "upload_id": shared.upload(b"film", f"{SECRET}.mp4"),
            "order_id": order.json()["id"],
            "link_id": link.json()["link"]["id"],
            "work_order_id": shared.post("/api/work-orders", json=ordered).json()["id"],
            "asset_id": f"{SECRET}-1",
            "asset": f"{SECRET}-1",
            "project": OTHER,
            "part": "access",
        }
    )


def film(name: str, project: str) -> ArchiveFilm:
    now = datetime.now(UTC)
    digest = hashlib.sha256(name.encode()).hexdigest()
    return ArchiveFilm(
        id=digest[:32], path=f"/{name}", relative=name, path_sha256=digest, size=1, name=name,
        modified_at=now, project=project, asset=name, header={}, state="refused", rig={},
        error_code="film_missing", error_detail=name, added_at=now, added_by="x",
    )  # fmt: skip


def add(data: Path, row: Base) -> None:
    database = Database(data / FILE)
    database.write(lambda session: session.add(row))
    database.close()


@pytest.fixture(scope="module")
def limited(shared: Client) -> Iterator[Client]:
    """An admin of the own project."""
    with limited_client(shared, "ours", Role.ADMIN) as client:
        yield client


def limited_client(client: Client, name: str, role: Role, project: str = OWN) -> Client:
    made = client.anonymous()
    secret = create_token(TokenFile(client.data), name, role, frozenset({project}))
    made.headers.update(bearer(secret))
    return made


def test_no_route_shows_or_changes_anything_of_another_project(
    shared: Client, limited: Client, foreign: Foreign
) -> None:
    before = shared.get(f"/api/inspections/{foreign.ids['inspection_id']}").json()
    for method, path, endpoint in sorted(routes_of(shared.server.app.routes), key=str):
        if is_public(path) or path in NAMES_NO_PROJECT or "{ticket}" in path:
            continue
        headers = dict(TUS) if path.startswith("/api/uploads") else {}
        answer = ask(limited, method, foreign.url(path), headers)
        which = f"{method} {path}"
        if "{inspection_id}" in path:
            assert answer.status_code == 404, f"{which} opens an inspection of another project."
        elif endpoint not in _OF_PROJECTS:
            assert answer.status_code == 403, f"{which} is open to a token limited to projects."
        told = answer.text if answer.status_code != 101 else ""
        for name in re.findall(r"{(\w+)", path):  # what was asked for may be in the answer
            told = told.replace(foreign.ids.get(name, SECRET), "")
        assert SECRET not in told, (
            f"{which} tells a token limited to {OWN!r} about {OTHER!r}: it declares `of_projects` "
            "and shows what it has not read from the database."
        )
    (pack,) = shared.get("/api/packs").json()["packs"]
    for client, status in ((shared, 200), (limited, 404)):  # the first reads it into the memory
        answer = client.get("/api/codes", params={"pack": pack["id"]})
        assert answer.status_code == status
    after = shared.get(f"/api/inspections/{foreign.ids['inspection_id']}").json()
    assert after == before
    assert shared.get(f"/api/register/assets/{SECRET}-1").status_code == 200
    assert shared.get(f"/api/bulk-exports/{foreign.ids['order_id']}").status_code == 200
    upload = f"/api/uploads/{foreign.ids['upload_id']}"
    assert shared.head(upload, headers=TUS).status_code == 200


def test_lists_and_their_numbers_are_those_of_the_own_projects(
    shared: Client, survey: Survey, foreign: Foreign
) -> None:
    one = another(survey, shared, header={"asset_id": "Q-1", "project": "Quiet"})
    add(shared.data, film("quiet film", "Quiet"))
    shared.tag(one, TAG, code="BAB", severity=4).raise_for_status()
    wait_until(lambda: shared.get("/api/archive/defects").json()["pending"] == 0)
    quiet = limited_client(shared, "quiet", Role.VIEWER, "Quiet")

    def number(path: str, name: str = "total") -> Any:
        answer = quiet.get(path)
        assert answer.status_code == 200, answer.text
        return answer.json()[name]

    assert number("/api/inspections?limit=10") == number("/api/inspections?limit=10", "stored") == 1
    assert number("/api/inspections/ids", "ids") == [one]
    assert number("/api/archive/defects") == 1
    assert number("/api/archive/quality") == 1
    assert number("/api/archive/films") == 1
    assert number("/api/archive/failures", "groups")[0]["count"] == 1
    assert number("/api/register/assets") == 0
    assert [row["project"] for row in number("/api/archive/projects", "projects")] == ["Quiet"]
    assert [row["asset"] for row in number("/api/archive/assets", "assets")] == ["Q-1"]
    assert number("/api/map", "unplaced") == 1
    assert number("/api/map", "projects") == ["Quiet"]
    assert number("/api/inspections/labels", "labels") == []


def test_what_a_limited_token_makes_and_moves_stays_in_its_projects(
    shared: Client, limited: Client, own: str, foreign: Foreign
) -> None:
    path = f"/api/inspections/{own}"
    header = limited.get(path).json()["header"]
    for project in (OTHER, OWN.lower(), "", None):
        moved = {"header": {**header, "project": project}}
        refused = limited.patch(path, json=moved)
        assert_error(refused, 403, "forbidden")
    assert limited.patch(path, json={"header": header | {"operator": "Ana"}}).status_code == 200

    report = limited.get(f"{path}/exports/json").content
    imports = "/api/imports?filename=a.json"
    assert limited.post(imports, content=report).status_code == 201
    theirs = shared.get(f"/api/inspections/{foreign.ids['inspection_id']}/exports/json").content
    assert_error(limited.post(imports, content=theirs), 403, "forbidden")

    assets = "/api/register/assets"
    assert limited.put(f"{assets}/O-2", json={"project": OWN}).status_code == 200
    for asset_id, project in ((f"{SECRET}-1", OWN), ("O-2", OTHER), ("O-3", None)):
        refused = limited.put(f"{assets}/{asset_id}", json={"project": project})
        assert_error(refused, 403, "forbidden")
    assert_error(limited.delete(f"{assets}/{SECRET}-1"), 404, "asset_not_found")
    for name in (f"{SECRET} made", "new"):
        refused = limited.post("/api/register/projects", json={"name": name})
        assert_error(refused, 403, "forbidden")
    template = shared.get("/api/report-templates/").json()["template"]
    for name, status in ((OTHER, 403), ("", 403), (OWN, 200)):
        answer = limited.put(f"/api/report-templates/{name}", json=template)
        assert answer.status_code == status, (name, answer.text)
    retried = limited.post("/api/inspections/retry", json={"ids": [foreign.ids["inspection_id"]]})
    assert retried.json() == {"queued": 0}


def test_files_and_orders_are_those_of_the_token(
    shared: Client, limited: Client, own: str, foreign: Foreign
) -> None:
    upload_id = foreign.ids["upload_id"]
    body = {
        "name": "Taken", "source": {"kind": "upload", "upload_id": upload_id}, "rig": {},
        "header": {"project": OWN},
    }  # fmt: skip
    taken = limited.post("/api/imports/archive", json={"upload_id": upload_id})
    assert_error(taken, 404, "upload_not_found")
    assert limited.post("/api/inspections", json=body).status_code in (404, 422)
    assert limited.head(f"/api/uploads/{limited.upload(b'film')}", headers=TUS).status_code == 200

    wanted = {"inspections": [own, foreign.ids["inspection_id"]], "formats": ["csv"]}
    order = limited.post("/api/bulk-exports", json=wanted).json()["id"]
    state = wait_until(
        lambda: (
            (found := limited.get(f"/api/bulk-exports/{order}").json())["state"] == "done" and found
        )
    )
    assert len(state["not_made"]) == 1
    assert SECRET not in json.dumps(state)
    assert SECRET.encode() not in limited.get(f"/api/bulk-exports/{order}/archive").content


def test_an_open_socket_ends_with_the_token_and_when_its_inspection_leaves_the_project(
    shared: Client, survey: Survey
) -> None:
    crew = limited_client(shared, "crew", Role.VIEWER)
    for end in ("moved", "revoked"):
        header = {"project": OWN, "asset_id": "O-9"}
        watched = another(survey, shared, header=header)
        with connect(
            f"{shared.server.websocket_url}/api/inspections/{watched}/live",
            origin=shared.server.url,
            additional_headers={"Authorization": crew.headers["Authorization"]},
            open_timeout=PATIENCE_S,
        ) as socket:
            socket.recv(PATIENCE_S)
            if end == "moved":
                moved = {"header": header | {"project": OTHER}}
                shared.patch(f"/api/inspections/{watched}", json=moved).raise_for_status()
                assert_error(crew.get(f"/api/inspections/{watched}"), 404, "inspection_not_found")
            else:
                shared.delete("/api/tokens/crew").raise_for_status()
            with pytest.raises(ConnectionClosed) as closed:
                socket.recv(PATIENCE_S)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4401


def test_every_table_says_how_its_rows_belong_to_projects() -> None:
    for mapper in Base.registry.mappers:
        table = mapper.class_
        belongs = "inspection_id" in table.__table__.columns or (table.PROJECT or table.ASSET)
        assert belongs or table.__tablename__ in SHARED or table is Inspection, (
            f"A token that is limited to projects sees every row of {table.__tablename__}: give "
            "the table a PROJECT, or name it in SHARED."
        )
