"""An inspection says whether its distances are of use; an admin states what that means."""

from builders import Client, assert_error
from surveys import Survey


def test_every_inspection_is_judged_by_the_stated_use(server: Client, survey: Survey) -> None:
    assert server.get("/api/intended-use").json() == {"within_m": 0.3, "percent": 2.0}
    before = server.inspection(survey.id)
    assert (before["is_useful"], before["useful_within_m"]) == (True, 0.3)

    strict = {"within_m": before["distance_u95_m"] / 2, "percent": 0.0}
    assert server.put("/api/intended-use", json=strict).json() == strict
    assert server.inspection(survey.id)["is_useful"] is False
    none = strict | {"within_m": 0.0}
    assert_error(server.put("/api/intended-use", json=none), 422, "invalid_request")
