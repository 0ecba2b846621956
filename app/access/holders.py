"""The holders of tokens as an administrator sees and changes them; see also `chainage token`."""

from __future__ import annotations

import hashlib
import logging
from dataclasses import dataclass
from datetime import UTC, datetime

from app.access.access import SERVER, SESSION_IDLE, SESSION_LIFETIME, create_token
from app.storage.folder.tokens import Role, TokenFile
from app.storage.records.access import AccessStore

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Holder:
    """A token without its secret."""

    name: str
    role: Role
    created_at: datetime | None
    """None for the server's own token, which is made outside."""
    revoked_at: datetime | None
    seen_at: datetime | None
    """Last use by a browser or a program, precise to some minutes; None before the first one."""
    sessions: int
    """Browsers that are logged in with it."""
    projects: frozenset[str] | None
    """The only projects that it sees and changes; None: all of them."""

    @property
    def is_server(self) -> bool:
        """Whether it is the server's own token, which nobody can change here."""
        return self.name == SERVER


class Holders:
    """Lists tokens, makes them, and changes or ends their rights at once."""

    def __init__(self, store: AccessStore, tokens: TokenFile, server_token: str) -> None:
        self._store = store
        self._tokens = tokens
        self._server_digest = hashlib.sha256(server_token.encode()).hexdigest()

    def all(self) -> list[Holder]:
        """Return the server's own token, then the others in the order of creation."""
        now = datetime.now(UTC)
        uses = self._store.uses()
        logins = self._store.logins(
            unused_since=now - SESSION_IDLE, begun_before=now - SESSION_LIFETIME
        )
        server = self._server_digest
        own = Holder(SERVER, Role.ADMIN, None, None, uses.get(server), logins.get(server, 0), None)
        named = (
            Holder(
                token.name,
                token.role,
                token.created_at,
                token.revoked_at,
                uses.get(token.digest),
                0 if token.revoked_at else logins.get(token.digest, 0),
                token.projects,
            )
            for token in self._tokens.all()
        )
        return [own, *named]

    def create(self, name: str, role: Role, projects: frozenset[str] | None, who: str) -> str:
        """Make a token, for some projects or for all of them, and return its secret, which is
        stored nowhere.

        Raises:
            TokenNameTaken: Another valid token has this name.
        """
        secret = create_token(self._tokens, name, role, projects)
        logger.info("Token %s (%s) made by %s.", name, role, who)
        return secret

    def change_role(self, name: str, role: Role, who: str) -> None:
        """Give a token another role, which counts from the next request on.

        Raises:
            TokenNotFound: No valid token has this name.
        """
        self._tokens.change_role(name, role)
        logger.info("Token %s has the role %s now, by %s.", name, role, who)

    def revoke(self, name: str, who: str) -> None:
        """End a token and all of its sessions at once.

        Raises:
            TokenNotFound: No valid token has this name.
        """
        self._tokens.revoke(name)
        logger.info("Token %s revoked by %s.", name, who)
