"""The map of all assets with their grades."""

from __future__ import annotations

from fastapi import APIRouter, Response

from app.search.asset_map import AssetMaps, WantedAssets
from app.search.search import Search
from app.web.deps import Service, of_projects, viewer
from app.web.queries import Name, SeverityFrom
from app.web.schemas.library.asset_map import AssetMapOut
from app.web.slow import heavy

router = APIRouter(tags=["search"])


@router.get("/api/map", response_model=AssetMapOut)
@viewer
@of_projects
@heavy
def asset_map(
    asset_maps: Service[AssetMaps],
    index: Service[Search],
    project: Name = None,
    asset: Name = None,
    severity_from: SeverityFrom = None,
) -> Response:
    """Return where the assets are, with the worst severity of the newest inspection of each.

    Project and asset are whole names. The place is that of the register, else that of the header
    of the newest inspection that states one, else that of an asset whose id is spelled alike, as
    CV-01 and cv 01 are. Of more than 20,000 assets the worst are returned.
    """
    pending = index.pending()
    wanted = WantedAssets(project=project, asset=asset, severity_from=severity_from)
    maps = asset_maps
    found = AssetMapOut.of(maps.map_of(wanted), maps.background, pending)
    # Written here: the thread that answers all requests would be busy with it for a second.
    return Response(found.model_dump_json(), media_type="application/json")
