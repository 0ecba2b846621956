"""The logged-in person and their choices for the page."""

from __future__ import annotations

from fastapi import APIRouter

from app import errors
from app.inspections.preferences import Preferences
from app.web.deps import PrincipalDep, Service, viewer
from app.web.schemas.access import MeOut, PreferencesIn
from app.web.schemas.failures import failures

router = APIRouter(prefix="/api/me", tags=["access"])


@router.get("")
@viewer
def me(preferences: Service[Preferences], principal: PrincipalDep) -> MeOut:
    """Return name, role and preferences; people are distinguished by the names of their tokens."""
    chosen = PreferencesIn.model_validate(preferences.of(principal.name))
    return MeOut(name=principal.name, role=principal.role, preferences=chosen)


@router.put("/preferences", responses=failures(errors.PackNotFound))
@viewer
def choose(
    body: PreferencesIn, preferences: Service[Preferences], principal: PrincipalDep
) -> PreferencesIn:
    """Replace all preferences."""
    preferences.replace(principal.name, body.model_dump())
    return body
