"""Takes a picture of a camera before it is recorded, in a child process."""

from __future__ import annotations

from app.errors import CameraUnreachable
from app.jobs.live.glance import GlanceRequest
from app.jobs.messages import Limits
from app.jobs.permits import Permits
from app.jobs.process import Child, Died, Refused, Stalled
from app.tracking.cameras import Sources

CPU_S = 60
_ANSWER_TIMEOUT_S = 20.0


class Glances:
    """Looks at one camera at a time; nothing is stored."""

    def __init__(self, sources: Sources, limits: Limits) -> None:
        self._sources = sources
        self._limits = limits
        self._permits = Permits("Another camera is being looked at; try again in a moment.")

    def picture(self, url: str, size_wh: tuple[int, int]) -> bytes:
        """Return a picture of a camera as JPEG.

        Args:
            url: The address given by the user.
            size_wh: Requested picture size, for cameras that offer several.
        Raises:
            LiveSourceRefused: The server does not open this source.
            CameraUnreachable: It gives no picture; the text says why.
            Busy: Another camera is being looked at.
        """
        source = self._sources.resolve(url, size_wh)
        with self._permits, Child("app.jobs.live.glance") as child:
            request = GlanceRequest(source.camera, self._limits)
            try:
                return child.ask(request, bytes, stall_s=_ANSWER_TIMEOUT_S)
            except (Stalled, Died) as fault:
                raise CameraUnreachable("The camera does not answer in time.") from fault
            except Refused as refusal:
                refusal.log("A test picture")
                raise CameraUnreachable(str(refusal)) from refusal
