"""An admin makes tokens, changes their roles and ends them; each counts at once."""

from __future__ import annotations

from builders import Client, assert_error


def test_a_token_is_made_changed_and_ended(shared: Client) -> None:
    made = shared.post("/api/tokens", json={"name": "Ana / crew 2", "role": "viewer"})
    crew = {"Authorization": f"Bearer {made.json()['secret']}"}
    assert_error(
        shared.post("/api/tokens", json={"name": "Ana / crew 2", "role": "admin"}),
        409,
        "token_name_taken",
    )
    for name in ("server", " spaced", ""):
        refused = shared.post("/api/tokens", json={"name": name, "role": "admin"})
        assert_error(refused, 422, "invalid_request")

    assert_error(shared.post("/api/samples", headers=crew), 403, "forbidden")
    path = "/api/tokens/Ana%20%2F%20crew%202"
    assert shared.put(f"{path}/role", json={"role": "operator"}).status_code == 204
    assert_error(shared.get("/api/tokens", headers=crew), 403, "forbidden")
    with shared.anonymous() as browser:
        entered = browser.post("/api/login", json={"token": made.json()["secret"]})
        assert entered.status_code == 204
    own, ana = shared.get("/api/tokens").json()["tokens"]
    assert own["is_server"]
    assert own["seen_at"] is not None
    assert (ana["name"], ana["role"], ana["sessions"]) == ("Ana / crew 2", "operator", 1)
    assert ana["seen_at"] > ana["created_at"]
    assert "digest" not in ana
    assert "secret" not in ana

    assert shared.delete(path).status_code == 204
    assert_error(shared.get("/api/me", headers=crew), 401, "unauthenticated")
    assert_error(shared.delete(path), 404, "token_not_found")
    assert_error(shared.delete("/api/tokens/server"), 404, "token_not_found")
    (_, ended) = shared.get("/api/tokens").json()["tokens"]
    assert ended["revoked_at"] is not None
    assert ended["sessions"] == 0
