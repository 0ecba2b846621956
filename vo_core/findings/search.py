"""Searches the wall patch by patch, and joins what lies on more than one of them."""

from __future__ import annotations

from collections.abc import Iterable

from vo_core.findings.finding import Detector, Finding
from vo_core.findings.merging import Joined
from vo_core.findings.patches import WallPatch


def propose(detector: Detector, patches: Iterable[WallPatch]) -> list[Finding]:
    """Search a whole wall.

    Args:
        detector: What looks at each patch.
        patches: In ascending order along the pipe.
    Returns:
        Its findings in the order of their places, each once.
    """
    search = Search(detector)
    found = [finding for patch in patches for finding in search.add(patch)]
    return sorted(found + search.finish(), key=lambda finding: finding.axial_range_mm)


class Search:
    """Searches the wall while it grows; memory does not grow with the wall.

    Each block is added once, when none of its `tiles_of` will change any more.
    """

    def __init__(self, detector: Detector) -> None:
        self._detector = detector
        self._joined = Joined()

    def add(self, patch: WallPatch) -> list[Finding]:
        """Search a patch, and return the findings that are complete, each once."""
        return self._joined.add(patch, self._detector.propose(patch))

    def finish(self) -> list[Finding]:
        """Return the findings that were waiting for the next patch."""
        return self._joined.finish()
