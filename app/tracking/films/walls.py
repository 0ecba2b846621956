"""Has the walls of the chunks of a film joined by a child process, which decodes their pictures."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import msgspec

from app.errors import MediaFailed, MediaTimeout
from app.jobs.messages import Batch, Done, Failed, FromWallJoiner, JoinWallsRequest, WallTile
from app.jobs.process import Child, describe_exit

logger = logging.getLogger(__name__)


def joined_walls(request: JoinWallsRequest, stall_s: float) -> Iterator[WallTile]:
    """Yield the tiles of the joined wall.

    Args:
        request: The layers of the chunks, and their places.
        stall_s: Seconds without a tile after which the process is ended.
    Raises:
        MediaFailed: The process died, or a layer cannot be decoded.
        MediaTimeout: It hung.
    """
    decoder: msgspec.msgpack.Decoder[FromWallJoiner] = msgspec.msgpack.Decoder(FromWallJoiner)
    child = Child("app.jobs.track.wall_joiner")
    try:
        child.send(request)
        while True:
            match decoder.decode(child.receive(stall_s)):
                case Batch() as batch:
                    yield from batch.tiles
                case Done():
                    return
                case Failed() as failure:
                    logger.error("The wall is not joined: %s", failure.trace)
                    raise MediaFailed(f"The unrolled wall was not joined: {failure.detail}")
    except TimeoutError as error:
        child.kill()
        raise MediaTimeout("Joining the unrolled wall took too long.") from error
    except (EOFError, BrokenPipeError) as error:
        how = describe_exit(child.end())
        raise MediaFailed(f"The process that joins the unrolled wall died: {how}.") from error
    finally:
        child.end()
