"""The process that joins the unrolled walls of the chunks of a film; it decodes their pictures."""

from __future__ import annotations

from pathlib import Path

from app.jobs.child import Parent, serve
from app.jobs.track.messages import JoinWallsRequest


def _join(request: JoinWallsRequest, parent: Parent) -> None:
    # Imported here so that the decoders are loaded under the limits.
    from app.jobs.track.chunks import join_walls
    from vo_core import Rig

    folders = [Path(folder) for folder in request.folders]
    indices = [[int(path.stem) for path in folder.iterdir()] for folder in folders]

    def read(number: int, index: int) -> bytes | None:
        path = folders[number] / f"{index}.png"
        return path.read_bytes() if path.exists() else None

    for tile in join_walls(request.placed, Rig.parse(request.rig), indices, read):
        parent.send(tile)


if __name__ == "__main__":
    serve(JoinWallsRequest, _join, named="Joining the walls", reads=lambda request: request.folders)
