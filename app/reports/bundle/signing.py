"""Ed25519 signatures of exported files, and fingerprints of their keys."""

from __future__ import annotations

import hashlib
import re
from typing import Protocol

_PREFIX = "SHA256:"
_FINGERPRINT = re.compile(r"(?:sha256)?([0-9a-f]{64})")


class Signer(Protocol):
    """The holder of a private key."""

    @property
    def public_key(self) -> bytes:
        """The public key, 32 bytes (RFC 8032)."""

    def sign(self, content: bytes) -> bytes:
        """Return the signature, 64 bytes."""


def fingerprint(public_key: bytes) -> str:
    """Return what people compare: the SHA-256 of the 32 bytes of a public key."""
    return _PREFIX + hashlib.sha256(public_key).hexdigest()


def read_fingerprint(words: str) -> str | None:
    """Parse a typed or pasted fingerprint, in any case, with blanks and colons; None if invalid."""
    found = _FINGERPRINT.fullmatch(re.sub(r"[\s:-]", "", words).lower())
    return None if found is None else _PREFIX + found[1]


def public_key_of(pem: bytes) -> bytes | None:
    """Return the 32 bytes of a key file, private or public; None if it is not an Ed25519 key."""
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
    from cryptography.hazmat.primitives.serialization import load_pem_public_key

    for load in (load_pem_public_key, _public_of_private):
        try:
            key = load(pem)
        except (ValueError, TypeError):  # another kind of file, or an encrypted key
            continue
        if isinstance(key, Ed25519PublicKey):
            return key.public_bytes_raw()
    return None


def is_signed_by(public_key: bytes, signature: bytes, content: bytes) -> bool:
    """Return whether the holder of the private key signed exactly this content."""
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    try:
        Ed25519PublicKey.from_public_bytes(public_key).verify(signature, content)
    except (InvalidSignature, ValueError):  # ValueError: the bytes are not a key
        return False
    return True


def _public_of_private(pem: bytes) -> object:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    key = load_pem_private_key(pem, password=None)
    return key.public_key() if isinstance(key, Ed25519PrivateKey) else None
