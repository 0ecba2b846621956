"""The archive: its films, rules, progress and failures."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, Field, StringConstraints, model_validator

from app.archive.additions import Addition, Additions, Request
from app.archive.archive import Change, FilmView, Where
from app.archive.rules import Line, Priority, Rules
from app.archive.tables import read_table
from app.storage.archive.selection import FilmState, Selection
from app.survey.given import Given, Header
from app.web.schemas.failures import ErrorOut
from app.web.schemas.out import Out, Tenths, Thousandths, rounded_to

FilmId = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]
PathText = Annotated[str, StringConstraints(min_length=1, max_length=4096, pattern=r"^/[^\x00]*$")]
Words = Annotated[str, StringConstraints(max_length=1000, pattern=r"^[^\x00]*$")]
State = FilmState
Csv = Annotated[str, StringConstraints(max_length=16 * 2**20)]
Sort = Literal[
    "name", "path", "project", "asset", "rule", "rig_name", "state", "priority", "size",
    "frames_done", "fps", "distance_m", "added_at", "finished_at",
]  # fmt: skip


class WhereIn(Given):
    """Films by the filters of the list."""

    search: Words | None = None
    state: State | None = None
    project: Words | None = None
    asset: Words | None = None
    reason: Words | None = Field(None, description="The reason of a group of failures.")
    outdated: bool = Field(False, description="Only films that an older program tracked.")

    def to_where(self, ids: tuple[str, ...] | None = None) -> Where:
        """Convert for the service."""
        return Where(
            Selection(
                ids=ids,
                search=self.search,
                states=() if self.state is None else (self.state,),
                project=self.project,
                asset=self.asset,
                outdated=self.outdated,
            ),
            self.reason,
        )


class FilmsMeant(Given):
    """Films by their ids, or by the filters of the list (all films: `{}`)."""

    ids: Annotated[list[FilmId], Field(max_length=10_000)] | None = None
    where: WhereIn | None = None

    @model_validator(mode="after")
    def _either(self) -> Self:
        if (self.ids is None) == (self.where is None):
            raise ValueError("name the films either by ids or by where")
        return self

    def to_where(self) -> Where:
        """Convert for the service."""
        ids = None if self.ids is None else tuple(self.ids)
        return (self.where or WhereIn(reason=None, outdated=False)).to_where(ids)


class WishIn(FilmsMeant):
    """Films that are to be tracked."""

    priority: Priority | None = Field(None, description="Higher first; omitted, it stays.")


class FilmChangeIn(Given):
    """What to set; omitted fields stay."""

    rig: dict[str, Any] | None = Field(None, description="The whole rig file.")
    rig_name: Line | None = Field(None, description="A rig of the rules, or the name of `rig`.")
    project: Line | None = None
    asset: Line | None = None
    header: Header | None = Field(
        None, description="Fields of the header to set; null removes one, the others stay."
    )
    priority: Priority | None = None


class FilmsChangeIn(FilmsMeant):
    """A change of films."""

    set: FilmChangeIn

    def to_change(self) -> Change:
        """Convert for the service; project and asset have columns of their own."""
        header = dict(self.set.header or {})
        project, asset = header.pop("project", None), header.pop("asset_id", None)
        return Change(
            rig=self.set.rig,
            rig_name=self.set.rig_name,
            project=self.set.project or _line(project),
            asset=self.set.asset or _line(asset),
            header=header,
            priority=self.set.priority,
        )


def _line(value: object) -> str | None:
    return None if value is None else str(value)


class AdditionIn(Given):
    """Films of this server's machine to add."""

    paths: Annotated[list[PathText], Field(min_length=1, max_length=100_000)] = Field(
        description="Whole paths of folders or films, inside CHAINAGE_ARCHIVE_FOLDERS."
    )
    rules: Rules | None = Field(None, description="Rules for these films; else the stored ones.")
    header_csv: Csv | None = Field(
        None,
        description="Table with a column `file`, `path` or `asset_id`, and fields of the header, "
        "name, project, asset, rig or priority.",
    )
    list_csv: Csv | None = Field(
        None, description="Another such table, which takes precedence over `header_csv`."
    )
    priority: Priority | None = Field(None, description="Of all films; else that of the rules.")

    def to_request(self, stored: Rules) -> Request:
        """Convert for the service.

        Raises:
            InvalidTable: A table cannot be used; the text names its lines.
        """
        tables = [
            read_table(text, title)
            for text, title in ((self.list_csv, "the list"), (self.header_csv, "the header table"))
            if text is not None
        ]
        return Request(self.paths, self.rules or stored, tables, self.priority)


class AddedFilmOut(Out):
    """A file, and what the film gets."""

    path: str
    rule: str | None
    rig_name: str | None
    project: str | None
    asset: str | None
    name: str | None
    problem: str | None
    """Why it is not tracked, or what is wrong with its header."""

    @classmethod
    def of(cls, addition: Addition) -> Self:
        """Convert the service's result; a file that is no film gets nothing."""
        gets = dict.fromkeys(("rule", "rig_name", "project", "asset", "name"))
        if addition.assigned is not None:
            gets = {name: getattr(addition.assigned, name) for name in gets}
        return cls(path=addition.found.path, problem=addition.problem, **gets)


class AdditionOut(Out):
    """What was, or would be, added."""

    found: int
    new: int
    known: int
    films: list[AddedFilmOut]
    warnings: list[str]
    """Sentences about rows of tables that no film has, and files that are not listed."""

    @classmethod
    def of(cls, found: Additions) -> Self:
        """Convert the service's result."""
        warnings = list(found.warnings)
        if found.others:
            warnings.append(f"{found.others} more files are not films.")
        return cls.read_from(
            found,
            new=len(found.new),
            films=[AddedFilmOut.of(each) for each in found.films],
            warnings=warnings,
        )


class FilmOut(Out):
    """A film of the archive."""

    id: str
    path: str
    name: str
    project: str | None
    asset: str | None
    rule: str | None
    has_rig: bool
    rig_name: str | None
    state: State
    priority: int
    size: int
    frames_done: int
    frames_total: int | None
    fps: Tenths | None
    eta_s: Tenths | None
    distance_m: Thousandths | None
    distance_u95_m: float | None
    is_useful: bool | None
    """Whether that is as narrow as `/api/intended-use` asks for; None if nobody measured it."""
    outdated: bool
    """Whether an older program tracked it: today's might measure it otherwise."""
    error: ErrorOut | None
    inspection_id: str | None
    added_at: datetime
    finished_at: datetime | None

    @classmethod
    def of(cls, view: FilmView) -> Self:
        """Convert the service's view."""
        row, inspection = view.row, view.row.inspection
        return cls.read_from(
            row,
            row.film,
            view.progress,
            view,
            inspection_id=None if inspection is None else inspection.id,
            finished_at=None if inspection is None else inspection.finished_at,
            outdated=inspection is not None and inspection.is_outdated,
            error=_error(view),
        )


def _error(view: FilmView) -> ErrorOut | None:
    """Return why a film failed, was refused, or has no rig."""
    inspection = view.row.inspection
    is_refused = view.row.state == "refused"
    source = view.row.film if inspection is None or is_refused else inspection
    if source.error_code is None or view.row.state in ("waiting", "paused"):
        return None
    return ErrorOut(code=source.error_code, detail=source.error_detail or "")


class FolderOut(Out):
    """A folder to choose from."""

    name: str
    path: str


class FoldersOut(Out):
    """What is in a folder of this machine."""

    path: str | None
    """null for the folders to begin with."""
    above: str | None
    """The folder that it is in; null where that is the beginning."""
    folders: list[FolderOut]
    films: int
    """Films directly in it."""


class FilmsOut(BaseModel):
    """One page of the list."""

    total: int
    """Number of all films that the filters select."""
    films: list[FilmOut]


class ChangedOut(BaseModel):
    """How many films an action has changed."""

    changed: int


class EngineOut(Out):
    """What tracks the films."""

    kind: str
    workers: int
    dashboard_url: str | None
    problem: str | None
    """Why it tracks nothing."""


class IntakeOut(Out):
    """The film that is being copied into the data folder, and what hinders it."""

    id: str | None = Field(validation_alias="film_id")
    name: str | None
    bytes_done: int
    bytes_total: int
    hindrance: str | None


class ArchiveProgressOut(Out):
    """Progress of the films as a whole."""

    states: dict[FilmState, int]
    """Number of films of each state that occurs."""
    frames_done: int
    frames_total: int
    """Of the films whose number of frames is known: those that are inspections already."""
    films_done: int
    fps: Tenths | None
    """Frames per second of the films that ended last, all together."""
    films_per_h: Tenths | None
    eta_s: Annotated[float, rounded_to(0)] | None
    engine: EngineOut
    intake: IntakeOut


class FailureOut(Out):
    """One film of a group."""

    id: str
    name: str
    detail: str


class GroupOut(Out):
    """Films that failed or were refused for the same reason."""

    code: str
    reason: str
    """The sentence without its numbers and the name of the film."""
    count: int
    example: FailureOut
    repair: Literal["rig", "retry", "film"] | None
    """Another rig, only another try, another film in its place, or nothing that is known."""


class FailuresOut(BaseModel):
    """The groups, the largest first."""

    groups: list[GroupOut]
