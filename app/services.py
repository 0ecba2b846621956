"""The running services of a server, each once, found by its class."""

from __future__ import annotations

from typing import TypeVar, cast

Kind = TypeVar("Kind")


class Services:
    """Holds what the rooms have built; a router asks for the one service that it calls."""

    def __init__(self) -> None:
        self._by_class: dict[type, object] = {}

    def add(self, service: Kind) -> Kind:
        """Add a service, and return it."""
        self._by_class[type(service)] = service
        return service

    def has(self, kind: type) -> bool:
        """Return whether the service of this class was added."""
        return kind in self._by_class

    def __getitem__(self, kind: type[Kind]) -> Kind:
        """Return the service of this class."""
        return cast(Kind, self._by_class[kind])
