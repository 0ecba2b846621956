"""The commands of `chainage archive`: many films at once."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from app.cli.console import Data, data_folder, err, out, print_address, print_rows, settings_of

if TYPE_CHECKING:
    from app.cli.client import Api  # slow to import

commands = typer.Typer(
    help="Many films at once: add them by rules, track them, repair what failed. With the server "
    "that uses the data folder, or without one.",
    no_args_is_help=True,
)

State = Literal[
    "unassigned", "ready", "waiting", "paused", "refused",
    "queued", "running", "done", "failed", "cancelled",
]  # fmt: skip
"""As `app.storage.archive.selection.FilmState`, which is slow to import."""
Search = Annotated[
    str | None, typer.Option(help="Only films with this text in name, path, project or asset.")
]
Project = Annotated[str | None, typer.Option(help="Only films of this project.")]
Asset = Annotated[str | None, typer.Option(help="Only films of this asset.")]
OfState = Annotated[State | None, typer.Option(help="Only films of this state.")]
Reason = Annotated[
    str | None, typer.Option(help="Only films that failed for this reason, as `status` prints it.")
]
Ids = Annotated[list[str] | None, typer.Argument(help="Ids of films; all of them without any.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]

_LOOK_EVERY_S = 0.5
_ILLEGIBLE = "\N{REPLACEMENT CHARACTER}"
_UNDER_WAY = ("waiting", "queued", "running")
_FAILED = ("failed", "refused", "cancelled")
_REPAIRS = {
    "rig": "give them another rig: chainage archive retry --reason ... --rig RIG.json",
    "retry": "try again: chainage archive retry --reason ...",
    "film": "repair or replace the films, then chainage archive retry --reason ...",
}


@commands.command()
def add(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER|LIST",
            help="Folder of films, a film, a text file with one path a line, or a CSV with the "
            "column path and, if wanted, name, project, asset, rig and fields of the header.",
        ),
    ],
    rig: Annotated[Path | None, typer.Option(help="Rig file of all the films.")] = None,
    rules: Annotated[
        Path | None, typer.Option(help="Rules (JSON) for these films.  [default: the stored ones]")
    ] = None,
    header: Annotated[
        Path | None,
        typer.Option(
            help="CSV with the column file or asset_id, and the fields of the header of each film."
        ),
    ] = None,
    priority: Annotated[
        int | None, typer.Option(min=-9, max=9, help="Priority of all the films; higher first.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show what each film would get; change nothing.")
    ] = False,
    data: Data = None,
) -> None:
    """Add films; `run` tracks them. Films that are in the archive already stay as they are."""
    from app.archive.paths import text_of
    from app.cli.films_to_add import read_rules, read_source, rules_of_rig
    from app.errors import InvalidTable
    from vo_core.csv_rows import decoded

    if rig is not None and rules is not None:
        raise typer.BadParameter("goes without --rules", param_hint="--rig")
    films = read_source(source)
    body: dict[str, Any] = {"paths": [text_of(path) for path in films.paths]}
    faults = list(films.missing)
    if rig is not None:
        body["rules"] = rules_of_rig(rig)
    if rules is not None:
        body["rules"], more = read_rules(rules)
        faults += more
    if films.list_csv is not None:
        body["list_csv"] = films.list_csv
    if header is not None:
        body["header_csv"] = decoded(header.read_bytes(), InvalidTable)
    if priority is not None:
        body["priority"] = priority
    with err.status("looking at films"), _api(data, films.folders) as api:
        if films.rigs:
            stated = body.get("rules") or api.ask("GET", "/archive/rules")
            body["rules"] = stated | {"rigs": stated.get("rigs", {}) | films.rigs}
        found = api.ask("POST", f"/archive/films{'/preview' if dry_run else ''}", json=body)
    _print_additions(found, dry_run)
    for sentence in (*faults, *found["warnings"]):
        err.print(f"warning: {sentence}", style="yellow")
    if not found["found"]:
        err.print(f"chainage: No film was found in {source}.", style="red")
        raise typer.Exit(1)


@commands.command("list")
def list_films(
    search: Search = None,
    state: OfState = None,
    project: Project = None,
    asset: Asset = None,
    reason: Reason = None,
    offset: Annotated[int, typer.Option(min=0, help="Films to skip.")] = 0,
    limit: Annotated[int, typer.Option(min=1, max=500, help="Films to list at most.")] = 100,
    as_json: AsJson = False,
    data: Data = None,
) -> None:
    """List films with their state."""
    query = _filters(search, state, project, asset, reason) | {"offset": offset, "limit": limit}
    with _api(data) as api:
        found = api.ask("GET", "/archive/films", params=query)
    if as_json:
        out.print_json(json.dumps(found))
        return
    _print_table(
        ("state", "id", "project", "asset", "name", "rig", "distance (m)", "error"),
        map(_listed, found["films"]),
    )
    err.print(f"{len(found['films'])} of {found['total']} films.")


@commands.command()
def status(
    as_json: AsJson = False,
    search: Search = None,
    project: Project = None,
    asset: Asset = None,
    data: Data = None,
) -> None:
    """Show how far the films are, how fast they are tracked, and why some failed."""
    query = _filters(search, None, project, asset, None)
    with _api(data) as api:
        progress = api.ask_patiently("GET", "/archive/progress", params=query)
        failures = api.ask("GET", "/archive/failures", params=query)
    if as_json:
        out.print_json(json.dumps({"progress": progress, "failures": failures["groups"]}))
        return
    states = progress["states"]
    print_rows((state, str(states[state])) for state in get_args(State) if state in states)
    out.print(_speed(progress) or "Too few films have been tracked to say how fast.")
    if hindrance := _hindrance(progress):
        err.print(f"warning: {hindrance}", style="yellow")
    _print_failures(failures["groups"])


@commands.command()
def run(
    search: Search = None,
    project: Project = None,
    asset: Asset = None,
    data: Data = None,
) -> None:
    """Track all films that are ready, and show the progress until none is left.

    Ends with 0 if all of them are done. Without a server it serves the page meanwhile. Ctrl+C stops
    it, and the next run goes on.
    """
    query = _filters(search, None, project, asset, None)
    with _api(data, tracks=True) as api:
        try:
            started = api.ask("POST", "/archive/start", json={"where": query})["changed"]
            separator = "&" if "?" in api.page else "?"
            page = f"{api.page}{separator}next=/archive" if api.is_own else api.page
            print_address(err, page, data_folder(data))
            err.print(f"{started} films started.")
            states = _follow(api, query)
        except KeyboardInterrupt:
            err.print(
                "Stopped; the next run goes on." if api.is_own else "The server goes on with them."
            )
            raise typer.Exit(1) from None
        groups = api.ask_patiently("GET", "/archive/failures", params=query)["groups"]
    counts = ", ".join(f"{number} {state}" for state, number in states.items())
    out.print(f"Films: {counts or 'none'}.")
    if "unassigned" in states:
        err.print("warning: films without a rig were not tracked", style="yellow")
    _print_failures(groups)
    if any(state in states for state in _FAILED):
        raise typer.Exit(1)


@commands.command()
def retry(
    ids: Ids = None,
    search: Search = None,
    state: OfState = None,
    project: Project = None,
    asset: Asset = None,
    reason: Reason = None,
    rig: Annotated[Path | None, typer.Option(help="Rig file to give them first.")] = None,
    outdated: Annotated[
        bool, typer.Option("--outdated", help="Films that an older version of Chainage tracked.")
    ] = False,
    data: Data = None,
) -> None:
    """Let films that failed, were cancelled or refused wait for another try."""
    from app.cli.films_to_add import rules_of_rig

    old = {"outdated": True} if outdated else {}
    films = _meant(ids, _filters(search, state, project, asset, reason) | old)
    is_stated = ids or state or outdated
    parts = [films] if is_stated else [{"where": films["where"] | {"state": it}} for it in _FAILED]
    change = None
    if rig is not None:
        (given,) = rules_of_rig(rig)["rigs"].values()
        change = {"rig": given, "rig_name": rig.name}
    changed = 0
    with _api(data) as api:
        for part in parts:
            if change is not None:
                api.ask("PATCH", "/archive/films", json=part | {"set": change})
            changed += api.ask("POST", "/archive/retry", json=part)["changed"]
        is_served = not api.is_own
    goes_on = "" if is_served or not changed else " `chainage archive run` tracks them."
    out.print(f"{changed} films wait for another try.{goes_on}")


def _acting(action: str, done: str) -> Callable[..., None]:
    """Return a command that does something with the films that are meant."""

    def act(
        ids: Ids = None,
        search: Search = None,
        state: OfState = None,
        project: Project = None,
        asset: Asset = None,
        data: Data = None,
    ) -> None:
        films = _meant(ids, _filters(search, state, project, asset, None))
        with _api(data) as api:
            changed = api.ask("POST", f"/archive/{action}", json=films)["changed"]
        out.print(f"{changed} films {done}.")

    return act


commands.command(
    "pause", help="Stop films that wait or are being tracked, until `run` starts them again."
)(_acting("pause", "paused"))
commands.command("cancel", help="Stop films that wait, are paused or are being tracked.")(
    _acting("cancel", "cancelled")
)


@commands.command()
def rules(
    file: Annotated[
        Path | None, typer.Argument(help="Rules (JSON) to store; without it they are printed.")
    ] = None,
    data: Data = None,
) -> None:
    """Store the rules that `add` and the inbox use, or print them."""
    from app.cli.films_to_add import read_rules

    if file is None:
        with _api(data) as api:
            out.print_json(json.dumps(api.ask("GET", "/archive/rules")))
        return
    stated, faults = read_rules(file)
    for sentence in faults:
        err.print(f"warning: {sentence}", style="yellow")
    with _api(data) as api:
        stored = api.ask("PUT", "/archive/rules", json=stated)
    out.print(f"{len(stored['rules'])} rules and {len(stored['rigs'])} rigs are stored.")


@contextmanager
def _api(data: Path | None, folders: Sequence[Path] = (), *, tracks: bool = False) -> Iterator[Api]:
    from app.cli.client import api

    with api(settings_of(data), folders, tracks=tracks) as opened:
        yield opened


def _filters(
    search: str | None,
    state: str | None,
    project: str | None,
    asset: str | None,
    reason: str | None,
) -> dict[str, Any]:
    given = {
        "search": search, "state": state, "project": project, "asset": asset, "reason": reason,
    }  # fmt: skip
    return {name: value for name, value in given.items() if value is not None}


def _meant(ids: list[str] | None, where: dict[str, Any]) -> dict[str, Any]:
    if ids and where:
        raise typer.BadParameter("go without filters", param_hint="IDS")
    return {"ids": ids} if ids else {"where": where}


def _follow(api: Api, query: Mapping[str, Any]) -> dict[str, int]:
    """Show the progress until no film is under way; return the number of films of each state."""
    columns = (MofNCompleteColumn(), BarColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=err) as bar:
        task, ended_before = bar.add_task("films", total=None), None
        while True:
            progress = api.ask_patiently("GET", "/archive/progress", params=query)
            states: dict[str, int] = progress["states"]
            left = sum(states.get(state, 0) for state in _UNDER_WAY)
            ended = sum(states.get(state, 0) for state in ("done", *_FAILED))
            ended_before = ended if ended_before is None else ended_before
            bar.update(
                task,
                completed=ended - ended_before,
                total=max(left + ended - ended_before, 1),
                description=_hindrance(progress) or _speed(progress) or "films",
            )
            if not left:
                return states
            time.sleep(_LOOK_EVERY_S)


def _hindrance(progress: Mapping[str, Any]) -> str | None:
    """Return why the films do not get on."""
    hindrance: str | None = progress["intake"]["hindrance"] or progress["engine"]["problem"]
    return hindrance


def _speed(progress: Mapping[str, Any]) -> str:
    """Return throughput and time left as words."""
    words = []
    if progress["fps"] is not None:
        words.append(f"{progress['fps']:.0f} frames/s, {progress['films_per_h']:.0f} films/h")
    if progress["eta_s"] is not None:
        words.append(f"{_duration(progress['eta_s'])} left")
    return ", ".join(words)


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60)
    if minutes < 1:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def _print_additions(found: Mapping[str, Any], dry_run: bool) -> None:
    if dry_run:
        names = ("path", "rule", "rig_name", "project", "asset", "problem")
        _print_table(
            ("film", "rule", "rig", "project", "asset", "problem"),
            ([film[name] for name in names] for film in found["films"]),
        )
    else:
        for film in found["films"]:
            if film["problem"] and film["name"] and film["rig_name"] is None:
                err.print(f"{_line(film['path'])}: {film['problem']}", style="yellow")
    verb = "would be added" if dry_run else "added"
    out.print(
        f"{found['found']} films found: {found['new']} {verb}, {found['known']} known already."
    )


def _print_table(titles: Sequence[str], rows: Iterable[Sequence[str | None]]) -> None:
    """Print columns as wide as they are, for terminals and programs alike."""
    cells = [titles, *([_line(cell) for cell in row] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    for row in cells:
        line = "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        out.print(line.rstrip())


def _listed(film: Mapping[str, Any]) -> list[str | None]:
    distance_m, error = film["distance_m"], film["error"]
    names = ("state", "id", "project", "asset", "name", "rig_name")
    return [
        *(film[name] for name in names),
        None if distance_m is None else f"{distance_m:.3f}",
        error and error["detail"],
    ]


def _line(text: str | None) -> str:
    """Return text in one line: a file name may contain anything."""
    return "".join(char if char.isprintable() else _ILLEGIBLE for char in text or "")


def _print_failures(groups: list[dict[str, Any]]) -> None:
    for group in groups:
        out.print(f"{group['count']} x {group['code']}: {group['reason']}")
        if group["repair"]:
            out.print(f"    {_REPAIRS[group['repair']]}")
