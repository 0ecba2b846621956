"""Tags are created, edited, deleted and brought back while the server is killed now and then."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import pytest
from builders import Client
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from processes import process
from surveys import Survey, another

ROUNDS = max(1, settings().max_examples // 25)
IDS = [f"00000000-0000-4000-8000-00000000000{n}" for n in range(4)]
STEPS_BETWEEN_KILLS = 8
LONGEST_WRITE_S = 0.03

Fields = dict[str, Any]
Recorded = tuple[str, str, Fields | None, Fields | None]
"""Action, observation, before and after of an event."""

ids = st.sampled_from(IDS)
fields = st.fixed_dictionaries(
    {"frame": st.integers(0, 39)},
    optional={
        "pixel": st.tuples(st.integers(0, 255), st.integers(0, 159)).map(list),
        "code": st.sampled_from(["BAB", "BBA"]),
        "severity": st.integers(0, 5),
        "remark": st.text(st.characters(categories=("L", "N", "Zs")), max_size=20),
    },
)


class Site:
    """A data folder, and a server process that can be killed and started again."""

    def __init__(self, survey: Survey, data: Path) -> None:
        self.survey = survey
        self._data = survey.copied_to(data)
        self._running = ExitStack()
        self.start()

    def start(self) -> None:
        self.client: Client = self._running.enter_context(process(self._data))

    def kill(self) -> None:
        """Without a chance to tidy up."""
        self._running.close()


class Tagging(RuleBasedStateMachine):
    """What was acknowledged, beside a server."""

    def __init__(self, site: Site) -> None:
        super().__init__()
        self.site = site
        self.kept: dict[str, Fields] = {}
        self.deleted: dict[str, Fields] = {}
        self.seqs: dict[str, int] = {}
        self.history: list[Recorded] = []
        self.zeros: list[int] = []
        self.steps = 0

    @initialize()
    def begin(self) -> None:
        self.inspection = another(self.site.survey, self.site.client)

    @rule(name=ids, given=fields)
    def put(self, name: str, given: Fields) -> None:
        answer = self._send(name, given)
        self._note_put(name, given)
        assert {key: answer[key] for key in given} == given
        assert self.seqs.setdefault(name, answer["seq"]) == answer["seq"]

    @precondition(lambda self: self.kept)
    @rule(data=st.data())
    def repeat(self, data: st.DataObject) -> None:
        name = data.draw(st.sampled_from(sorted(self.kept)))
        first, second = (self._send(name, self.kept[name]) for _ in range(2))
        assert first == second

    @rule(name=ids, one=fields, other=fields)
    def put_at_once(self, name: str, one: Fields, other: Fields) -> None:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda given: self._send(name, given), (one, other)))
        last = self._shown()[name]
        assert last in (one, other)
        self._note_put(name, one if last == other else other)
        self._note_put(name, last)

    @rule(name=ids)
    def delete(self, name: str) -> None:
        answer = self.site.client.delete(self._path(name))
        assert answer.status_code == (204 if name in self.kept or name in self.deleted else 404)
        if name in self.kept:
            self.deleted[name] = self.kept.pop(name)
            self.history.append(("deleted", name, self.deleted[name], None))

    @rule(name=ids)
    def undo_the_delete(self, name: str) -> None:
        answer = self.site.client.post(f"{self._path(name)}/restore")
        assert answer.status_code == (200 if name in self.kept or name in self.deleted else 404)
        if name in self.deleted:
            self.kept[name] = self.deleted.pop(name)
            self.history.append(("restored", name, None, self.kept[name]))

    @rule(frame=st.integers(0, 39))
    def set_zero(self, frame: int) -> None:
        body = {"zero": {"frame": frame}}
        answer = self.site.client.put(f"{self._path()}/corrections", json=body)
        assert answer.status_code == 200, answer.text
        if self.zeros[-1:] != [frame]:
            self.zeros.append(frame)

    @precondition(lambda self: self.steps > STEPS_BETWEEN_KILLS)
    @rule(name=ids, given=fields, share=st.floats(0, 1))
    def kill_while_writing(self, name: str, given: Fields, share: float) -> None:
        """What was not acknowledged is there or is not, and nothing between."""
        self.steps = 0
        before = self.kept.get(name)
        sending = threading.Thread(target=self._send_in_vain, args=(name, given))
        sending.start()
        time.sleep(share * LONGEST_WRITE_S)  # any moment is as good as any other
        self.site.kill()
        sending.join()
        self.site.start()
        found = self._shown().get(name)
        assert found in (before, given)
        if found == given:
            self._note_put(name, given)

    @invariant()
    def what_was_acknowledged_is_listed(self) -> None:
        listed = self._listed()
        assert self._shown() == self.kept
        numbers = [each["seq"] for each in listed]
        assert numbers == sorted(set(numbers))
        for each in listed:
            known = self.seqs.setdefault(each["id"], each["seq"])
            assert known == each["seq"]
        assert len(set(self.seqs.values())) == len(self.seqs)

    @invariant()
    def the_history_is_complete_and_in_order(self) -> None:
        events = self.site.client.get(f"{self._path()}/events").json()["events"][::-1]
        recorded = [
            (it["action"], it["observation_id"], it["before"], it["after"])
            for it in events
            if it["observation_id"]
        ]
        assert recorded == self.history
        times = [it["at"] for it in events]
        assert times == sorted(times)

    @invariant()
    def the_revision_counts_the_corrections(self) -> None:
        self.steps += 1
        assert self.site.client.inspection(self.inspection)["revision"] == len(self.zeros)

    def _path(self, name: str | None = None) -> str:
        inspection = f"/api/inspections/{self.inspection}"
        return inspection if name is None else f"{inspection}/observations/{name}"

    def _send(self, name: str, given: Fields) -> Fields:
        answer = self.site.client.put(self._path(name), json=given)
        assert answer.status_code == 200, answer.text
        return dict(answer.json())

    def _send_in_vain(self, name: str, given: Fields) -> None:
        try:
            self._send(name, given)
        except httpx.TransportError:
            return

    def _listed(self) -> list[Fields]:
        return list(self.site.client.get(f"{self._path()}/observations").json()["observations"])

    def _shown(self) -> dict[str, Fields]:
        """What people have entered, by observation."""
        entered = ("frame", "pixel", "code", "severity", "remark")
        return {
            each["id"]: {key: each[key] for key in entered if each[key] is not None}
            for each in self._listed()
        }

    def _note_put(self, name: str, given: Fields) -> None:
        """What a PUT does; the same again does nothing."""
        before = self.kept.get(name)
        if given == before:
            return
        is_new = before is None and name not in self.deleted
        action = "created" if is_new else "changed" if before is not None else "restored"
        self.history.append((action, name, before, given))
        self.deleted.pop(name, None)
        self.kept[name] = given


@pytest.mark.timeout(3600)
def test_whatever_is_done_the_server_keeps_what_it_acknowledged(
    tmp_path: Path, survey: Survey
) -> None:
    site = Site(survey, tmp_path / "data")
    try:
        run_state_machine_as_test(
            lambda: Tagging(site),
            settings=settings(
                max_examples=ROUNDS, stateful_step_count=15,
                suppress_health_check=list(HealthCheck), phases=(Phase.generate,),
            ),
        )  # fmt: skip
    finally:
        site.kill()
