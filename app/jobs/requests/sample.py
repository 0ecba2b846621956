"""The process that renders the sample inspection into a folder and reports its progress."""

from __future__ import annotations

from pathlib import Path

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import Limits, Progress


class SampleRequest(msgspec.Struct, frozen=True):
    """Render the sample; its progress comes before the answer, which is None."""

    folder: str
    length_mm: float
    limits: Limits


def _render(request: SampleRequest, parent: Parent) -> None:
    # Imported here so that the encoder is loaded under the limits.
    from app.lab.simulation import simulate
    from app.lab.simulation.sample import SAMPLE

    simulate(
        SAMPLE.shortened(request.length_mm),
        Path(request.folder),
        lambda done, total: parent.send(Progress(done, total)),
    )


if __name__ == "__main__":
    serve(SampleRequest, _render, named="Rendering", writes=lambda request: [request.folder])
