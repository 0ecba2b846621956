"""What the stores have in common: each of their methods is one reading or writing transaction."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

from sqlalchemy.orm import Session

from app.storage.database.database import Database

Given = ParamSpec("Given")
Result = TypeVar("Result")
Kind = TypeVar("Kind", bound="Store")


class Store:
    """A part of the database; what it returns is detached, so to change it changes nothing."""

    def __init__(self, database: Database) -> None:
        self.database = database


def reading(
    method: Callable[Concatenate[Kind, Session, Given], Result],
) -> Callable[Concatenate[Kind, Given], Result]:
    """Give a method a session that sees one consistent state and cannot write."""

    @wraps(method)
    def run(self: Kind, /, *args: Given.args, **given: Given.kwargs) -> Result:
        with self.database.read() as session:
            return method(self, session, *args, **given)

    return run


def writing(
    method: Callable[Concatenate[Kind, Session, Given], Result],
) -> Callable[Concatenate[Kind, Given], Result]:
    """Make a method one transaction of the writer: when it returns, all of it is synced."""

    @wraps(method)
    def run(self: Kind, /, *args: Given.args, **given: Given.kwargs) -> Result:
        return self.database.write(lambda session: method(self, session, *args, **given))

    return run
