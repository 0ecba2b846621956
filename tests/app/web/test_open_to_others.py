"""What `chainage serve` and `chainage token` say and refuse before a server runs."""

import hashlib
import json

import pytest

ALL = "0.0.0.0"  # noqa: S104  (refused, not bound)
REFUSAL = "Other machines could reach the server on"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["serve", "--host", ALL], f"{REFUSAL} {ALL}"),
        (["serve", "--host", "::"], f"{REFUSAL} ::"),
        (["serve", "--host", ""], f"{REFUSAL} {ALL}"),
        (["demo", "--host", ALL], f"{REFUSAL} {ALL}"),
        (["serve", "--tls-cert", "cert.pem"], "CHAINAGE_TLS_CERT and CHAINAGE_TLS_KEY go together"),
        (["serve", "--tls-cert", __file__, "--tls-key", __file__], "cannot be used"),
        (
            ["serve", "--host", ALL, "--tls-cert", "none", "--tls-key", "none"],
            "cannot be used",
        ),
    ],
)
def test_a_server_that_others_reach_is_not_started_unprotected(
    chainage, tmp_path, monkeypatch, words, said
):
    monkeypatch.setenv("CHAINAGE_DATA", str(tmp_path / "data"))
    done = chainage(*words, "--port", "0")
    assert done.code == 1
    assert done.err.strip().startswith("chainage: ")
    assert said in done.err
    assert "Traceback" not in done.err
    assert list(tmp_path.iterdir()) == []


def test_a_token_is_shown_once_and_kept_as_a_hash(chainage, tmp_path):
    made = chainage("token", "create", "Crew 7", "--role", "operator", "--data", tmp_path)
    secret = made.out.strip()
    assert (made.code, len(secret)) == (0, 43)
    kept = (tmp_path / "tokens.json").read_text()
    assert secret not in kept + made.err
    assert json.loads(kept)["tokens"][0]["digest"] == hashlib.sha256(secret.encode()).hexdigest()
    assert chainage("token", "revoke", "Crew 7", "--data", tmp_path).code == 0
    listed = chainage("token", "list", "--data", tmp_path)
    assert "Crew 7" in listed.out
    assert secret not in listed.out
    again = chainage("token", "revoke", "Crew 7", "--data", tmp_path)
    assert (again.code, again.err) == (1, "chainage: There is no valid token 'Crew 7'.\n")


@pytest.mark.parametrize("name", ["server", "", " crew", "a\nb", "x" * 101])
def test_a_name_that_would_mislead_the_history_is_refused(chainage, tmp_path, name):
    done = chainage("token", "create", name, "--role", "viewer", "--data", tmp_path)
    assert done.code == 2
    assert list(tmp_path.iterdir()) == []
