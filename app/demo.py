"""`chainage demo`: the dashboard with a sample culvert inspection that starts by itself."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from app.main import listening, run
from app.services.container import Services
from app.settings import MIB, Settings
from app.simulation import SCENARIOS, SimulatedRun, simulate
from vo_core import Rig

SAMPLE = SCENARIOS["nominal"].shortened(3600)
"""Long enough to watch, short enough to be rendered while one waits."""

DISK_RESERVE_BYTES = 8 * MIB
"""The demo needs some 20 MiB of a temporary folder, which often lies in memory and is small."""

SAMPLE_HEADER = {
    "asset_id": "CUL-0001",
    "start_node": "Inlet headwall",
    "end_node": "Outlet headwall",
    "direction": "with flow",
    "operator": "Demo",
    "reference_point": "inner face of the headwall at the start",
}


def run_demo(
    host: str,
    port: int,
    *,
    on_progress: Callable[[int, int], None],
    on_ready: Callable[[str], None],
) -> None:
    """Render the sample, then serve until a signal; nothing is left behind.

    Args:
        host, port: Where to listen.
        on_progress: Called while the sample is rendered, with frames done and frames in all.
        on_ready: Called once with the address that logs in and opens the sample.
    Raises:
        AddressNotAvailable, InvalidSettings: Known before anything is rendered.
    """
    with (
        listening(host, port) as listener,
        TemporaryDirectory(prefix="chainage-demo-") as folder,
    ):
        settings = Settings.load(
            data=Path(folder) / "data",
            disk_reserve_bytes=DISK_RESERVE_BYTES,
            pace=1.0,  # the speed of the camera: one can watch the robot drive
        )
        sample = simulate(SAMPLE, Path(folder) / "sample", on_progress)

        def ready(url: str, services: Services) -> None:
            on_ready(_opening(url, _add_sample(services, sample)))

        run(settings, host, listener, ready)


def _add_sample(services: Services, sample: SimulatedRun) -> str:
    return services.inspections.import_video(
        sample.video, Rig.load(sample.rig), "Sample culvert", SAMPLE_HEADER
    )


def _opening(login_url: str, inspection_id: str) -> str:
    return f"{login_url}{'&' if '?' in login_url else '?'}next=/inspections/{inspection_id}"
