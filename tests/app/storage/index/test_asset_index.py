"""Projects, assets and the list of inspections: what the index and the register say together."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, date, datetime
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from builders import clip_rig
from postgres import ON_BOTH
from sqlalchemy.orm import Session

from app.search.asset_map import assets_of
from app.storage.database.database import Database, stored_at
from app.storage.database.tables import (
    IndexedDefect,
    IndexedInspection,
    Inspection,
    RegisteredAsset,
)
from app.storage.index.asset_index import Asset, AssetIndex, Project
from app.storage.index.asset_places import AssetPlaces
from app.storage.index.defect_index import DefectIndex
from app.storage.index.inspection_list import InspectionList
from app.storage.index.work_list import Work, WorkList
from app.storage.records.inspections import InspectionStore
from app.storage.records.labels import LabelStore
from app.storage.records.projects import ProjectStore
from app.survey.assets.search_terms import (
    AssetFilter,
    InspectionFilter,
    Page,
    ProjectFilter,
    WorkFilter,
)
from app.survey.distances.intended_use import IntendedUse
from app.survey.folding import folded, normalised_id

pytestmark = ON_BOTH
NUMBERS = count(1)
NOW = datetime(2026, 11, 1, tzinfo=UTC)
ANY_PROJECT, NO_PROJECT = ProjectFilter(), ProjectFilter(is_none=True)


class Archive:
    """A database with inspections, their index, and a register."""

    def __init__(self, database: Database) -> None:
        self.database = database
        self.assets = AssetIndex(database)
        self.list = InspectionList(database)

    def inspect(
        self,
        asset: str | None,
        year: int,
        severity: int | None = None,
        *,
        project: str | None = None,
        **columns: Any,
    ) -> str:
        """Add an inspection with at most one defect; return its id."""
        number = next(NUMBERS)
        row = Inspection(
            id=f"{number:032x}", name=f"Survey {number:04}", rig=clip_rig(), header={}, video={},
            source_filename="film.mp4", source_size=1, source_sha256="",
            frames_done=0, created_at=NOW, queued_at=NOW,
            **{"status": "done", "video_file": "video.mp4", "source_kind": "upload"} | columns,
        )  # fmt: skip
        InspectionStore(self.database).add(row, "test")
        index = DefectIndex(self.database)
        token = index.token(row.id)
        assert token is not None
        indexed = IndexedInspection(
            inspection_id=row.id, name=row.name, project=project, asset=asset,
            surveyed_on=date(year, 5, 1), distance_m=40.0, distance_u95_m=0.1,
        )  # fmt: skip
        index.put(token, indexed, [] if severity is None else [defect(severity)])
        return row.id

    def register(self, asset: str, project: str | None = None) -> None:
        row = RegisteredAsset(
            asset_id=asset, normalised_id=normalised_id(asset), project=project, header={}, line=[],
            folded=folded(asset, project), changed_at=NOW, changed_by="test",
        )  # fmt: skip

        def insert(session: Session) -> None:
            session.add(row)

        self.database.write(insert)

    def found(self, text: str = "", of: ProjectFilter = ANY_PROJECT, **page: Any) -> list[Asset]:
        total, found = self.assets.assets(AssetFilter(text=text, of=of), paged("asset", **page))
        assert total >= len(found)
        return found

    def names(self, **asked: Any) -> list[str]:
        return [one.asset for one in self.found(**asked)]

    def projects(self, text: str = "", **page: Any) -> list[Project]:
        return self.assets.projects(text, ProjectFilter(), paged("project", **page))[1]

    def listed(self, sort: Any = "created_at", **filters: Any) -> list[str]:
        wanted = InspectionFilter(**filters)
        found = self.list.found(wanted, paged(sort))
        ids = [summary.row.id for summary in found.summaries]
        assert found.total == len(ids)
        assert self.list.ids(wanted, paged(sort)) == ids
        return ids


def paged(sort: Any, *, descending: bool = False, offset: int = 0, limit: int = 50) -> Page[Any]:
    return Page(sort=sort, descending=descending, offset=offset, limit=limit)


def defect(severity: int) -> IndexedDefect:
    return IndexedDefect(
        observation_id="o", seq=1, frame=0, code="BAB", severity=severity, distance_m=3.0,
        clock_hours=0, created_at=NOW, folded="bab",
    )  # fmt: skip


@pytest.fixture
def archive(new_url: Callable[[], str | None], tmp_path: Path) -> Iterator[Archive]:
    database = Database(stored_at(new_url(), tmp_path))
    yield Archive(database)
    database.close()


def test_an_asset_has_the_figures_of_its_newest_survey(archive: Archive) -> None:
    archive.inspect("CV-1", 2019, 5, project="Old")
    newest = archive.inspect("CV-1", 2024, 2, project="North")
    archive.inspect("CV-1", 2024, 3, project="East", video_file="")  # later on the same day
    archive.inspect("CV-1", 2025, project="Planned", status="queued")  # shows nothing yet
    archive.register("CV-2", "South")
    figures = ("CV-1", "North", 4, date(2024, 5, 1), 3)
    assert archive.found() == [
        Asset(*figures, newest, False, ()),
        Asset("CV-2", "South", 0, None, None, None, True, ()),
    ]
    _, mapped = assets_of(*AssetPlaces(archive.database).read(None))
    assert figures == (
        mapped.asset, mapped.project, mapped.inspections, mapped.last_at, mapped.worst_severity,
    )  # fmt: skip
    archive.register("CV-1", "Register")
    assert (archive.found()[0].project, archive.found()[0].is_registered) == ("Register", True)


def test_another_spelling_of_an_id_is_pointed_out(archive: Archive) -> None:
    for asset in ("CV-01", "CV 1"):
        archive.inspect(asset, 2024)
    archive.register("cv 01")
    assert {one.asset: one.also_written for one in archive.found()} == {
        "CV-01": ("cv 01",), "cv 01": ("CV-01",), "CV 1": (),
    }  # fmt: skip


def test_assets_are_found_by_words_and_project_and_sorted(archive: Archive) -> None:
    archive.inspect("A", 2020, 4, project="Jalan Ampang")
    archive.inspect("B", 2024, 1)
    archive.register("C", "Jalan Ampang")
    archive.register("D")
    archive.inspect("C", 2023)  # its header states no project, the register does
    archive.inspect("A", 2019)
    assert archive.names(text="jalan") == ["A", "C"]
    assert archive.names(of=ProjectFilter(name="Jalan Ampang")) == ["A", "C"]
    assert archive.names(of=NO_PROJECT) == ["B", "D"]
    page = paged("worst_severity", descending=True, limit=3)
    total, found = archive.assets.assets(AssetFilter(), page)
    assert (total, [one.asset for one in found]) == (4, ["A", "B", "C"])
    assert archive.names(descending=True, offset=1, limit=2) == ["C", "B"]


def test_projects_have_the_figures_of_their_inspections_and_assets(archive: Archive) -> None:
    archive.inspect("A", 2019, 5, project="North", review_state="approved")
    archive.inspect("A", 2024, 2, project="North", status="failed")
    archive.inspect(None, 2020, 3, project="North")
    archive.inspect("B", 2021, 1)
    archive.register("A")  # the register gives it no project: it belongs to North only
    archive.register("C", "South")
    assert archive.projects() == [
        Project("North", 1, 3, 2, 1, date(2024, 5, 1), 5),  # a run that failed shows nothing
        Project("South", 1, 0, 0, 0, None, None),
        Project(None, 1, 1, 1, 0, date(2021, 5, 1), 1),
    ]
    assert [one.project for one in archive.projects(text="b")] == [None]
    assert [one.project for one in archive.projects(text="south")] == ["South"]
    _, (nameless,) = archive.assets.projects("", NO_PROJECT, paged("project"))
    assert nameless.project is None


def test_inspections_are_listed_by_what_the_index_and_their_labels_say(archive: Archive) -> None:
    a = archive.inspect("A", 2020, 4, project="North", review_state="approved")
    b = archive.inspect("B", 2024, 1, project="North")
    c = archive.inspect(None, 2022)
    labels = LabelStore(archive.database)
    labels.put(b, ["urgent", "invoiced"], "Ana")
    labels.put(a, ["invoiced"], "Ana")
    assert archive.listed(of=ProjectFilter(name="North"), sort="name") == [a, b]
    assert archive.listed(of=NO_PROJECT) == [c]
    assert archive.listed(asset="B") == [b]
    assert archive.listed(severity_from=2) == [a]
    assert archive.listed(label="urgent") == [b]
    assert archive.listed(review="draft", label="invoiced") == [b]
    assert archive.listed("worst_severity") == [b, a, c]
    assert archive.listed("surveyed_on") == [a, c, b]
    assert archive.listed("review_state", search="film.mp4")[0] == a
    assert labels.in_use() == [("invoiced", 2), ("urgent", 1)]
    many = [a, *(f"{n:032x}" for n in range(10**9, 10**9 + 66_000)), b]
    assert labels.of(many) == {a: ("invoiced",), b: ("invoiced", "urgent")}
    InspectionStore(archive.database).delete(b, "Ana")
    assert labels.in_use() == [("invoiced", 1)]


def test_a_project_is_there_before_anything_belongs_to_it(archive: Archive) -> None:
    projects = ProjectStore(archive.database)
    projects.make("Östliche Straße", "Ana")
    projects.make("Östliche Straße", "Ben")
    archive.register("CV-1", "South")

    assert [(one.project, one.assets) for one in archive.projects()] == [
        ("South", 1), ("Östliche Straße", 0),
    ]  # fmt: skip
    assert [one.project for one in archive.projects("ostliche strasse")] == ["Östliche Straße"]
    projects.make("South", "Ana")
    for name in ("South", "Östliche Straße"):
        projects.delete(name)
    assert [one.project for one in archive.projects()] == ["South"]


def work(archive: Archive, sort: Any = "state", **wanted: Any) -> Work:
    return WorkList(archive.database).work(WorkFilter(**wanted), paged(sort), IntendedUse())


def test_a_section_is_as_far_as_its_newest_inspection_of_the_round(archive: Archive) -> None:
    for number in range(1, 7):
        archive.register(f"CV-{number}", "Round 2026")
    archive.inspect("CV-2", 2019, 4, project="Round 2019", review_state="approved")
    filmed = archive.inspect("CV-2", 2026, project="Round 2026", status="running")
    archive.inspect("CV-3", 2026, review_state="in_review")
    archive.inspect("CV-4", 2026, project="Round 2026", review_state="approved")
    archive.inspect("CV-5", 2020, 3, project="Round 2019", review_state="approved")
    archive.inspect("CV-6", 2026, source_kind="live", status="running")
    archive.inspect("CV-6", 2026, project="Round 2026")

    found = work(archive)

    assert [(one.asset, one.state) for one in found.sections] == [
        ("CV-1", "to_do"), ("CV-5", "to_do"), ("CV-6", "live"), ("CV-2", "recorded"),
        ("CV-3", "in_review"), ("CV-4", "issued"),
    ]  # fmt: skip
    by_asset = {one.asset: one for one in found.sections}
    assert (by_asset["CV-5"].last_at, by_asset["CV-5"].worst_severity) == (date(2020, 5, 1), 3)
    assert by_asset["CV-5"].inspection_id is None
    assert by_asset["CV-2"].inspection_id == filmed
    assert [by_asset[asset].is_useful for asset in ("CV-1", "CV-2")] == [None, True]
    assert found.states == {"to_do": 2, "live": 1, "recorded": 1, "in_review": 1, "issued": 1}


def test_the_work_is_narrowed_by_words_project_and_state(archive: Archive) -> None:
    archive.register("CV-1", "North")
    archive.register("CV-2", "South")
    archive.register("DV-1", "South")
    archive.inspect("CV-2", 2026)

    south = work(archive, of=ProjectFilter(name="South"), state="to_do")

    assert [one.asset for one in south.sections] == ["DV-1"]
    assert south.total == 1
    assert south.states["recorded"] == 1  # the other states can still be chosen
    assert [one.asset for one in work(archive, "asset", text="cv").sections] == ["CV-1", "CV-2"]


def test_live_waiting_and_past_inspections_are_beside_the_work(archive: Archive) -> None:
    live = archive.inspect(None, 2026, source_kind="live", status="running")
    waiting = archive.inspect(None, 2026, review_state="submitted")
    past = archive.inspect(None, 2026, 5, review_state="approved")
    archive.inspect(None, 2026, status="queued")

    around = WorkList(archive.database).around(IntendedUse())

    assert [[one.id for one in some.inspections] for some in around] == [[live], [waiting], [past]]
    assert [some.total for some in around] == [1, 1, 1]
    assert [some.inspections[0].worst_severity for some in around] == [None, None, 5]
