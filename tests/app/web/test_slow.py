"""What takes long does not hold up what must be quick."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import loops
import pytest
from builders import PATIENCE_S, Client, wait_until

from app.errors import InvalidTable
from app.inspections.register import Register
from app.reports.reports import Reports
from app.tracking.pictures.thumbnails import Thumbnails
from app.web.slow import streamed
from app.web.turns import Turns

MANY = 44
"""More than there are threads for blocking endpoints."""


def test_a_tag_does_not_wait_for_reports_that_are_being_written(
    shared: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    reports = shared.server.app.state.services[Reports]
    write, is_begun, may_end = reports.export, threading.Event(), threading.Event()

    def slowly(*positional: Any, **named: Any) -> Any:
        is_begun.set()
        may_end.wait(PATIENCE_S)
        return write(*positional, **named)

    monkeypatch.setattr(reports, "export", slowly)
    path = f"/api/inspections/{done}/exports/csv"
    with ThreadPoolExecutor(MANY) as pool:
        asked = [pool.submit(shared.get, path) for _ in range(MANY)]
        assert is_begun.wait(PATIENCE_S)
        tagged = shared.tag(done, frame=20, code="BAB")
        may_end.set()
        assert tagged.status_code == 200
        assert {answer.result().status_code for answer in asked} == {200}


def test_a_report_does_not_wait_for_the_thumbnails_of_a_long_list(
    shared: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    thumbnails = shared.server.app.state.services[Thumbnails]
    make, is_begun, may_end = thumbnails.jpeg, threading.Event(), threading.Event()

    def slowly(shown: Any) -> Any:
        is_begun.set()
        may_end.wait(PATIENCE_S)
        return make(shown)

    monkeypatch.setattr(thumbnails, "jpeg", slowly)
    with ThreadPoolExecutor(MANY) as pool:
        path = f"/api/inspections/{done}/thumbnail"
        asked = [pool.submit(shared.get, path) for _ in range(MANY)]
        assert is_begun.wait(PATIENCE_S)
        report = shared.get(f"/api/inspections/{done}/exports/csv")
        may_end.set()
        assert report.status_code == 200
        assert {answer.result().status_code for answer in asked} == {200}


def test_a_report_is_written_once_for_its_losses_and_for_itself(
    shared: Client, own: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    reports = shared.server.app.state.services[Reports]
    make, made = reports.builder.report, []

    def counted(*positional: Any, **named: Any) -> Any:
        made.append(named)
        return make(*positional, **named)

    monkeypatch.setattr(reports.builder, "report", counted)
    path = f"/api/inspections/{own}/exports/m150"
    tag_with_photo(shared, own, frame=20, code="BAB")
    shared.get(f"{path}/losses")
    first = shared.get(path).content
    assert len(made) == 1
    tag_with_photo(shared, own, frame=30, code="BBC")
    assert shared.get(path).content != first
    shared.get(f"{path}/losses")
    assert len(made) == 2
    shared.get(path, params={"lang": "ms"})
    assert len(made) == 3


def tag_with_photo(client: Client, inspection_id: str, **values: Any) -> None:
    """Tag, and wait for the photo, which makes the report another one."""
    client.tag(inspection_id, **values).raise_for_status()
    path = f"/api/inspections/{inspection_id}/observations"
    wait_until(lambda: all(tag["photo"] for tag in client.get(path).json()["observations"]))


def test_one_person_does_not_take_all_turns() -> None:
    """Nor does who waits for a turn hold one of those of all."""

    async def served() -> list[str]:
        turns, order, may_end = Turns("work", most=3, each=2), [], asyncio.Event()

        async def work(person: str) -> None:
            async with turns.turn(person):
                order.append(person)
                await may_end.wait()

        mine = [asyncio.create_task(work("me")) for _ in range(20)]
        await asyncio.sleep(0)
        theirs = asyncio.create_task(work("you"))
        while "you" not in order:
            await asyncio.sleep(0)
        begun = order.copy()
        may_end.set()
        await asyncio.gather(*mine, theirs)
        assert len(order) == 21
        return begun

    assert loops.run(served) == ["me", "me", "you"]


def test_who_reads_a_stream_slowly_holds_only_their_own_turn() -> None:
    async def read() -> None:
        mine = streamed(iter([b"1", b"2"]), "me")
        assert await anext(mine) == b"1"
        more = asyncio.create_task(anext(streamed(iter([b"3"]), "me")))
        assert await anext(streamed(iter([b"4"]), "you")) == b"4"
        assert not more.done()
        await mine.aclose()
        assert await more == b"3"

    loops.run(read)


def test_a_large_body_is_not_read_before_its_turn(
    shared: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of a person at a time, so that not all of them are in memory at once."""
    register = shared.server.app.state.services[Register]
    is_begun, may_end, at_once, most = threading.Event(), threading.Event(), [0], [0]

    def slowly(content: bytes, columns: Sequence[str]) -> Any:
        at_once[0] += 1
        most[0] = max(most[0], at_once[0])
        is_begun.set()
        may_end.wait(PATIENCE_S)
        at_once[0] -= 1
        raise InvalidTable("Enough.")

    monkeypatch.setattr(register, "preview", slowly)
    with ThreadPoolExecutor(4) as pool:
        path, headers = "/api/register/import?dry_run=true", {"Content-Type": "text/csv"}
        asked = [
            pool.submit(shared.post, path, content=bytes(10), headers=headers) for _ in range(4)
        ]
        assert is_begun.wait(PATIENCE_S)
        assert shared.get("/api/map").status_code == 200, "another heavy request has its turn"
        may_end.set()
        assert {answer.result().status_code for answer in asked} == {422}
    assert most == [1]
