"""Whether a finding is one that is known: by its kind and its place on the wall."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from app.survey.findings.records import Finding, Proposal

MARGIN_MM = 25.0
"""How far two searches, or two runs of the odometry over the same film, may place one defect
apart. Less than the smallest distance at which a person would tag two of a kind."""

SAME = 0.5
"""Share of a finding that must lie on a known one. A piece of what was rejected is not offered
again; what goes on for more than as long again is."""


class Places:
    """The known findings, by where they are along the pipe."""

    def __init__(self, known: Iterable[Finding]) -> None:
        self._cells: dict[tuple[str, int], list[Finding]] = {}
        for each in known:
            for cell in _cells(each):
                self._cells.setdefault(cell, []).append(each)

    def of(self, found: Proposal) -> Finding | None:
        """Return the known finding that covers most of `found`; None if it is a new one."""
        near = {id(each): each for cell in _cells(found) for each in self._cells.get(cell, ())}
        best = max(near.values(), key=lambda each: covered(found, each), default=None)
        return best if best is not None and covered(found, best) >= SAME else None


def covered(found: Proposal, known: Proposal) -> float:
    """Return the share of the box of `found` that lies on that of `known`, both with a margin."""
    mine, other = _grown(found), _grown(known)
    common = _area(
        (max(mine[0], other[0]), max(mine[1], other[1]), min(mine[2], other[2]),
         min(mine[3], other[3]))
    )  # fmt: skip
    return common / _area(mine)


def _grown(found: Proposal) -> Sequence[float]:
    x0, y0, x1, y1 = found.box_mm
    half = MARGIN_MM / 2
    return x0 - half, y0 - half, x1 + half, y1 + half


def _area(box: Sequence[float]) -> float:
    return max(box[2] - box[0], 0.0) * max(box[3] - box[1], 0.0)


_CELL_MM = 500.0


def _cells(found: Proposal) -> list[tuple[str, int]]:
    first, _, last, _ = _grown(found)
    return [(found.kind, cell) for cell in range(int(first // _CELL_MM), int(last // _CELL_MM) + 1)]
