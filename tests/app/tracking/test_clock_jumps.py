"""What is timed stays right when somebody, or the network, sets the machine's clock."""

from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from app.access import access
from app.access.access import Access
from app.inspections.films.uploads import Uploads
from app.storage.database.database import Database
from app.storage.folder.files import DataFolder
from app.storage.folder.tokens import TokenFile
from app.storage.records.access import AccessStore

DAY_S = 24 * 3600.0
TOKEN = "a-token-for-tests-0123456789abcdef"  # noqa: S105


class Clock:
    """Both clocks of the machine, as a test sets them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._time, self._monotonic = time.time, time.monotonic
        self.set_by_s = self.gone_s = 0.0
        monkeypatch.setattr(time, "time", lambda: self._time() + self.set_by_s + self.gone_s)
        monkeypatch.setattr(time, "monotonic", lambda: self._monotonic() + self.gone_s)


@pytest.mark.parametrize("days", [20_000, -20_000])
def test_uploads_outlive_a_clock_that_is_set_and_expire_by_it_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, days: int
) -> None:
    clock = Clock(monkeypatch)
    folder = DataFolder(tmp_path, reserve_bytes=0)
    uploads = Uploads(folder, max_bytes=10**9, expiry_s=2 * DAY_S)
    upload_id = uploads.create(10, "clip.mp4", "", "crew")
    content = folder.uploads / f"{upload_id}.bin"
    clock.set_by_s = days * DAY_S
    for gone_days, is_there in ((0, True), (1, True), (1.1, False)):
        clock.gone_s += gone_days * DAY_S
        uploads.expire()
        assert content.exists() == is_there
    folder.close()


class Wall(datetime):
    """`datetime` whose now is set by a test."""

    ahead = timedelta()

    @classmethod
    def now(cls, tz: object = None) -> datetime:  # type: ignore[override]
        return datetime.now(UTC) + cls.ahead


def test_a_session_does_not_last_longer_for_a_clock_that_was_set_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "datetime", Wall)
    database = Database(tmp_path / "chainage.db")
    service = Access(AccessStore(database), TokenFile(tmp_path), TOKEN)
    cookie = service.log_in(TOKEN, "127.0.0.1")
    for hours, is_in in ((-1, True), (-20, True), (-48, False), (24 * 8, False)):
        monkeypatch.setattr(Wall, "ahead", timedelta(hours=hours))
        assert (service.by_cookie(cookie) is not None) == is_in, hours
    database.close()
