"""The names of a culvert, its ends and its film in exchange files."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import PurePath

from app.reports.exchange.header import Header
from app.reports.report import Loss, Report
from app.reports.text.ascii import one_line
from app.reports.text.naming import ascii_file_name

_CHECKSUM = 6
"""Characters of the checksum after a shortened name."""


@dataclass(frozen=True)
class Names:
    """Names of the culvert and of its ends in a file."""

    asset: str
    start: str
    end: str
    upstream: str
    """Node of the start, or of the end in a survey against the flow."""
    downstream: str

    @property
    def nodes(self) -> tuple[str, ...]:
        """The nodes, the upstream one first, each once."""
        return tuple(dict.fromkeys((self.upstream, self.downstream)))


class FileNames:
    """Makes names that a format can hold, and that are distinct within a file."""

    def __init__(
        self,
        clean: Callable[[str], str] = one_line,
        *,
        longest_asset: int | None = None,
        longest_node: int | None = None,
    ) -> None:
        """Begin a file.

        Args:
            clean: Converts a text for the format.
            longest_asset: Most characters; None for any number. The same holds for `longest_node`.
        """
        self._clean = clean
        self._longest_asset, self._longest_node = longest_asset, longest_node
        self.inspections = 0
        self._assets: dict[str, str] = {}
        """Each as it is written; the same holds for the nodes."""
        self._nodes: dict[str, str] = {}

    def add(self, report: Report, header: Header) -> tuple[Names, list[Loss]]:
        """Return the names of an inspection, and losses for those that are shortened or invented.

        The stand-in for a missing name has the number of a further inspection: two culverts do not
        meet because nobody named their ends.
        """
        losses = []
        self.inspections += 1
        number = f"-{self.inspections}" if self.inspections > 1 else ""
        stated = {name: header.text(name) for name in ("start_node", "end_node")}
        for name, stand_in in (("start_node", f"START{number}"), ("end_node", f"END{number}")):
            if not self._clean(stated[name]):
                losses.append(Loss(f"no_{name}", written=stand_in))
                stated[name] = stand_in
        asset = header.text("asset_id") or report.asset
        if not self._clean(asset):
            asset = f"ASSET{number}"
            losses.append(Loss("no_asset_name", written=asset))
        nodes = self._fitted(stated.values(), self._longest_node, self._nodes)
        assets = self._fitted([asset], self._longest_asset, self._assets)
        for name, short in (nodes | assets).items():
            if short != name:
                losses.append(Loss("renamed", name=one_line(name), written=short))
        start, end = (nodes[name] for name in stated.values())
        is_against = report.header.get("direction") == "against_flow"
        up, down = (end, start) if is_against else (start, end)
        for name, own in (("upstream_node", up), ("downstream_node", down)):
            if nodes.get(str(report.header.get(name))) == own:
                header.note_written(name)  # the direction shows which is which
        return Names(assets[asset], start, end, up, down), losses

    def _fitted(
        self, names: Iterable[str], longest: int | None, known: dict[str, str]
    ) -> dict[str, str]:
        """Fit each name to the format; a shortened or ambiguous one ends with its checksum."""
        for name in names:
            if name in known:
                continue
            short = self._clean(name)
            if (longest is not None and len(short) > longest) or short in known.values():
                digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()
                room = None if longest is None else longest - _CHECKSUM - 1
                short = f"{short[:room]}-{digest[:_CHECKSUM]}"
            known[name] = short
        return {name: known[name] for name in names}


def film(report: Report) -> str:
    """Return the name of the film without a folder, of an import as its file has it; empty if
    there is none.
    """
    if report.extras.film_called is not None:
        return report.extras.film_called
    if report.source.kind == "import":
        names = film_names(str(report.header.get("video_files") or ""))
        return names[0] if names else ""
    if report.source.kind == "upload":
        return film_name(report.source.filename)
    return film_name(f"{report.asset}.mkv") if report.source.sha256 else ""


def film_in_ascii(report: Report) -> str:
    """Return the name of the film in Latin letters; of an import, whose film is elsewhere, as it
    is.
    """
    name = film(report)
    return ascii_file_name(name) if name and report.source.kind != "import" else name


def film_renaming(report: Report, name: str) -> list[Loss]:
    """Return the loss where the file gives the film another name."""
    stated = {
        "upload": report.source.filename,
        "import": str(report.header.get("video_files") or ""),
    }.get(report.source.kind, "")
    own = one_line(_without_folder(stated))
    if not name or own in ("", name):
        return []
    return [Loss("film_renamed", name=own, written=name)]


def film_names(stated: str) -> list[str]:
    """Return the names of films in a field of the header, without their folders."""
    parts = (one_line(_without_folder(part)) for part in re.split(r"[,;|]", stated))
    return [name for name in parts if name]


def _without_folder(path: str) -> str:
    return PurePath(path.replace("\\", "/")).name


def film_name(path: str) -> str:
    """Return the name by which a file cites a film: one word with an extension."""
    name = unicodedata.normalize("NFC", _without_folder(path))
    safe = re.sub(r"[^\w.-]+", "_", one_line(name)).strip("._")
    return safe if re.search(r"\.[A-Za-z0-9]{1,5}$", safe) else f"{safe}.mp4" if safe else ""
