"""The archive: thousands of films with their rigs, their state, and what people do with them."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from app.archive.additions import Additions, Request, additions, columns
from app.archive.assignment import Assignment
from app.archive.folders import Listing, folders_in
from app.archive.intake import Intake, IntakeState
from app.archive.reasons import Group, grouped, reason_of
from app.archive.rules import Rules, checked_rig, require_usable
from app.archive.throughput import LOOKED_AT, throughput
from app.errors import NotRunning
from app.inspections.purpose import Purpose
from app.storage.archive.changes import ArchiveChanges
from app.storage.archive.films import ArchiveFilms
from app.storage.archive.rules import RuleStore
from app.storage.archive.selection import ACTIVE, FilmRow, FilmState, Selection
from app.storage.database.database import Database
from app.storage.database.tables import Inspection
from app.survey.distances.interval import half_width_m
from app.survey.versions import require_version, version_of
from app.tracking.films.engines import Engine, EngineState
from app.tracking.films.queue import Tracking
from app.tracking.films.runs import Runs
from app.tracking.live import Progress
from vo_core.errors import InvalidRig

logger = logging.getLogger(__name__)

_TO_DO: tuple[FilmState, ...] = ("waiting", *ACTIVE)


@dataclass(frozen=True)
class Where:
    """Which films are meant: a selection, and the reason why they failed."""

    selection: Selection
    reason: str | None = None
    """That of a group of failures."""


@dataclass(frozen=True)
class FilmView:
    """A film with its progress."""

    row: FilmRow
    progress: Progress
    distance_m: float | None = None
    """Corrected distance of the last frame; half of its 95 % interval follows."""
    distance_u95_m: float | None = None
    is_useful: bool | None = None
    """Whether that is well enough for the intended use; None if nobody measured it."""


@dataclass(frozen=True)
class ArchiveProgress:
    """Progress of the selected films as a whole."""

    states: Mapping[FilmState, int]
    frames_done: int
    frames_total: int
    """Of the films whose number of frames is known: they are inspections already."""
    films_done: int
    fps: float | None
    """Frames per second of the films that ended last; the next two are of the same films."""
    films_per_h: float | None
    eta_s: float | None
    engine: EngineState
    intake: IntakeState


@dataclass(frozen=True)
class Change:
    """What to set; None leaves it."""

    rig: Mapping[str, Any] | None = None
    rig_name: str | None = None
    """A rig of the stored rules, or the name of `rig`."""
    project: str | None = None
    asset: str | None = None
    header: Mapping[str, Any] | None = None
    """Fields to set; None removes one, the others stay."""
    priority: int | None = None


class Archive:
    """Lists the films, adds to them, and starts, stops and repairs any number at once."""

    def __init__(
        self,
        database: Database,
        tracking: Tracking,
        runs: Runs,
        intake: Intake,
        purpose: Purpose,
        *,
        folders: Sequence[Path],
        engine: Engine,
    ) -> None:
        self._films = ArchiveFilms(database)
        self._changes = ArchiveChanges(database)
        self._rules = RuleStore(database)
        self._tracking = tracking
        self._runs = runs
        self._intake = intake
        self._purpose = purpose
        self._folders = folders
        self._engine = engine

    def films(
        self, where: Where, sort: str | None, *, descending: bool, offset: int, limit: int
    ) -> tuple[int, list[FilmView]]:
        """Return the number of selected films, and one page of them."""
        total, rows = self._films.listed(
            self._resolved(where), sort, descending=descending, offset=offset, limit=limit
        )
        return total, [self._view(row) for row in rows]

    def folders(self, path: str | None) -> Listing:
        """Return the folders in a folder of films, those to begin with for None.

        Raises:
            FolderNotAllowed, NoSuchFilm: The path cannot be used.
        """
        return folders_in(path, self._folders)

    def preview(self, request: Request) -> Additions:
        """Return what each film of a request would get; nothing changes.

        Raises:
            FolderNotAllowed, NoSuchFilm: A path cannot be used.
        """
        return additions(request, self._folders, self._films)

    def add(self, request: Request, who: str) -> Additions:
        """Add the new films of a request; one without a rig is unassigned.

        Raises:
            FolderNotAllowed, NoSuchFilm: A path cannot be used.
        """
        found = self.preview(request)
        added = self._changes.add(columns(found.new, who))
        logger.info("%s added %d films to the archive.", who, len(added))
        return found

    def rules(self) -> Rules:
        """Return the stored rules."""
        return stored_rules(self._rules)

    def put_rules(self, rules: Rules, who: str, replaced: str | None) -> Rules:
        """Replace the rules, and give unassigned films what the new ones say.

        Raises:
            InvalidRig: A rig cannot be used or is not there; the text names the place.
            ChangedMeanwhile: The stored version is no longer `replaced`; nothing was stored.
        """
        require_usable(rules)
        content = rules.model_dump(mode="json")

        def require(stored: Mapping[str, Any] | None) -> None:
            current = stored or Rules().model_dump(mode="json")
            require_version(current, content, replaced)

        self._rules.put(content, who, require)
        assignment = Assignment(rules)

        def given(path: str, relative: str) -> Mapping[str, Any] | None:
            assigned = assignment.assigned_to(path, relative)
            return None if assigned.rig is None else asdict(assigned)

        changed = self._changes.assign(given)
        logger.info("%s changed the rules of the archive; %d films got a rig.", who, changed)
        self._intake.wake()
        return rules

    def start(self, where: Where, who: str, priority: int | None = None) -> int:
        """Let ready and paused films wait for their turn; return their number."""
        changed = self._wait(where, ("ready", "paused"), who, priority)
        logger.info("%s started %d films of the archive.", who, changed)
        return changed

    def resume(self, where: Where, who: str, priority: int | None = None) -> int:
        """Let paused films wait for their turn again; return their number."""
        changed = self._wait(where, ("paused",), who, priority)
        logger.info("%s resumed %d films of the archive.", who, changed)
        return changed

    def retry(self, where: Where, who: str, priority: int | None = None) -> int:
        """Let films that failed, were cancelled or refused wait for another try; return their
        number. One whose rig has changed is tracked with the new rig.

        Films that an older program tracked are tracked again where they are meant: by their ids, or
        as outdated. An approved one is left alone.
        """
        changed = self._wait(where, ("failed", "cancelled", "refused"), who, priority)
        if where.selection.outdated or where.selection.ids is not None:
            old = replace(self._resolved(where), outdated=True)
            changed += self._tracking.track_again(self._films.ids(old, "done"))
        logger.info("%s retried %d films of the archive.", who, changed)
        return changed

    def pause(self, where: Where, who: str) -> int:
        """Stop films that wait, are queued or running, until they are resumed; return their number.

        One that is running continues at its last checkpoint.
        """
        selection = self._resolved(where)
        changed = self._changes.set_state(selection, ("waiting",), "paused", who)
        ids = self._films.ids(selection, *ACTIVE)
        self._changes.set_state(Selection(ids), ACTIVE, "paused", who)
        for film in ids:
            if self._cancelled(film):
                changed += 1
            else:
                self._changes.set_state(Selection((film,)), ("paused",), "idle", who)
        logger.info("%s paused %d films of the archive.", who, changed)
        return changed

    def cancel(self, where: Where, who: str) -> int:
        """Stop films that wait, are paused, queued or running; return their number.

        One that was not begun is ready again; another one is cancelled and keeps its track so far.
        """
        selection = self._resolved(where)
        changed = self._changes.set_state(selection, ("waiting", "paused"), "idle", who)
        for film in self._films.ids(selection, *ACTIVE):
            changed += self._cancelled(film)
        logger.info("%s cancelled %d films of the archive.", who, changed)
        return changed

    def change(self, where: Where, who: str, change: Change) -> int:
        """Change films, and the headers of their inspections; return their number.

        Another rig counts from the next try on.

        Raises:
            InvalidRig: The rig cannot be used, or the rules have none of this name.
        """
        values: dict[str, Any] = {
            name: value
            for name in ("project", "asset", "priority")
            if (value := getattr(change, name)) is not None
        }
        if change.rig is not None or change.rig_name is not None:
            values |= self._rig(change)
        films = self._films.ids(self._resolved(where))
        changed = self._changes.change(films, who, values, dict(change.header or {}))
        self._intake.wake()
        logger.info("%s changed %d films of the archive.", who, changed)
        return changed

    def delete(self, where: Where, who: str) -> int:
        """Take films off the list; return their number. Their inspections stay."""
        changed = self._changes.delete(self._resolved(where))
        logger.info("%s took %d films off the list of the archive.", who, changed)
        return changed

    def progress(self, where: Where) -> ArchiveProgress:
        """Return the progress of the selected films as a whole."""
        selection = self._resolved(where)
        tallies = self._films.tallies(selection)
        # What is stored of a running film is some seconds old.
        stored = self._films.running(selection)
        live = sum(
            run.frames_done - stored[film]
            for film in stored
            if (run := self._runs.running(film)) is not None
        )
        rate = throughput(self._films.last_ended(selection, LOOKED_AT))
        left = sum(tallies[state].size for state in _TO_DO if state in tallies)
        return ArchiveProgress(
            states={state: tally.films for state, tally in tallies.items()},
            frames_done=sum(tally.frames_done for tally in tallies.values()) + live,
            frames_total=sum(tally.frames_total for tally in tallies.values()),
            films_done=tallies["done"].films if "done" in tallies else 0,
            fps=rate.fps if rate else None,
            films_per_h=rate.films_per_h if rate else None,
            eta_s=rate.eta_s(left) if rate and left else None,
            engine=self._engine.state(),
            intake=self._intake.state(),
        )

    def failures(self, where: Where) -> list[Group]:
        """Return the selected films that failed or were refused, grouped by reason."""
        return grouped(self._films.failures(self._resolved(where)))

    def _wait(
        self, where: Where, before: Sequence[FilmState], who: str, priority: int | None
    ) -> int:
        changed = self._changes.set_state(
            self._resolved(where), before, "waiting", who, priority=priority
        )
        self._intake.wake()
        return changed

    def _cancelled(self, film: str) -> bool:
        """Stop an inspection; return False if it has ended before."""
        try:
            self._tracking.cancel(film)
        except NotRunning:
            return False
        return True

    def _resolved(self, where: Where) -> Selection:
        """Return a selection without a reason: the database holds whole sentences."""
        if where.reason is None:
            return where.selection
        failures = self._films.failures(where.selection)
        ids = tuple(each.id for each in failures if reason_of(each) == where.reason)
        return replace(where.selection, ids=ids)

    def _rig(self, change: Change) -> dict[str, Any]:
        rig, name = change.rig, change.rig_name
        if rig is None:
            rigs = self.rules().rigs
            if name is None or name not in rigs:
                raise InvalidRig(f"rig_name: there is no rig {name!r} in the rules.")
            rig = rigs[name]
        return {"rig": dict(checked_rig(rig, "The rig")), "rig_name": name}

    def _view(self, row: FilmRow) -> FilmView:
        inspection = row.inspection
        if inspection is None:
            return FilmView(row, Progress())
        run = self._runs.running(inspection.id)
        total = inspection.video.get("frames")
        stored = Progress(inspection.frames_done, total, inspection.fps)
        length_m, u95_m = _end_m(inspection)
        is_useful = self._purpose.get().is_met(length_m, u95_m)
        progress = run.progress() if run else stored
        return FilmView(row, progress, length_m, u95_m, is_useful)


def _end_m(inspection: Inspection) -> tuple[float | None, float | None]:
    """Return distance and half of the 95 % interval of the last frame, as last stored."""
    end_mm, sigma_mm = inspection.corrected_mm, inspection.sigma_corrected_mm
    if end_mm is None:
        end_mm, sigma_mm = inspection.distance_mm, inspection.sigma_distance_mm
    u95_m = None if sigma_mm is None else half_width_m(sigma_mm)
    return (None if end_mm is None else end_mm / 1000), u95_m


def stored_rules(store: RuleStore) -> Rules:
    """Return the stored rules; those of a new archive are empty."""
    return Rules.model_validate(store.get() or {})


def version_of_rules(rules: Rules) -> str:
    """Return the version of rules, which guards against changes of others."""
    return version_of(rules.model_dump(mode="json"))
