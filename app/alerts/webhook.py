"""Notifies the client of urgent observations: a signed POST for each of severity 5.

The alert is written with the observation, in one transaction. A separate thread sends it, so that a
slow, absent or hostile client never delays tagging. The message shows the observation at the time
of sending; it is not sent if the observation was deleted or made less severe before.
"""

from __future__ import annotations

import hashlib
import hmac
import http.client
import json
import logging
import socket
import ssl
import threading
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any
from urllib.parse import urlsplit

from app.back_off import BackOff
from app.errors import InspectionNotFound, ObservationNotFound
from app.inspections.inspections import Inspections
from app.inspections.observations import Observations
from app.inspections.packs import Packs
from app.logs import about
from app.storage.database.tables import Alert, Inspection, Notice
from app.storage.records.alerts import EMERGENCY, AlertStore
from app.storage.records.notices import NoticeStore
from app.survey.observations.undelivered import Undelivered
from app.survey.places.place import ObservationView
from app.survey.rounding import metres
from app.tracking.live import Event, ObservationsChanged
from app.tracking.worker import HINDRANCES, Worker

logger = logging.getLogger(__name__)

EVENT = "observation.severity_5"
SIGNATURE = "X-Chainage-Signature"

_TRY_S = 5.0
"""Time limit of one try, from the name look-up to the status of the answer."""
_BACK_OFF = BackOff(first_s=2.0, longest_s=3600.0)
_GIVE_UP_AFTER = timedelta(days=1)
_STOP_TIMEOUT_S = 3.0


@dataclass(frozen=True)
class Client:
    """The receiver of notifications, with its secret."""

    url: str = field(repr=False)
    """http or https; it may contain a secret, so it is never logged."""
    secret: str = field(repr=False)
    page_root: str = ""
    """Prefix of page paths, such as https://culverts.example; if empty, the path is sent alone."""
    trust: ssl.SSLContext | None = None
    """Trusted certificates; None: those of the system."""


class Unsent(Exception):
    """A try failed; the text says why, without the address."""

    def __init__(self, code: str, **values: object) -> None:
        reason = Undelivered(code, {name: str(value) for name, value in values.items()})
        super().__init__(reason.sentence)


class Webhook(Worker):
    """Sends the messages of the outboxes: alerts of observations, and notices of other things."""

    def __init__(
        self,
        client: Client | None,
        store: AlertStore,
        notices: NoticeStore,
        inspections: Inspections,
        observations: Observations,
        packs: Packs,
    ) -> None:
        super().__init__("webhook", stop_timeout_s=_STOP_TIMEOUT_S)
        self._client = client
        self._store = store
        self._notices = notices
        self._inspections = inspections
        self._observations = observations
        self._packs = packs
        self._stop_try: Callable[[], None] | None = None
        """Ends the current try; `_changed` guards it."""

    @property
    def is_configured(self) -> bool:
        """Whether a client is configured."""
        return self._client is not None

    def start(self) -> None:
        """Start sending, first what the last run of the server left."""
        if self.is_configured:
            super().start()

    def stop(self) -> None:
        """Abort the current try; it is repeated after the next start."""
        with self._changed:
            self._stopping = True
            if self._stop_try is not None:
                self._stop_try()
        super().stop()

    def on_event(self, event: Event) -> None:
        """Handle an event: a tag may need a notification."""
        if isinstance(event, ObservationsChanged):
            self.wake()

    def alerts(self, inspection_id: str) -> list[Alert]:
        """Return the alerts of an inspection, the oldest first.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        self._inspections.row(inspection_id)
        return self._store.of(inspection_id)

    def _step(self) -> float | None:
        waiting = [self._store.next_waiting(), self._notices.next_waiting()]
        due = min((one for one in waiting if one), key=lambda one: one.next_at, default=None)
        if due is None:
            return None
        pause_s = _seconds_until(due.next_at)
        if pause_s > 0:
            return pause_s
        if isinstance(due, Notice):
            self._deliver(due, self._notices, f"event {due.event}")
        else:
            with about(due.inspection_id):
                self._deliver(due, self._store, f"observation {due.observation_id}")
        return 0.0

    def _deliver(self, due: Alert | Notice, store: AlertStore | NoticeStore, subject: str) -> None:
        """Try once to deliver a message."""
        client = self._client
        assert client is not None  # noqa: S101  (the thread runs only with one)
        try:
            body = self._body(due, client.page_root)
            if body is not None:
                self._post(client, body)
        except HINDRANCES:
            raise
        except Unsent as failure:
            self._failed(due, store, subject, failure)
        except Exception:  # it must not keep the others from being sent
            logger.exception("The notification of %s cannot be made.", subject)
            self._failed(due, store, subject, Unsent("fault"))
        else:
            if body is None:
                self._store.withdraw(due.id)
                return
            logger.info("The client was notified of %s.", subject)
            store.record_sent(due.id)

    def _failed(
        self,
        due: Alert | Notice,
        store: AlertStore | NoticeStore,
        subject: str,
        failure: Unsent,
    ) -> None:
        if self._stopping:
            return
        next_at = next_try(due, datetime.now(UTC))
        logger.warning(
            "The client could not be notified of %s, %s: %s",
            subject,
            "another try follows" if next_at else "no other try follows",
            failure,
        )
        store.record_failure(due.id, str(failure), next_at)

    def _body(self, due: Alert | Notice, page_root: str) -> bytes | None:
        """Return the message; of an alert as of now, or None if no severe observation is left."""
        if isinstance(due, Notice):
            head = _head(due.event, due.id, f"{page_root}{due.path}")
            return json.dumps({**head, **due.body}).encode()
        return self._body_of_alert(due, page_root)

    def _body_of_alert(self, alert: Alert, page_root: str) -> bytes | None:
        try:
            inspection = self._inspections.row(alert.inspection_id)
            view = self._observations.get(alert.inspection_id, alert.observation_id)
        except (InspectionNotFound, ObservationNotFound):
            return None
        if view.row.tag.severity != EMERGENCY:
            return None
        label = self._label(inspection, view)
        return json.dumps(message(alert, inspection, view, label, page_root)).encode()

    def _label(self, inspection: Inspection, view: ObservationView) -> str | None:
        tag = view.row.tag
        kind = self._packs.table_of(inspection.header).named(tag.code, tag.char1, tag.char2)
        return kind.label if kind else None

    def _post(self, client: Client, body: bytes) -> None:
        """Post the message; raise Unsent unless the client accepts it."""
        with closing(_Post(client.url, client.trust)) as post:
            with self._changed:
                if self._stopping:
                    raise Unsent("stopping")
                self._stop_try = post.give_up
            try:
                status = post.send(body, signature(client.secret, body, int(time.time())))
            finally:
                with self._changed:
                    self._stop_try = None
        if 300 <= status < 400:
            raise Unsent("redirected", status=status)
        if not 200 <= status < 300:
            raise Unsent("answered", status=status)


def message(
    alert: Alert,
    inspection: Inspection,
    view: ObservationView,
    label: str | None,
    page_root: str,
) -> dict[str, Any]:
    """Build the body of the POST; docs/operating.md shows its form."""
    row, place = view.row, view.place
    return {
        **_head(EVENT, alert.id, f"{page_root}/inspections/{inspection.id}"),
        "inspection": {
            "id": inspection.id,
            "name": inspection.name,
            "asset": inspection.header.get("asset_id"),
        },
        "observation": {
            "id": row.id,
            "distance_m": metres(place.distance_mm) if place else None,
            "distance_u95_m": place.u95_m if place else None,
            "code": row.tag.code,
            "label": label,
            "clock": view.clock,
            "remark": row.tag.remark,
            "severity": EMERGENCY,
            "tagged_by": row.created_by,
            "tagged_at": row.created_at.isoformat(timespec="seconds"),
        },
    }


def _head(event: str, message_id: str, url: str) -> dict[str, str]:
    sent_at = datetime.now(UTC).isoformat(timespec="seconds")
    return {"event": event, "id": message_id, "sent_at": sent_at, "url": url}


def signature(secret: str, body: bytes, at: int) -> str:
    """Return the value of the header: `t=<unix time>,v1=<hex HMAC-SHA256 of "t.body">`."""
    digest = hmac.new(secret.encode(), f"{at}.".encode() + body, hashlib.sha256)
    return f"t={at},v1={digest.hexdigest()}"


class _Post:
    """One try, whose total time is limited however slowly the other side answers."""

    def __init__(self, url: str, trust: ssl.SSLContext | None) -> None:
        parts = urlsplit(url)
        self._host = parts.hostname or ""
        self._trust = trust or ssl.create_default_context() if parts.scheme == "https" else None
        self._port = parts.port or (80 if self._trust is None else 443)
        self._target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        self._ends_s = time.monotonic() + _TRY_S
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        self._is_over = False
        self._watch = threading.Timer(_TRY_S, self.give_up)
        self._watch.daemon = True

    def give_up(self) -> None:
        """Make every wait for the other side fail."""
        with self._lock:
            self._is_over = True
            if self._socket is not None:
                try:
                    self._socket.shutdown(socket.SHUT_RDWR)
                except OSError:
                    logger.debug("The connection was closed already.")

    def send(self, body: bytes, signed: str) -> int:
        """Send the message and return the status of the answer.

        Raises:
            Unsent: No answer came.
        """
        self._watch.start()
        try:
            # The class of the connection decides whether the Host header contains the port.
            kind = http.client.HTTPSConnection if self._trust else http.client.HTTPConnection
            connection = kind(self._host, self._port, timeout=_TRY_S)
            connection.sock = self._connected()
            headers = {
                "Content-Type": "application/json",
                "User-Agent": "Chainage",
                SIGNATURE: signed,
                "Connection": "close",
            }
            connection.request("POST", self._target, body, headers)
            return connection.getresponse().status
        except (OSError, http.client.HTTPException, ValueError) as failure:
            raise self._unsent(failure) from failure

    def close(self) -> None:
        """Close the connection without reading the answer's body."""
        self._watch.cancel()
        if self._socket is not None:
            self._socket.close()

    def _connected(self) -> socket.socket:
        left_s = max(self._ends_s - time.monotonic(), 0.1)
        plain = socket.create_connection((self._host, self._port), left_s)
        if self._trust is None:
            return self._watched(plain)
        wrapped = self._trust.wrap_socket(
            plain, server_hostname=self._host, do_handshake_on_connect=False
        )
        self._watched(wrapped)
        wrapped.do_handshake()
        return wrapped

    def _watched(self, opened: socket.socket) -> socket.socket:
        """Register a socket that `give_up` closes."""
        with self._lock:
            self._socket = opened
            if self._is_over:
                raise TimeoutError
        return opened

    def _unsent(self, failure: Exception) -> Unsent:
        if self._is_over or isinstance(failure, TimeoutError):
            return Unsent("no_answer", seconds=f"{_TRY_S:.0f}")
        if isinstance(failure, ssl.SSLCertVerificationError):
            return Unsent("untrusted", why=failure.verify_message)
        if isinstance(failure, ssl.SSLError):
            return Unsent("tls_failed", why=failure.reason or "the connection broke off")
        if isinstance(failure, socket.gaierror):
            return Unsent("unknown_name")
        if isinstance(failure, http.client.RemoteDisconnected | ConnectionResetError):
            return Unsent("broken_off")
        if isinstance(failure, OSError) and failure.strerror:
            return Unsent("unreachable", why=failure.strerror)
        return Unsent("no_web_server")


def _seconds_until(instant: datetime) -> float:
    return (instant - datetime.now(UTC)).total_seconds()


def next_try(due: Alert | Notice, now: datetime) -> datetime | None:
    """Return the time of the next try, after doubling pauses; None after a day."""
    next_at = now + timedelta(seconds=_BACK_OFF.pause_s(due.tries))
    return next_at if next_at < due.created_at + _GIVE_UP_AFTER else None
