"""Clients accept inspections by a link that needs no account: its secret is all that admits."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Sequence

from app.access.access import Attempts, digest_of
from app.errors import Busy, DiskFull, LinkNotFound
from app.storage.records.acceptance import AcceptanceStore, Answer
from app.storage.records.acceptance import LinkView as LinkView
from app.storage.records.acceptance import SectionView as SectionView
from app.tracking.live import Live

logger = logging.getLogger(__name__)

_SECRET_BYTES = 32


class Acceptance:
    """Makes links and opens them."""

    def __init__(self, store: AcceptanceStore, live: Live) -> None:
        self._store = store
        self._live = live
        # A client that keeps opening an expired link is not guessing.
        self._guesses = Attempts(counts_repeats=False)

    def make(self, note: str, ids: Sequence[str], days: int, who: str) -> tuple[LinkView, str]:
        """Make a link to some inspections; return it with its secret, which is stored nowhere.

        Raises:
            InspectionNotFound: One of them does not exist.
            StillRunning: One of them is queued or running.
        """
        secret = secrets.token_urlsafe(_SECRET_BYTES)
        link_id = self._store.make(digest_of(secret), note, ids, days, who)
        logger.info("%s made a link to %d inspections for acceptance.", who, len(ids))
        return self._store.link(link_id), secret

    def links(self, inspection_id: str | None) -> list[LinkView]:
        """Return the newest links, those that show one inspection or all."""
        return self._store.links(inspection_id)

    def link(self, link_id: str) -> LinkView:
        """Return a link, valid or not.

        Raises:
            LinkNotFound: No link has this id.
        """
        return self._store.link(link_id)

    def revoke(self, link_id: str, who: str) -> None:
        """End a link.

        Raises:
            LinkNotFound: No link has this id.
        """
        self._store.revoke(link_id, who)
        logger.info("%s revoked the link %s.", who, link_id)

    def opened(self, secret: str, address: str) -> LinkView:
        """Return the valid link of this secret.

        Raises:
            LinkNotFound: There is none; whether there was one is not said.
            TooManyAttempts: This address has tried too many others within a minute.
        """
        digest = digest_of(secret)
        link = self._store.valid(digest)
        if link is None:
            self._guesses.check(address)
            self._guesses.failed(address, digest)
            raise LinkNotFound("This link is not valid, or not valid any more.")
        return link

    def count(self, link: LinkView) -> None:
        """Count that the page of a link was opened."""
        try:
            self._store.note_opened(link.row.id)
        except (Busy, DiskFull) as failure:  # a reader needs neither disk space nor a free writer
            logger.warning("The opening of a link could not be counted: %s", failure)

    def answer(self, link: LinkView, section: SectionView, answer: Answer) -> None:
        """Store what a client said; one that is stored stays as it is.

        Raises:
            LinkNotFound: The link was revoked meanwhile.
            InspectionNotFound: The inspection was deleted.
            DeliveryChanged: It is no longer what the client saw.
            TooManyAnswers: The section has as many answers as it may have.
        """
        self._store.answer(link.row.id, section.place, answer)
        logger.info("A client said %r of inspection %s.", answer.kind, section.inspection_id)
        self._live.observations_changed(section.inspection_id)

    def reply(self, inspection_id: str, answer_id: str, text: str, who: str) -> None:
        """Answer what a client said.

        Raises:
            AnswerNotFound: The inspection has no such answer of a client.
        """
        self._store.reply(inspection_id, answer_id, text, who)
        self._live.observations_changed(inspection_id)
