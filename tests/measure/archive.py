"""Measures the archive on this machine and writes the tables of docs/archive_measured.md; no test.

    python tests/measure archive [equal throughput queue kills]

`equal`: a folder of short films of mixed quality, some broken, is processed by `chainage archive`
on this machine, and on a cluster of two workers with PostgreSQL and an S3 store, where a worker
and the database are killed on the way; the results are compared to the byte.
`throughput`: frames a second of 1 and 2 workers, against as many processes that do the same work
in a plain loop.
`queue`: 10,000 films in the list: memory and time of the server's side.
`kills`: worker, scheduler, server and database are killed by turns while films are tracked.
"""

# ruff: noqa: T201
from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import re
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import httpx
from archive_films import film_of, make_films
from builders import half_size
from clusters import Cluster, cluster
from object_stores import moto
from postgres import PostgresServer, postgres_server

from app.data_folder import reading
from app.jobs.track.follow import Follower
from app.lab.markdown_figures import write_figures
from app.lab.simulation import SCENARIOS
from app.settings import Settings
from vo_core import Rig, VideoFile

PAGE = Path(__file__).parents[2] / "docs" / "archive_measured.md"
TOKEN = "measured-by-a-script"  # noqa: S105
CHAINAGE = [str(Path(sys.executable).with_name("chainage"))]
SHORT_MM, LONG_MM = 600.0, 15_000.0
PATIENCE_S = 1800.0
Rows = list[tuple[str, ...]]


@dataclass
class Site:
    """Where one archive is: a data folder, and what its server uses besides."""

    data: Path
    settings: dict[str, str] = field(default_factory=dict)

    @property
    def environment(self) -> dict[str, str]:
        """Environment of a server or a command."""
        return (
            os.environ | {"CHAINAGE_TOKEN": TOKEN, "CHAINAGE_DATA": str(self.data)} | self.settings
        )

    def chainage(self, *words: object) -> subprocess.CompletedProcess[str]:
        """Run a command to its end."""
        return subprocess.run(
            [*CHAINAGE, *map(str, words)],
            env=self.environment, capture_output=True, text=True, timeout=PATIENCE_S,
        )  # fmt: skip

    def results(self) -> dict[str, tuple[str, str]]:
        """Return state and digest of every film by its name; the digest leaves out ids."""
        listed = json.loads(self.chainage("archive", "list", "--json", "--limit", 500).stdout)
        found = {}
        url, store = self.settings.get("CHAINAGE_DATABASE"), self.settings.get("CHAINAGE_STORE")
        with reading(Settings(data=self.data, database_url=url, store=store)) as records:
            for film in listed["films"]:
                name = Path(film["path"]).name
                digest = hashlib.sha256()
                if film["inspection_id"]:
                    track = records.tracks.get(film["inspection_id"])
                    digest.update(re.sub(r"(?m)^#.*\n", "", track.to_csv({})).encode())
                    for tile in records.unrolled.tiles(film["inspection_id"]):
                        picture = records.unrolled.picture(film["inspection_id"], tile.index)
                        digest.update(picture)
                found[name] = (film["state"], digest.hexdigest())
        return found


@contextmanager
def big_site(folder: Path, workers: int) -> Iterator[tuple[Site, Cluster, PostgresServer]]:
    """A site with a cluster, PostgreSQL that syncs, and an S3 store."""
    with ExitStack() as stack:
        store = stack.enter_context(moto())
        database = stack.enter_context(postgres_server(is_safe=True))
        running = stack.enter_context(cluster(folder / "workers", workers))
        settings = {
            f"CHAINAGE_{name.upper()}": str(value) for name, value in running.settings.items()
        }
        settings |= {"CHAINAGE_STORE": store.new(), "CHAINAGE_DATABASE": database.new_database()}
        yield Site(folder / "cluster", settings), running, database


def equal(folder: Path, count: int) -> Rows:
    """Process the same films twice and compare."""
    rules = make_films(folder / "films", count, SHORT_MM)
    here = Site(folder / "here", {"CHAINAGE_MAX_JOBS": "2"})
    add = ("archive", "add", folder / "films", "--rules", rules)
    print(here.chainage(*add).stdout.strip()[-200:])
    began_s = time.monotonic()
    here.chainage("archive", "run")
    here_s = time.monotonic() - began_s
    alone = here.results()
    with big_site(folder, 2) as (site, workers, database):
        site.chainage(*add)
        began_s = time.monotonic()
        run = subprocess.Popen([*CHAINAGE, "archive", "run"], env=site.environment, text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)  # fmt: skip

        def disturb() -> None:
            wait_for_done(site, count // 4)
            workers.workers.pop(0).kill()
            workers.add_worker()
            wait_for_done(site, count // 2)
            database.kill()
            database.start()

        disturber = threading.Thread(target=disturb)
        disturber.start()
        output, _ = run.communicate(timeout=PATIENCE_S)
        disturber.join()
        while (counts := states(site)).get("waiting", 0) + counts.get("running", 0):
            output = site.chainage("archive", "run").stdout  # the database was away for too long
        there_s = time.monotonic() - began_s
        there = site.results()
    differing = differences(alone, there)
    print(output[-600:], differing[:5])
    counted = Counter(state for state, _ in alone.values())
    return [
        ("films", str(len(alone))),
        (
            "states on this machine",
            ", ".join(f"{n} {state}" for state, n in sorted(counted.items())),
        ),
        ("time on this machine, 2 jobs", f"{here_s:.0f} s"),
        ("time on the cluster, a worker and the database killed", f"{there_s:.0f} s"),
        ("films whose state or result differs", str(len(differing))),
    ]


def states(site: Site) -> dict[str, int]:
    """Return the number of films in each state."""
    found: dict[str, int] = json.loads(site.chainage("archive", "status", "--json").stdout)[
        "progress"
    ]["states"]
    return found


def wait_for_done(site: Site, number: int) -> None:
    """Wait until so many films are done."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        try:
            if states(site).get("done", 0) >= number:
                return
        except json.JSONDecodeError:
            pass
        time.sleep(0.5)
    raise TimeoutError


def differences(one: Mapping[str, object], other: Mapping[str, object]) -> list[str]:
    """Return the names whose values differ, or that are missing on one side."""
    return sorted(name for name in {**one, **other} if one.get(name) != other.get(name))


def throughput(folder: Path) -> Rows:
    """Compare workers with as many plain loops, which share the same films."""
    films = folder / "long"
    make_films(films, 8, LONG_MM)
    paths = sorted(films.rglob("*.mp4"))
    rows: Rows = []
    loops_s = {}
    for processes in (1, 2):
        with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
            list(pool.map(abs, range(processes)))  # started before the time is taken
            began_s = time.monotonic()
            done = list(pool.map(plain, paths))
            loops_s[processes] = time.monotonic() - began_s
        frames = sum(each for each, _ in done)
        core_s = sum(each for _, each in done)
        rows.append(
            (
                f"plain loop, {processes} at once",
                f"{frames / loops_s[processes]:.0f} frames/s",
                f"{frames / core_s:.0f} frames",
                "1",
            )
        )
    for workers in (1, 2):
        site = Site(folder / f"pool-{workers}", {"CHAINAGE_MAX_JOBS": str(workers)})
        site.chainage("archive", "add", films, "--rules", films.with_suffix(".rules.json"))
        began_s = time.monotonic()
        site.chainage("archive", "run")
        taken_s = time.monotonic() - began_s
        rows.append(
            (
                f"{workers} local",
                f"{frames / taken_s:.0f} frames/s",
                "",
                f"{loops_s[workers] / taken_s:.2f}",
            )
        )
    return rows


def plain(path: Path) -> tuple[int, float]:
    """Do the work of a tracker in this process; return frames, and seconds of processor time."""
    before_s = time.process_time()
    follower = Follower(Rig.parse(half_size(SCENARIOS[path.parent.name].rig)))
    frames = 0
    with VideoFile(path) as video:
        for frame in video.read_ahead():
            follower.add(frame)
            frames += 1
            if frames % 10 == 0:
                follower.hand_on(lambda batch: None)
    follower.finish()
    follower.hand_on(lambda batch: None)
    follower.wait()
    return frames, time.process_time() - before_s


def queue(folder: Path, count: int) -> Rows:
    """Let a server have many films in its list and in its queue."""
    films = folder / "many"
    make_films(films, 1, SHORT_MM, workers=1)
    one = film_of(films, 0)
    for number in range(1, count):
        (one.parent / f"D-{number:05d}.mp4").hardlink_to(one)
    site = Site(folder / "many-data", {"CHAINAGE_ARCHIVE_FOLDERS": str(films)})
    with serving(site) as server:
        idle_mib = server.memory_mib()
        body = {
            "paths": [str(films)],
            "rules": json.loads(films.with_suffix(".rules.json").read_text()),
        }
        added_s = timed(lambda: server.ask("POST", "/api/archive/films", json=body))
        started_s = timed(lambda: server.ask("POST", "/api/archive/start", json={"where": {}}))
        asked_ms = [
            1000 * timed(partial(server.ask, "GET", "/api/archive/films", params=query))
            for query in (
                {},
                {"offset": count - 200},
                {"search": "D-09"},
                {"state": "waiting"},
                {"sort": "name", "descending": True},
                {"project": "none"},
            )
            for _ in range(10)
        ]
        progress = partial(server.ask, "GET", "/api/archive/progress")
        progress_ms = [1000 * timed(progress) for _ in range(20)]
        time.sleep(30)
        return [
            ("added, with the rules applied", f"{added_s:.1f} s"),
            ("started", f"{started_s:.1f} s"),
            ("a page of the list, any filter and order: median, p95", quantiles_ms(asked_ms)),
            ("overall progress: median, p95", quantiles_ms(progress_ms)),
            (
                "memory of the server: idle, with all of them waiting",
                f"{idle_mib:.0f}, {server.memory_mib():.0f} MiB",
            ),
        ]


def kills(folder: Path, count: int, rounds: int) -> Rows:
    """Kill what takes part, by turns, while films are tracked, and again when all are done."""
    rules = make_films(folder / "films", count, SHORT_MM)
    here = Site(folder / "kills-here", {"CHAINAGE_MAX_JOBS": "2"})
    here.chainage("archive", "add", folder / "films", "--rules", rules)
    here.chainage("archive", "run")
    alone = here.results()
    killed: Counter[str] = Counter()
    passes, differing = 0, set[str]()
    chance = random.Random(1)  # noqa: S311
    with big_site(folder / "kills", 2) as (site, workers, database):
        site.chainage("archive", "add", folder / "films", "--rules", rules)
        server = Server(site)
        server.ask("POST", "/api/archive/start", json={"where": {}})
        began_s = time.monotonic()
        for _ in range(rounds):
            while not is_tracking(server):
                passes += 1
                differing |= set(differences(alone, site.results()))
                track_again(server)
            victim = chance.choice(("worker", "scheduler", "server", "database"))
            killed[victim] += 1
            if victim == "worker":
                workers.workers.pop(0).kill()
                workers.add_worker()
            elif victim == "scheduler":
                workers.stop()
                workers.workers.clear()
                workers.start_scheduler()
                for _ in range(2):
                    workers.add_worker()
            elif victim == "server":
                server.kill()
                server = Server(site)
            else:
                database.kill()
                database.start()
            time.sleep(chance.uniform(0.5, 3.0))
        while under_way(server):
            time.sleep(1)
        taken_s = time.monotonic() - began_s
        server.stop()
        there = site.results()
    differing |= set(differences(alone, there))
    print(sorted(differing)[:5])
    return [
        ("kill -9", ", ".join(f"{n} of the {victim}" for victim, n in sorted(killed.items()))),
        ("time", f"{taken_s:.0f} s"),
        ("films, each once", f"{len(there)} of {len(alone)}, tracked {passes + 1} times"),
        ("films whose state or result ever differed from a run without kills", str(len(differing))),
    ]


def progress_of(server: Server) -> dict[str, int]:
    """Return the number of films in each state; wait while the database is away."""
    found: dict[str, int] = server.ask("GET", "/api/archive/progress", patience_s=120).json()[
        "states"
    ]
    return found


def under_way(server: Server) -> bool:
    """Whether films wait or are being tracked."""
    found = progress_of(server)
    return any(found.get(state) for state in ("waiting", "queued", "running"))


def is_tracking(server: Server) -> bool:
    """Wait until a film is being tracked; return False if all are done."""
    deadline = time.monotonic() + PATIENCE_S
    while under_way(server):
        if progress_of(server).get("running"):
            return True
        if time.monotonic() > deadline:
            raise TimeoutError
        time.sleep(0.2)
    return False


def track_again(server: Server) -> None:
    """Have every film that is done tracked again, from its first frame."""
    query = {"state": "done", "limit": 500}
    listed = server.ask("GET", "/api/archive/films", params=query, patience_s=60).json()["films"]
    for film in listed:
        path = f"/api/inspections/{film['inspection_id']}/retry"
        server.ask("POST", path, patience_s=60)


class Server:
    """`chainage serve` of a site, as a process."""

    def __init__(self, site: Site) -> None:
        self._process = subprocess.Popen(
            [*CHAINAGE, "serve", "--port", "0"], env=site.environment,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if found := re.search(r"http://[\d.]+:\d+", line):
                self.url = found.group(0)
                break
        else:
            raise RuntimeError("The server did not start.")
        headers = {"Authorization": f"Bearer {TOKEN}"}
        self._client = httpx.Client(base_url=self.url, headers=headers, timeout=60)

    def ask(
        self, method: str, path: str, *, patience_s: float = 0.0, **more: object
    ) -> httpx.Response:
        """Ask, again for a while if the database is away."""
        deadline = time.monotonic() + patience_s
        while True:
            try:
                answer = self._client.request(method, path, **more)  # type: ignore[arg-type]
                if answer.status_code != 503 or time.monotonic() > deadline:
                    answer.raise_for_status()
                    return answer
            except httpx.TransportError:
                if time.monotonic() > deadline:
                    raise
            time.sleep(0.5)

    def memory_mib(self) -> float:
        """Resident memory of the process."""
        status = Path(f"/proc/{self._process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", status).group(1)) / 1024  # type: ignore[union-attr]

    def kill(self) -> None:
        """Kill it and its children, as the kernel does."""
        self._process.kill()
        self._process.wait()

    def stop(self) -> None:
        """End it."""
        self._process.send_signal(signal.SIGTERM)
        self._process.wait()


@contextmanager
def serving(site: Site) -> Iterator[Server]:
    """Serve a site until the block ends."""
    server = Server(site)
    try:
        yield server
    finally:
        server.stop()


def timed(work: Callable[[], object]) -> float:
    """Return the seconds that something takes."""
    began_s = time.monotonic()
    work()
    return time.monotonic() - began_s


def quantiles_ms(found: list[float]) -> str:
    """Return median and 95th percentile."""
    return f"{statistics.median(found):.0f}, {statistics.quantiles(found, n=20)[-1]:.0f} ms"


HEADS = {
    "equal": ("", "measured"),
    "throughput": ("", "speed", "for each second of processor time", "efficiency"),
    "queue": ("", "measured"),
    "kills": ("", "measured"),
}


def main() -> int:
    """Measure what is asked for."""
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("parts", nargs="*", choices=[*HEADS, []], default=list(HEADS))
    arguments.add_argument("--films", type=int, default=200)
    arguments.add_argument("--kills", type=int, default=200)
    arguments.add_argument("--rows", type=int, default=10_000)
    arguments.add_argument("--write", action="store_true", help=f"put the tables into {PAGE.name}")
    arguments.add_argument("--folder", type=Path, help="keep films and data here")
    asked = arguments.parse_args()
    with ExitStack() as stack:
        folder = asked.folder or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(exist_ok=True)
        for part in asked.parts:
            rows = {
                "equal": lambda: equal(folder, asked.films),
                "throughput": lambda: throughput(folder),
                "queue": lambda: queue(folder, asked.rows),
                "kills": lambda: kills(folder, min(asked.films, 40), asked.kills),
            }[part]()
            lines = (HEADS[part], ("---",) * len(rows[0]), *rows)
            table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
            print(table, flush=True)
            if asked.write:
                write_figures(PAGE, part, f"python tests/measure archive {part}", table)
    print(f"{resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime:.0f} s of processor time")
    return 0


if __name__ == "__main__":
    sys.exit(main())
