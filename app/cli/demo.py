"""`chainage demo`: the dashboard with a sample culvert inspection that starts when it is opened."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from app.errors import SampleFailed
from app.inspections.films.samples import Samples
from app.inspections.presence import Presence
from app.main import listening, run
from app.services import Services
from app.settings import MIB, Settings
from app.tracking.films.queue import Tracking

DISK_RESERVE_BYTES = 8 * MIB
"""The demo needs some 30 MiB of a temporary folder, which is often small and in memory."""


def run_demo(
    host: str,
    port: int,
    *,
    on_progress: Callable[[int, int], None],
    on_ready: Callable[[str, Path], None],
) -> None:
    """Serve until a signal, with a sample that is rendered first; leave nothing behind.

    Args:
        host, port: Where to listen.
        on_progress: Called while the sample is rendered, with frames done and the total.
        on_ready: Called once with the address that logs in and opens the sample, and the data
            folder.
    Raises:
        AddressNotAvailable, InvalidSettings, OpenToTheNetwork: Raised before anything is rendered.
    """
    with ExitStack() as stack:
        folder = stack.enter_context(TemporaryDirectory(prefix="chainage-demo-"))
        settings = Settings.load(
            data=Path(folder) / "data",
            disk_reserve_bytes=DISK_RESERVE_BYTES,
            pace=1.0,  # the speed of the camera: people can watch the robot drive
        )
        listener = stack.enter_context(listening(settings, host, port))

        def ready(url: str, services: Services) -> None:
            # The robot waits until somebody watches, or it would have passed the first crack.
            services[Tracking].hold()
            services[Presence].on_first(services[Tracking].release)
            services[Samples].start()
            sample = services[Samples].wait(on_progress)
            if sample.fault is not None:
                raise SampleFailed(sample.fault)
            if sample.inspection_id is not None:  # otherwise a signal stopped it
                on_ready(_opening(url, sample.inspection_id), settings.data)

        run(settings, host, listener, ready)


def _opening(login_url: str, inspection_id: str) -> str:
    return f"{login_url}{'&' if '?' in login_url else '?'}next=/inspections/{inspection_id}"
