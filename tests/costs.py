"""Processor time of a run of the tests, by kind of test and by file, against a budget.

The time of a test is that of its process and of everything which that has started: servers,
children, browsers, databases.  A fixture counts for the test that needed it first.
"""

from __future__ import annotations

import resource
import time
from collections import Counter
from collections.abc import Generator

import psutil
import pytest

BUDGET_S = {"unit": 100.0, "server": 260.0, "browser": 190.0, "render": 100.0}
"""Processor time of a default run on the reference machine, which has two cores of an AMD EPYC with
AVX-512.  Who adds a test pays for it: these figures do not grow.
"""
REFERENCE_S = 0.04
"""What `pace` takes there, so that a slower machine has a larger budget."""
DEAREST = 10
"""How many files the table lists."""
_SPENT = "processor_s"


def processor_s() -> float:
    """Processor time of this process and all that it has started, s; ended ones included."""
    own = psutil.Process()
    return sum(map(_spent_by, (own, *own.children(recursive=True))))


def _spent_by(process: psutil.Process) -> float:
    try:
        times = process.cpu_times()
    except psutil.Error:  # it has just ended, and its parent has its time
        return 0.0
    return float(times.user + times.system + times.children_user + times.children_system)


def pace() -> float:
    """How many times as long as the reference machine this one takes for the same work."""

    def once() -> float:
        begun = time.process_time()
        sum(n * n % 7 for n in range(1_000_000))
        return time.process_time() - begun

    return min(once() for _ in range(5)) / REFERENCE_S


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Remember what had been spent before the test."""
    item.stash[_BEFORE] = _spent(item)
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Report what the test has spent, once its fixtures have ended."""
    report = yield
    if call.when == "teardown":
        report.user_properties.append((_SPENT, _spent(item) - item.stash[_BEFORE]))
    return report


_BEFORE = pytest.StashKey[float]()


def _spent(item: pytest.Item) -> float:
    """A unit test starts no process, so that its own is quickly looked at."""
    return time.process_time() if item.get_closest_marker("unit") else _meter.read_s()


class _Meter:
    """Processor time that does not fall when processes end for which nobody has waited."""

    def __init__(self) -> None:
        self._last_s = self._lost_s = 0.0

    def read_s(self) -> float:
        now_s = processor_s()
        self._lost_s += max(0.0, self._last_s - now_s)
        self._last_s = now_s
        return now_s + self._lost_s


_meter = _Meter()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the table, and which kinds are over their budget."""
    kinds: Counter[str] = Counter()
    files: Counter[str] = Counter()
    for report in terminalreporter.getreports(""):  # set-ups and teardowns
        spent = dict(report.user_properties).get(_SPENT)
        if spent is not None:
            kinds[next((kind for kind in BUDGET_S if kind in report.keywords), "?")] += spent
            files[report.location[0]] += spent
    if not files:
        return
    factor = pace()
    whole = sum(map(_used, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))
    say = terminalreporter.write_line
    terminalreporter.section("processor time, s")
    for kind, spent in kinds.most_common():
        allowed = BUDGET_S.get(kind, 0.0) * factor
        over = "   OVER BUDGET" if spent > allowed else ""
        say(f"{spent:8.1f}  {kind:8} of {allowed:.0f} on this machine{over}")
    say(f"{whole:8.1f}  in all, as a shell counts it: without what nobody waited for")
    say(f"The {DEAREST} dearest files:")
    for name, spent in files.most_common(DEAREST):
        say(f"{spent:8.1f}  {name}")


def _used(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime
