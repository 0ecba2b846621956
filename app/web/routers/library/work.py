"""The day's work: the start page."""

from __future__ import annotations

from fastapi import APIRouter

from app.search.search import Search
from app.survey.assets.search_terms import OrderFilter, Page, WorkFilter, WorkSort, WorkState
from app.web.deps import Service, of_projects, viewer
from app.web.queries import Descending, Limit, Offset, OfProject, Text
from app.web.schemas.library.work import WorkOut
from app.web.slow import slow

router = APIRouter(tags=["work"])


@router.get("/api/work")
@viewer
@of_projects
@slow
def work(
    index: Service[Search],
    of: OfProject,
    search: Text = "",
    state: WorkState | None = None,
    orders: OrderFilter | None = None,
    sort: WorkSort = "state",
    descending: Descending = False,
    offset: Offset = 0,
    limit: Limit = 50,
) -> WorkOut:
    """Return the sections of the register with the state of each, and what is live, waits for a
    reviewer, or has ended.

    The state is that of the newest inspection under the project of the register; `last_at` and
    `worst_severity` are of the newest survey, whatever its project.
    """
    page = Page(sort=sort, descending=descending, offset=offset, limit=limit)
    pending = index.pending()
    found = index.work(WorkFilter(text=search, of=of, state=state, orders=orders), page)
    live, review, past = index.around_the_work()
    return WorkOut(
        total=found.total,
        pending=pending,
        sections=found.sections,
        states=dict(found.states),
        live=live,
        review=review,
        past=past,
    )
