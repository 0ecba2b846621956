"""A key for tests."""

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey


class Key:
    """Signs with a fixed private key, the number 7 repeated."""

    def __init__(self, number: int = 7) -> None:
        self._key = Ed25519PrivateKey.from_private_bytes(bytes([number] * 32))

    @property
    def public_key(self) -> bytes:
        """The public key, 32 bytes."""
        return self._key.public_key().public_bytes_raw()

    def sign(self, content: bytes) -> bytes:
        """Return the signature, 64 bytes."""
        return self._key.sign(content)
