"""OGC API Features Part 1 (17-069r4): the documents and the features, for reading only."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Any
from urllib.parse import quote, urlencode

import msgspec
from fastapi import APIRouter, Path, Request, Response

from app import errors
from app.search.features import AFTER, COLLECTIONS, Collection, Features
from app.survey.assets.search_terms import FeatureFilter
from app.web.deps import Service, of_projects, viewer
from app.web.routers.ogc.query import parameters, parsed, require_known
from app.web.schemas.failures import content, failures
from app.web.slow import slow

router = APIRouter(prefix="/ogc", tags=["ogc"])

GEOJSON = "application/geo+json"
_JSON = "application/json"
_CRS84 = "http://www.opengis.net/def/crs/OGC/1.3/CRS84"
_CLASSES = [
    f"http://www.opengis.net/spec/ogcapi-features-1/1.0/conf/{name}" for name in ("core", "geojson")
]
_FAILURES = failures(errors.InvalidQuery, errors.FeatureNotFound)

CollectionId = Annotated[str, Path(max_length=100)]
FeatureId = Annotated[str, Path(max_length=300)]


@router.get("", responses=_FAILURES)
@router.get("/", include_in_schema=False)
@viewer
@of_projects
def landing(request: Request) -> dict[str, Any]:
    """Return where everything is."""
    require_known(request.query_params)
    server = _server(request)
    openapi = "application/vnd.oai.openapi+json;version=3.1"
    return {
        "title": "Chainage",
        "description": "Culverts, their inspections and what was seen in them.",
        "links": [
            _link(f"{server}/ogc", "self", _JSON, "This document"),
            _link(f"{server}/api/openapi.json", "service-desc", openapi, "The whole API"),
            _link(f"{server}/ogc/conformance", "conformance", _JSON, "Conformance classes"),
            _link(f"{server}/ogc/collections", "data", _JSON, "Collections"),
        ],
    }


@router.get("/conformance", responses=_FAILURES)
@viewer
@of_projects
def conformance(request: Request) -> dict[str, Any]:
    """Return what of the standard holds here."""
    require_known(request.query_params)
    return {"conformsTo": _CLASSES}


@router.get("/collections", responses=_FAILURES)
@viewer
@of_projects
def collections(request: Request) -> dict[str, Any]:
    """Return the collections."""
    require_known(request.query_params)
    server = _server(request)
    return {
        "links": [_link(f"{server}/ogc/collections", "self", _JSON, "This document")],
        "collections": [_described(each, server) for each in COLLECTIONS.values()],
    }


@router.get("/collections/{collection_id}", responses=_FAILURES)
@viewer
@of_projects
def collection(collection_id: CollectionId, request: Request) -> dict[str, Any]:
    """Return a collection."""
    require_known(request.query_params)
    return _described(_collection(collection_id), _server(request))


@router.get(
    "/collections/{collection_id}/items",
    response_class=Response,
    responses=content(GEOJSON) | _FAILURES,
    openapi_extra={"parameters": parameters(COLLECTIONS["observations"].parameters)},
)
@viewer
@of_projects
@slow
def items(collection_id: CollectionId, request: Request, features: Service[Features]) -> Response:
    """Return a page of features: from the index, which follows changes within seconds."""
    kind = _collection(collection_id)
    query = parsed(request.query_params, kind.parameters)
    after = None if query.after is None else kind.key(query.after)
    if query.after is not None and after is None:
        raise errors.InvalidQuery(f"{AFTER} is taken from the link next of another page.")
    page = features.page(kind, query.wanted, after, query.limit)
    server = _server(request)
    found = [kind.feature(row, server) for row in page.rows]
    here = f"{server}/ogc/collections/{kind.id}"
    given = dict(request.query_params)
    links = [
        _link(_with(f"{here}/items", given), "self", GEOJSON, "This page"),
        _link(here, "collection", _JSON, kind.title),
    ]
    if not page.is_last:
        more = given | {AFTER: found[-1]["id"]}
        links.append(_link(_with(f"{here}/items", more), "next", GEOJSON, "The next page"))
    return _geojson(
        {
            "type": "FeatureCollection",
            "timeStamp": datetime.now(UTC),
            "numberMatched": page.matched,
            "numberReturned": len(found),
            "links": links,
            "features": found,
        }
    )


@router.get(
    "/collections/{collection_id}/items/{feature_id:path}",
    response_class=Response,
    responses=content(GEOJSON) | _FAILURES,
)
@viewer
@of_projects
def item(
    collection_id: CollectionId,
    feature_id: FeatureId,
    request: Request,
    features: Service[Features],
) -> Response:
    """Return a feature."""
    kind = _collection(collection_id)
    require_known(request.query_params)
    key = kind.key(feature_id)
    rows = features.page(kind, FeatureFilter(key=key), None, 1).rows if key else ()
    if not rows:
        raise errors.FeatureNotFound(f"There is no such feature in {kind.id}.")
    server = _server(request)
    here = f"{server}/ogc/collections/{kind.id}"
    found = kind.feature(rows[0], server)
    links = [
        _link(f"{here}/items/{quote(feature_id, safe='')}", "self", GEOJSON, "This feature"),
        _link(here, "collection", _JSON, kind.title),
        _link(found["properties"]["page"], "alternate", "text/html", "Its page"),
    ]
    if photo := found["properties"].get("photo"):
        links.append(_link(photo, "enclosure", "image/jpeg", "Its photo"))
    return _geojson(found | {"links": links})


def _described(kind: Collection, server: str) -> dict[str, Any]:
    here = f"{server}/ogc/collections/{kind.id}"
    return {
        "id": kind.id,
        "title": kind.title,
        "description": kind.description,
        "itemType": "feature",
        "crs": [_CRS84],
        "links": [
            _link(here, "self", _JSON, kind.title),
            _link(f"{here}/items", "items", GEOJSON, "The features"),
        ],
    }


def _collection(collection_id: str) -> Collection:
    kind = COLLECTIONS.get(collection_id)
    if kind is None:
        names = ", ".join(COLLECTIONS)
        raise errors.FeatureNotFound(f"There is no such collection; there are {names}.")
    return kind


def _server(request: Request) -> str:
    """Return the address at which the client has reached the server."""
    return str(request.base_url).rstrip("/")


def _link(href: str, rel: str, media_type: str, title: str) -> dict[str, str]:
    return {"href": href, "rel": rel, "type": media_type, "title": title}


def _with(address: str, given: dict[str, str]) -> str:
    return f"{address}?{urlencode(given)}" if given else address


def _geojson(document: dict[str, Any]) -> Response:
    return Response(msgspec.json.encode(document), media_type=GEOJSON)
