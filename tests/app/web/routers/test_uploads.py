import base64
import hashlib
import os
import shutil
import socket
import time
from pathlib import Path

import httpx
import pytest
from builders import TUS, Client, assert_error, serving, wait_until

from app.inspections.films.uploads import MOST_OF_A_TOKEN

CONTENT = bytes(range(256)) * 4096 * 3  # 3 MiB


def create(client: Client, length: int = len(CONTENT), **headers: str) -> str:
    answer = client.post("/api/uploads", headers={**TUS, "Upload-Length": str(length), **headers})
    assert answer.status_code == 201
    return str(answer.headers["Location"])


def offset(client: Client, location: str) -> int:
    return int(client.head(location, headers=TUS).headers["Upload-Offset"])


def checksum(content: bytes, algorithm: str = "sha256") -> str:
    digest = hashlib.new(algorithm, content).digest()
    return f"{algorithm} {base64.b64encode(digest).decode()}"


def stored(client: Client, location: str) -> bytes:
    return (client.data / "uploads" / f"{location.rsplit('/', 1)[1]}.bin").read_bytes()


def test_a_file_arrives_piece_by_piece(shared: Client) -> None:
    location = create(shared)
    half = len(CONTENT) // 2
    first = shared.patch_upload(location, 0, CONTENT[:half])
    assert (first.status_code, first.headers["Upload-Offset"]) == (204, str(half))
    assert offset(shared, location) == half
    last = shared.patch_upload(location, half, CONTENT[half:])
    assert last.headers["Upload-Offset"] == str(len(CONTENT))
    assert stored(shared, location) == CONTENT


def test_the_server_says_what_it_can_do(shared: Client) -> None:
    headers = shared.options("/api/uploads").headers
    assert headers["Tus-Version"] == "1.0.0"
    assert {"creation", "termination", "checksum"} <= set(headers["Tus-Extension"].split(","))
    assert headers["Tus-Checksum-Algorithm"] == "sha1,sha256"
    assert int(headers["Tus-Max-Size"]) > 2**30


def test_head_returns_what_was_announced(shared: Client) -> None:
    metadata = "filename " + base64.b64encode("bär.mp4".encode()).decode()
    location = create(shared, 77, **{"Upload-Metadata": metadata})
    headers = shared.head(location, headers=TUS).headers
    assert headers["Upload-Offset"] == "0"
    assert headers["Upload-Length"] == "77"
    assert headers["Upload-Metadata"] == metadata
    assert headers["Cache-Control"] == "no-store"
    assert "Upload-Expires" in headers


def test_every_answer_names_the_version_and_a_foreign_one_is_refused(shared: Client) -> None:
    for version in ({}, {"Tus-Resumable": "0.2.2"}):
        answer = shared.post("/api/uploads", headers={"Upload-Length": "1", **version})
        assert_error(answer, 412, "unsupported_tus_version")
        assert answer.headers["Tus-Version"] == "1.0.0"
        assert answer.headers["Tus-Resumable"] == "1.0.0"
    assert shared.anonymous().head("/api/uploads/x").headers["Tus-Resumable"] == "1.0.0"


@pytest.mark.parametrize("length", [None, "", "-1", "1.5", "ten", "١٢", "9" * 30])
def test_a_length_that_cannot_be_read_is_refused(shared: Client, length: str | None) -> None:
    headers = TUS if length is None else {**TUS, "Upload-Length": length.encode()}
    assert_error(shared.post("/api/uploads", headers=headers), 400, "invalid_upload")


def test_more_than_the_server_takes_is_refused_at_once(tmp_path: Path) -> None:
    with serving(tmp_path, max_upload_bytes=2**20) as client:
        answer = client.post("/api/uploads", headers={**TUS, "Upload-Length": str(2**20 + 1)})
        assert_error(answer, 413, "upload_too_large")


def test_a_wrong_offset_is_answered_with_the_true_one(shared: Client) -> None:
    location = create(shared)
    shared.patch_upload(location, 0, CONTENT[:500])
    for wrong in (0, 499, 501):
        answer = shared.patch_upload(location, wrong, CONTENT[:10])
        assert_error(answer, 409, "offset_conflict")
        assert answer.headers["Upload-Offset"] == "500"
    assert offset(shared, location) == 500


def test_more_than_announced_is_refused_and_not_kept(shared: Client) -> None:
    location = create(shared, 100)
    assert_error(shared.patch_upload(location, 0, CONTENT[:101]), 413, "upload_too_large")
    assert offset(shared, location) <= 100
    location = create(shared, 100)
    headers = {"Upload-Checksum": checksum(CONTENT[:101])}
    refused = shared.patch_upload(location, 0, CONTENT[:101], **headers)
    assert_error(refused, 413, "upload_too_large")
    assert offset(shared, location) == 0


def test_only_the_content_type_of_tus_is_taken(shared: Client) -> None:
    answer = shared.patch_upload(create(shared), 0, b"x", **{"Content-Type": "text/plain"})
    assert_error(answer, 415, "wrong_content_type")


@pytest.mark.parametrize("algorithm", ["sha1", "sha256"])
def test_a_damaged_piece_does_not_count(shared: Client, algorithm: str) -> None:
    location = create(shared)
    good = {"Upload-Checksum": checksum(CONTENT[:1000], algorithm)}
    damaged = shared.patch_upload(location, 0, b"\0" * 1000, **good)
    assert_error(damaged, 460, "checksum_mismatch")
    assert offset(shared, location) == 0
    assert shared.patch_upload(location, 0, CONTENT[:1000], **good).status_code == 204


@pytest.mark.parametrize("value", ["md5 abcd", "sha256", "sha256 !!!", "sha256 ö".encode()])
def test_a_checksum_that_cannot_be_used_is_refused(shared: Client, value: str | bytes) -> None:
    answer = shared.patch_upload(create(shared), 0, b"x", **{"Upload-Checksum": value})
    assert_error(answer, 400 if value != "sha256" else 460, answer.json()["code"])


def test_a_piece_with_a_checksum_has_a_bound(shared: Client) -> None:
    piece = bytes(16 * 2**20 + 1)
    location = create(shared, len(piece))
    answer = shared.patch_upload(location, 0, piece, **{"Upload-Checksum": checksum(piece)})
    assert_error(answer, 413, "upload_too_large")


def test_a_deleted_upload_is_gone(shared: Client) -> None:
    location = create(shared)
    assert shared.delete(location, headers=TUS).status_code == 204
    assert shared.head(location, headers=TUS).status_code == 404
    assert_error(shared.delete(location, headers=TUS), 404, "upload_not_found")
    assert_error(shared.patch_upload(location, 0, b"x"), 404, "upload_not_found")


@pytest.mark.parametrize("name", ["x", "..%2f..%2fchainage", "A" * 32, "0" * 31, "%00"])
def test_ids_that_are_not_ours_are_not_found(shared: Client, name: str) -> None:
    assert shared.head(f"/api/uploads/{name}", headers=TUS).status_code == 404


def raw_patch(client: Client, location: str, announced: int, offset: int = 0) -> socket.socket:
    """A PATCH whose body is still to come."""
    url = httpx.URL(client.server.url)
    connection = socket.create_connection((url.host, url.port))
    lines = [
        f"PATCH {location} HTTP/1.1",
        f"Host: {url.host}",
        f"Authorization: {client.headers['Authorization']}",
        "Tus-Resumable: 1.0.0",
        f"Upload-Offset: {offset}",
        "Content-Type: application/offset+octet-stream",
        f"Content-Length: {announced}",
    ]
    connection.sendall("\r\n".join([*lines, "", ""]).encode())
    return connection


def test_a_broken_connection_keeps_what_came(shared: Client) -> None:
    location = create(shared)
    with raw_patch(shared, location, len(CONTENT)) as connection:
        connection.sendall(CONTENT[:1_500_000])
    arrived = wait_until(lambda: offset(shared, location) == 1_500_000 and 1_500_000)
    rest = wait_until(lambda: finish(shared, location, arrived))
    assert rest.status_code == 204
    assert stored(shared, location) == CONTENT


def finish(client: Client, location: str, arrived: int) -> httpx.Response | None:
    answer = client.patch_upload(location, arrived, CONTENT[arrived:])
    return None if answer.status_code == 423 else answer


def test_one_request_at_a_time_uses_an_upload(shared: Client) -> None:
    location = create(shared)
    with raw_patch(shared, location, len(CONTENT)) as connection:
        connection.sendall(CONTENT[:1_100_000])
        wait_until(lambda: offset(shared, location) > 0)
        second = shared.patch_upload(location, offset(shared, location), b"x")
        assert_error(second, 423, "upload_busy")
        assert_error(shared.delete(location, headers=TUS), 423, "upload_busy")


def test_forgotten_uploads_expire(tmp_path: Path) -> None:
    with serving(tmp_path) as client:
        old, new = create(client), create(client)
    two_days_ago = time.time() - 49 * 3600
    for path in (tmp_path / "uploads").glob(f"{old.rsplit('/', 1)[1]}.*"):
        os.utime(path, (two_days_ago, two_days_ago))
    with serving(tmp_path) as client:
        wait_until(lambda: client.head(old, headers=TUS).status_code == 404)
        assert client.head(new, headers=TUS).status_code == 200
        assert len(list((tmp_path / "uploads").iterdir())) == 2


def test_announcements_have_a_quota_and_count_as_filled_disk(tmp_path: Path) -> None:
    with serving(tmp_path) as client:
        free = shutil.disk_usage(tmp_path).free
        large = {**TUS, "Upload-Length": str(round(0.6 * min(free, client_limit(client))))}
        most = 1 + free // int(large["Upload-Length"])
        answers = [client.post("/api/uploads", headers=large) for _ in range(most)]
        assert answers[0].status_code == 201
        assert_error(answers[-1], 507, "disk_full")
        for answer in answers:
            if answer.is_success:
                client.delete(answer.headers["Location"], headers=TUS)
        places = [create(client, 1) for _ in range(MOST_OF_A_TOKEN)]
        one_more = {**TUS, "Upload-Length": "1"}
        refused = client.post("/api/uploads", headers=one_more)
        assert_error(refused, 429, "too_many_uploads")
        client.delete(places[0], headers=TUS)
        assert client.post("/api/uploads", headers=one_more).status_code == 201


def client_limit(client: Client) -> int:
    return int(client.options("/api/uploads").headers["Tus-Max-Size"])
