"""The key of a data folder: made once, for its owner only."""

import stat
import threading

import pytest
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

from app.errors import UnreadableKey
from app.storage.folder.signing_key import FILE, SigningKey


def test_it_is_made_on_first_use_and_stays(tmp_path):
    key = SigningKey(tmp_path)
    assert not (tmp_path / FILE).exists()
    signature = key.sign(b"text")
    assert stat.S_IMODE((tmp_path / FILE).stat().st_mode) == 0o600
    again = SigningKey(tmp_path)
    assert again.public_key == key.public_key
    Ed25519PublicKey.from_public_bytes(again.public_key).verify(signature, b"text")
    with pytest.raises(InvalidSignature):
        Ed25519PublicKey.from_public_bytes(again.public_key).verify(signature, b"test")
    assert [path.name for path in tmp_path.iterdir()] == [FILE]


def test_those_who_make_it_at_the_same_time_use_the_same(tmp_path):
    found = []
    start = threading.Barrier(8)

    def use():
        key = SigningKey(tmp_path)
        start.wait()
        found.append(key.public_key)

    threads = [threading.Thread(target=use) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    assert len(set(found)) == 1


@pytest.mark.parametrize("content", [b"", b"no key", b"-----BEGIN PRIVATE KEY-----\nAAAA\n"])
def test_a_damaged_one_is_reported_and_not_replaced(tmp_path, content):
    (tmp_path / FILE).write_bytes(content)
    with pytest.raises(UnreadableKey, match="cannot be read"):
        SigningKey(tmp_path).sign(b"text")
    assert (tmp_path / FILE).read_bytes() == content
