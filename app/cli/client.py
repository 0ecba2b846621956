"""The HTTP contract for commands: to the server that uses a data folder, or to one that is started
for the time of the command.
"""

from __future__ import annotations

import ssl
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx

from app.back_off import BackOff
from app.cli.console import err
from app.errors import DataFolderInUse, NotReady, OtherServerActive, ServerAway, ServerRefused
from app.settings import Settings
from app.storage.folder.address import Address, AddressFile
from app.storage.folder.files import Places

_START_S = 60.0
"""Longest start of a server, such as one that migrates a large database."""
_LOOK_EVERY_S = 0.1
_AWAY = (502, 503, 504)
"""What a server answers, or a proxy before it, while something is away."""
_PATIENCE_S = 300.0
_BACK_OFF = BackOff(first_s=0.2, longest_s=10.0)


@dataclass(frozen=True)
class Api:
    """A server that answers."""

    is_own: bool
    """Whether it ends with the command."""
    page: str
    """Address of its pages, for a browser."""
    client: httpx.Client
    file: AddressFile | None = None
    """Says which server uses the data folder, after a standby has taken over too."""

    def ask(self, method: str, path: str, **request: Any) -> Any:
        """Return the content of the answer.

        Raises:
            ServerRefused: The text is the sentence of the server.
            ServerAway: It does not answer, or cannot now.
        """
        try:
            answer = self.client.request(method, f"/api{path}", **request)
        except httpx.HTTPError as error:
            raise ServerAway(
                f"The server at {self.client.base_url} does not answer ({error})."
            ) from error
        if answer.is_success:
            return answer.json()
        if answer.status_code in _AWAY:
            asked_s = answer.headers.get("Retry-After", "")
            raise ServerAway(_sentence(answer), float(asked_s) if asked_s.isdecimal() else 0.0)
        raise ServerRefused(_sentence(answer))

    def ask_patiently(self, method: str, path: str, **request: Any) -> Any:
        """Return the content of the answer to what may be asked twice, as soon as server and
        database are there again.

        Raises:
            ServerRefused: As for `ask`, or nothing came for minutes.
        """
        until_s, failures = time.monotonic() + _PATIENCE_S, 0
        while True:
            try:
                return self.ask(method, path, **request)
            except ServerAway as away:
                if time.monotonic() > until_s:
                    raise
                if not failures:
                    err.print(f"warning: {away} It is asked again.", style="yellow")
                time.sleep(max(away.pause_s, _BACK_OFF.pause_s(failures)))
                failures += 1
                address = self.file.read() if self.file is not None else None
                if address is not None:
                    self.client.base_url = address.url


@contextmanager
def api(settings: Settings, folders: Sequence[Path] = (), *, tracks: bool = False) -> Iterator[Api]:
    """Open the server of the settings' data folder.

    Args:
        settings: Their data folder is meant.
        folders: From which a server that is started may add films.
        tracks: Whether a server that is started tracks films, and takes them in.
    Raises:
        NotReady: A server uses the folder and is not ready.
        OtherServerActive: A server uses the same database, but not this folder.
    """
    file = AddressFile(Places(settings.data))
    with ExitStack() as opened:
        login_url, address = "", _running(file)
        if address is None:
            try:
                login_url = opened.enter_context(_started(settings, folders, tracks=tracks))
                parts = urlsplit(login_url)
                address = Address(f"{parts.scheme}://{parts.netloc}", None)
            except (DataFolderInUse, OtherServerActive):
                address = _running(file)  # of one that has just begun, such as a standby
                if address is None:
                    raise
        client = _client(address.url, _token(settings), address.certificate)
        page = login_url or address.url
        yield Api(bool(login_url), page, opened.enter_context(client), file)


def _started(
    settings: Settings, folders: Sequence[Path], *, tracks: bool
) -> AbstractContextManager[str]:
    """Run a server for the time of the command; yield its log-in address."""
    from app.main import in_background  # slow to import

    changes: dict[str, Any] = {"archive_folders": (*settings.archive_folders, *folders)}
    if not tracks:
        changes |= {"max_jobs": 0, "dask": None, "inbox": None}
    return in_background(settings.model_copy(update=changes))


def _running(file: AddressFile) -> Address | None:
    """Return the address of the server that uses the folder, once it is ready; None if none
    does.
    """
    until_s = time.monotonic() + _START_S
    while file.is_in_use():
        address = file.read()
        if address is not None:
            return address
        if time.monotonic() > until_s:
            raise NotReady("A server uses the data folder, but it does not become ready.")
        time.sleep(_LOOK_EVERY_S)
    return None


def _token(settings: Settings) -> str:
    if settings.token is not None:
        return settings.token.get_secret_value()
    return Places(settings.data).token.read_text("ascii").strip()


def _client(url: str, token: str, certificate: str | None) -> httpx.Client:
    context = ssl.create_default_context(cafile=certificate)
    context.check_hostname = certificate is None  # this very certificate, whatever it names
    return httpx.Client(
        base_url=url,
        headers={"Authorization": f"Bearer {token}"},
        timeout=None,  # adding thousands of films takes its time  # noqa: S113
        verify=context,
        trust_env=False,
    )


def _sentence(answer: httpx.Response) -> str:
    try:
        return str(answer.json()["detail"])
    except (ValueError, KeyError, TypeError):
        return f"The server answered {answer.status_code}."
