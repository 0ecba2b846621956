"""Films tracked by a cluster: the same results, whoever is killed on the way."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from builders import Client, children_of, make_clip, results_of, serving, wait_until
from clusters import Cluster, cluster
from surveys import Survey

FRAMES = 260


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_clip(tmp_path_factory.mktemp("film") / "film.mp4", FRAMES)


@pytest.fixture(scope="module")
def local(film: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The results of this machine alone."""
    with serving(tmp_path_factory.mktemp("local")) as client:
        return client.results(client.tracked(film))


@pytest.fixture(scope="module")
def workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with cluster(tmp_path_factory.mktemp("workers"), 2) as running:
        yield running


@pytest.fixture
def served(workers: Cluster, tmp_path: Path) -> Iterator[Client]:
    with serving(tmp_path / "data", **workers.settings) as client:
        yield client


def busy_workers(workers: Cluster) -> list[int]:
    """Indices of the workers that have a tracking process."""
    return [
        n
        for n, worker in enumerate(workers.workers)
        if worker.poll() is None
        and any("app.jobs.track.tracker" in command for command in children_of(worker.pid).values())
    ]


def test_films_give_what_this_machine_gives_although_a_worker_is_killed(
    served: Client, workers: Cluster, clip: Path, survey: Survey, *, is_long: bool
) -> None:
    ids = [served.inspect(clip) for _ in range(2 if is_long else 1)]
    killed = workers.workers.pop(wait_until(lambda: busy_workers(workers))[0])
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    for inspection_id in ids:
        assert served.wait(inspection_id)["status"] == "done"
        assert served.results(inspection_id) == results_of(survey.folder)
        runs = served.data / "inspections" / inspection_id / "runs"
        wait_until(lambda runs=runs: not runs.exists())  # nothing is left of what was on the way


def test_a_run_shows_its_progress_and_can_be_stopped(served: Client, long_clip: Path) -> None:
    inspection_id = served.inspect(long_clip)
    wait_until(lambda: served.inspection(inspection_id)["progress"]["frames_done"])
    served.post(f"/api/inspections/{inspection_id}/cancel").raise_for_status()
    ended = served.wait(inspection_id)
    assert ended["status"] == "cancelled"
    assert "chainage_tracked_frames_total 0.0" not in served.get("/metrics").text
    assert 0 < ended["progress"]["frames_done"] < ended["progress"]["frames_total"]


def test_a_worker_reads_the_burnt_in_counter(served: Client, workers: Cluster, clip: Path) -> None:
    def reading() -> bool:
        commands = (children_of(each.pid).values() for each in workers.workers)
        return any("app.jobs.requests.counter" in each for some in commands for each in some)

    inspection_id = served.tracked(clip)
    path = f"/api/inspections/{inspection_id}/counter"
    served.put(path, json={}).raise_for_status()
    wait_until(reading)
    wait_until(lambda: served.get(path).json()["state"] == "not_found")


def test_without_a_worker_films_wait_in_the_queue_and_say_why(
    tmp_path: Path, long_clip: Path
) -> None:
    def told(client: Client) -> str:
        checks = client.get("/readyz").raise_for_status().json()["checks"]
        return str(next(check["detail"] for check in checks if check["name"] == "tracking"))

    with cluster(tmp_path / "cluster", 1) as few, serving(
        tmp_path / "data", **few.settings
    ) as client:  # fmt: skip
        ids = [client.inspect(long_clip) for _ in "12"]
        wait_until(lambda: busy_workers(few))
        assert [client.inspection(each)["status"] for each in ids] == ["running", "queued"]
        few.workers[0].kill()
        few.workers[0].wait()
        wait_until(lambda: told(client) == "The cluster has no worker. 2 films wait.")
        for inspection_id in ids:
            inspection = client.inspection(inspection_id)
            assert inspection["status"] == "queued"
            assert "no worker" in inspection["warning"]
        few.workers[:] = [few.add_worker()]
        wait_until(lambda: busy_workers(few))


@pytest.mark.long
def test_a_scheduler_that_is_killed_costs_a_wait(
    served: Client, workers: Cluster, film: Path, local: dict[str, bytes]
) -> None:
    inspection_id = served.inspect(film)
    wait_until(lambda: busy_workers(workers))
    workers.scheduler.send_signal(signal.SIGKILL)
    workers.scheduler.wait()
    assert served.get("/healthz").status_code == 200
    for worker in workers.workers:
        worker.kill()
        worker.wait()
    workers.workers.clear()
    workers.start_scheduler()
    workers.add_worker()
    assert served.wait(inspection_id)["status"] == "done"
    assert served.results(inspection_id) == local


@pytest.mark.long
def test_a_server_that_comes_back_goes_on(
    workers: Cluster, film: Path, local: dict[str, bytes], tmp_path: Path
) -> None:
    with serving(tmp_path / "data", **workers.settings) as client:
        inspection_id = client.inspect(film)
        wait_until(lambda: client.inspection(inspection_id)["progress"]["frames_done"])
    with serving(tmp_path / "data", **workers.settings) as client:
        assert client.wait(inspection_id)["status"] == "done"
        assert client.results(inspection_id) == local
