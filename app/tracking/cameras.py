"""Decides which live sources may be opened, and how; nothing else judges a user's address.

A camera's name is resolved once, here, and the resulting address is opened later, so that the name
cannot lead elsewhere meanwhile. USB cameras, files and pipes must be in the server's own list.
"""

from __future__ import annotations

import ipaddress
import socket
import stat
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from urllib.parse import SplitResult, urlsplit

from app.errors import LiveSourceRefused
from app.jobs.live.messages import CameraInput

Network = ipaddress.IPv4Network | ipaddress.IPv6Network
Address = ipaddress.IPv4Address | ipaddress.IPv6Address

_PORTS = {"rtsp": 554, "rtsps": 322, "http": 80, "https": 443}
_RECORDERS_WRITE = (".ts", ".m2ts", ".mts", ".mpg", ".mpeg", ".mkv", ".webm")
"""Suffixes of files that can be read while they grow."""
_GROWING_FORMATS = "mpegts,mpeg,matroska,webm"
_METADATA = frozenset(
    ipaddress.ip_address(text)
    for text in ("169.254.169.254", "169.254.170.2", "100.100.100.200", "fd00:ec2::254")
)
"""Addresses at which some clouds give their machines credentials."""
_LONGEST_NAME = 255


@dataclass(frozen=True)
class ListedSource:
    """A source found by the server."""

    url: str
    kind: Literal["usb", "folder", "pipe"]
    name: str


@dataclass(frozen=True)
class LiveSource:
    """A source that may be opened."""

    camera: CameraInput
    shown: str
    """The address without password and query, for display."""


class Sources:
    """Finds and judges live sources."""

    def __init__(
        self,
        networks: Sequence[Network],
        watch_folder: Path | None,
        *,
        devices: Path = Path("/sys/class/video4linux"),
    ) -> None:
        """Set where to look and what to allow.

        Args:
            networks: Networks of allowed cameras.
            watch_folder: Folder in which recorders write files and pipes, if there is one.
            devices: Folder in which the system lists its cameras.
        """
        self._networks = tuple(networks)
        self._watch_folder = watch_folder
        self._devices = devices

    def listed(self) -> list[ListedSource]:
        """Return USB cameras, growing files and pipes, sorted by name."""
        return [*self._usb(), *self._watched()]

    def resolve(self, url: str, size_wh: tuple[int, int]) -> LiveSource:
        """Return the source at an address; blocks during the name look-up.

        Args:
            url: The address given by the user.
            size_wh: Requested picture size, for cameras that offer several.
        Raises:
            LiveSourceRefused: The source is not allowed; the text repeats no password.
        """
        kind, _, name = url.partition(":")
        if kind in ("usb", "file", "pipe"):
            return self._local(url, kind, name, size_wh)
        return self._network(url)

    def _usb(self) -> list[ListedSource]:
        found = []
        for device in sorted(self._devices.glob("video*")):
            # A camera has several nodes; the first delivers pictures, the others metadata.
            if _line(device / "index") in ("0", ""):
                name = _line(device / "name") or device.name
                found.append(ListedSource(f"usb:{device.name}", "usb", name))
        return found

    def _watched(self) -> list[ListedSource]:
        if self._watch_folder is None or not self._watch_folder.is_dir():
            return []
        found = []
        for path in sorted(self._watch_folder.iterdir()):
            if not path.name.isprintable():
                continue
            mode = path.lstat().st_mode  # a link may lead out of the folder
            if stat.S_ISFIFO(mode):
                found.append(ListedSource(f"pipe:{path.name}", "pipe", path.name))
            elif stat.S_ISREG(mode) and path.suffix.lower() in _RECORDERS_WRITE:
                found.append(ListedSource(f"file:{path.name}", "folder", path.name))
        return found

    def _local(self, url: str, kind: str, name: str, size_wh: tuple[int, int]) -> LiveSource:
        listed = next((source for source in self.listed() if source.url == url), None)
        if listed is None:
            raise LiveSourceRefused(
                "The server has no such camera, file or pipe; choose one from its list."
            )
        if kind == "usb":
            options = {
                "input_format": "mjpeg",
                "video_size": f"{size_wh[0]}x{size_wh[1]}",
                "protocol_whitelist": "file",
            }
            return LiveSource(CameraInput("usb", f"/dev/{name}", options), listed.name)
        assert self._watch_folder is not None  # noqa: S101  (something in it is listed)
        place = str(self._watch_folder.resolve() / name)
        formats = {"format_whitelist": _GROWING_FORMATS}
        if kind == "pipe":
            options = {"protocol_whitelist": "fd", **formats}
            return LiveSource(CameraInput("pipe", place, options), name)
        options = {"protocol_whitelist": "file", "follow": "1", **formats}
        return LiveSource(CameraInput("file", f"file:{place}", options), name)

    def _network(self, url: str) -> LiveSource:
        parts, port = _split(url)
        host = parts.hostname or ""
        address = self._address_of(host, port)
        login, at, named = parts.netloc.rpartition("@")
        literal = f"[{address}]" if address.version == 6 else str(address)
        location = parts._replace(netloc=f"{login}{at}{literal}:{port}", fragment="")
        # Some cameras expect the password in the query.
        shown = parts._replace(netloc=named, query="..." if parts.query else "", fragment="")
        is_rtsp = parts.scheme in ("rtsp", "rtsps")
        camera = CameraInput(
            "rtsp" if is_rtsp else "mjpeg",
            location.geturl(),
            _rtsp_options() if is_rtsp else _http_options(parts.scheme, named, host),
            str(address),
        )
        return LiveSource(camera, shown.geturl()[:_LONGEST_NAME])

    def _address_of(self, host: str, port: int) -> Address:
        """Return the first address of a host, if every one of its addresses is allowed."""
        try:
            found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        except (OSError, UnicodeError) as error:
            raise LiveSourceRefused(
                f"The camera's name {host!r} is not known in this network."
            ) from error
        addresses = [_plain(str(entry[4][0])) for entry in found]
        for address in addresses:
            if not _is_allowed(address, self._networks):
                raise LiveSourceRefused(
                    f"Cameras at {address} may not be opened; the server's operator can allow a "
                    "network in CHAINAGE_CAMERA_NETWORKS."
                )
        return addresses[0]


def _split(url: str) -> tuple[SplitResult, int]:
    """Split a network address into parts and port, or raise LiveSourceRefused."""
    if not url.isascii() or not url.isprintable() or " " in url:
        raise LiveSourceRefused("The camera's address has characters that no address has.")
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise LiveSourceRefused("The camera's address cannot be understood.") from error
    if parts.scheme not in _PORTS:
        raise LiveSourceRefused(
            "A camera's address begins with rtsp://, rtsps://, http:// or https://."
        )
    if not parts.hostname:
        raise LiveSourceRefused("The camera's address names no host.")
    return parts, port or _PORTS[parts.scheme]


def _plain(text: str) -> Address:
    address = ipaddress.ip_address(text.partition("%")[0])
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return mapped or address


def _is_allowed(address: Address, networks: Iterable[Network]) -> bool:
    """Return whether an allowed network contains the address; a special address needs a network of
    its own kind.

    So "everything" excludes the machine itself, which must be named to be allowed.
    """
    if address in _METADATA or address.is_multicast or address.is_unspecified:
        return False
    if not address.is_loopback and (address.is_reserved or _is_tunnel(address)):
        return False
    return any(
        address in network
        and address.is_loopback == network.is_loopback
        and address.is_link_local == network.is_link_local
        for network in networks
    )


def _is_tunnel(address: Address) -> bool:
    """Return whether an IPv6 address carries an IPv4 one, to which it may lead: 6to4 and Teredo.

    Addresses of NAT64 and IPv4-compatible ones are reserved anyway.
    """
    return isinstance(address, ipaddress.IPv6Address) and (
        address.sixtofour is not None or address.teredo is not None
    )


def _rtsp_options() -> dict[str, str]:
    return {
        "protocol_whitelist": "rtsp,rtsps,rtp,tcp,tls",
        "rtsp_transport": "tcp",
        "allowed_media_types": "video",
    }


def _http_options(scheme: str, named: str, host: str) -> dict[str, str]:
    """Return options that connect to the judged address and name the host in the request."""
    options = {
        "protocol_whitelist": "http,tcp" if scheme == "http" else "https,http,tls,tcp",
        "max_redirects": "0",
        "headers": f"Host: {named}\r\n",
    }
    # Cameras sign their own certificates, so there is nothing to check them against.
    return options | ({"verifyhost": host} if scheme == "https" else {})


def _line(path: Path) -> str:
    """Return the text of a small system file, "" without one."""
    try:
        return path.read_text("utf-8", "replace").strip()
    except OSError:
        return ""
