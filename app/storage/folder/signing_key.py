"""The signing key of a data folder: made on first use, readable by its owner only."""

from __future__ import annotations

import os
import secrets
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from app.errors import UnreadableKey
from app.storage.folder.files import raise_if_full, sync_folder

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

FILE = "signing-key.pem"


class SigningKey:
    """The Ed25519 key in `signing-key.pem` (PKCS 8), read or made on first use."""

    def __init__(self, root: Path) -> None:
        self._path = root / FILE

    @property
    def public_key(self) -> bytes:
        """Return the public key, 32 bytes.

        Raises:
            UnreadableKey: The file is damaged, or may not be read.
        """
        return self._key.public_key().public_bytes_raw()

    def sign(self, content: bytes) -> bytes:
        """Return the signature, 64 bytes.

        Raises:
            UnreadableKey: The file is damaged, or may not be read.
        """
        return self._key.sign(content)

    @cached_property
    def _key(self) -> Ed25519PrivateKey:
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
        from cryptography.hazmat.primitives.serialization import load_pem_private_key

        if not self._path.exists():
            self._make()
        try:
            key = load_pem_private_key(self._path.read_bytes(), password=None)
        except (ValueError, TypeError, PermissionError) as error:
            raise UnreadableKey(
                f"The signing key {self._path} cannot be read: {error}. Restore it from a backup; "
                "without it a new key has to be made, and bundles get another fingerprint."
            ) from error
        if not isinstance(key, Ed25519PrivateKey):
            raise UnreadableKey(f"The signing key {self._path} is not an Ed25519 key.")
        return key

    def _make(self) -> None:
        """Make the key; if two processes do so at once, one wins and both use its key."""
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
        from cryptography.hazmat.primitives.serialization import (
            Encoding,
            NoEncryption,
            PrivateFormat,
        )

        pem = Ed25519PrivateKey.generate().private_bytes(
            Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()
        )
        part = self._path.with_name(f".{FILE}.{secrets.token_hex(4)}.part")
        try:
            with open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as out:  # noqa: PTH123
                out.write(pem)
                out.flush()
                os.fsync(out.fileno())
            self._path.hardlink_to(part)  # unlike a rename, a link never replaces
        except FileExistsError:
            pass
        except OSError as error:
            raise_if_full(error)
            raise
        finally:
            part.unlink(missing_ok=True)
        sync_folder(self._path.parent)
