"""Every setting of the server, read from the environment as `CHAINAGE_<NAME>`."""

import os
import re
from ipaddress import IPv4Network, IPv6Network, ip_network
from pathlib import Path
from typing import Annotated, Any, Self
from urllib.parse import urlsplit

from pydantic import Field, SecretStr, ValidationError, field_validator, model_validator
from pydantic_core import ErrorDetails
from pydantic_settings import (
    BaseSettings,
    NoDecode,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
)

from app.errors import InvalidSettings
from app.logs import LogFormat
from app.pictures import MOST_LOGO_PX, UnusablePicture, require_picture

PREFIX = "CHAINAGE_"
_ADDRESS = r"^https?://[A-Za-z0-9._\-\[\]:]+(/[!-~]*)?$"
"""Web addresses without user name and password: the signature already identifies the sender."""
_TILES = re.compile(r"https?://[A-Za-z0-9.-]+(:[0-9]{1,5})?/[!-~]*")
"""Without user name and password; the policy of the page names the host as it stands."""
_PLACEHOLDERS = re.compile(r"{[^}]*}|[{}]")
_PEER = re.compile(r"(([A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+\]):)?[0-9]{1,5}")
_SECRET = ("database", "map_tiles", "token", "webhook_secret", "webhook_url")
_LOGO_BYTES = 2 * 2**20
_THIS_MACHINE = ("127.0.0.1", "::1", "localhost")
GIB = 2**30
MIB = 2**20
SCRATCH_BYTES = 20 * GIB
"""Most bytes of scratch copies of an object store, unless more are in use at a time."""


class Settings(BaseSettings):
    """Settings that an operator may change; passed to `create_app`, never a global."""

    # Compose files pass unset variables as empty.
    model_config = SettingsConfigDict(
        env_prefix=PREFIX, env_ignore_empty=True, extra="forbid", frozen=True
    )

    data: Path = Field(
        default=Path("chainage-data"),
        description="Data folder: database, uploads and inspections. Only a standby shares it.",
    )
    database: SecretStr | None = Field(
        default=None,
        description="PostgreSQL database, such as `postgresql://chainage:password@db.example/"
        "chainage`, in place of the file `chainage.db` in the data folder.",
    )
    token: SecretStr | None = Field(
        default=None,
        min_length=1,
        description="Access token of the server; without it the server makes one and keeps it "
        "in the data folder.",
    )
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(),
        description="Host names, separated by commas, under which the server may be reached, "
        "besides localhost and plain addresses.",
    )
    trusted_proxies: Annotated[tuple[IPv4Network | IPv6Network, ...], NoDecode] = Field(
        default=(),
        description="Addresses or networks, separated by commas, of reverse proxies in front of "
        "the server, such as `127.0.0.1`; only their X-Forwarded-For and X-Forwarded-Proto "
        "are trusted.",
    )
    tls_cert: Path | None = Field(
        default=None,
        description="Certificate with which the server speaks TLS (PEM, with its chain); goes with "
        "`CHAINAGE_TLS_KEY`.",
    )
    tls_key: Path | None = Field(
        default=None, description="Private key of the certificate (PEM, without a password)."
    )
    insecure_lan: bool = Field(
        default=False,
        description="Allow other machines to reach the server without TLS; every page then shows a "
        "red warning.",
    )
    company_name: str | None = Field(
        default=None, max_length=200, description="Name of the company on the report."
    )
    company_logo: Path | None = Field(
        default=None,
        description="Picture on the report (PNG or JPEG, 2 MiB at most), such as the company's "
        "logo.",
    )
    public_url: str | None = Field(
        default=None,
        pattern=_ADDRESS,
        description="Address at which people open the server, such as `https://culverts.example`, "
        "for links in notifications and in the XLSX report.",
    )
    webhook_url: str | None = Field(
        default=None,
        pattern=_ADDRESS,
        repr=False,
        description="Address (http or https, any host) that each severity 5 is posted to at once; "
        "goes with `CHAINAGE_WEBHOOK_SECRET`.",
    )
    webhook_secret: SecretStr | None = Field(
        default=None,
        min_length=16,
        description="Secret that the posts are signed with (HMAC-SHA256), 16 characters or more.",
    )
    meter_counter: str | None = Field(
        default=None,
        description="Port, or host and port, at which other software (WinCan ProTouch) receives "
        "the distance of the running live inspection, such as `127.0.0.1:8095`; a port alone "
        "means this machine.",
    )
    log_format: LogFormat = Field(
        default="text",
        description="Form of the log on standard error: `text` for people, `json` with one object "
        "a line for programs.",
    )
    max_jobs: int = Field(
        default=1,
        ge=0,
        le=16,
        description="Videos that are tracked at the same time; with 0 the server tracks none.",
    )
    max_upload_bytes: int = Field(
        default=64 * GIB, ge=MIB, le=2**42, description="Largest upload that is accepted, in bytes."
    )
    upload_expiry_h: float = Field(
        default=48,
        gt=0,
        le=24 * 365,
        description="Hours after its last byte until an upload is deleted.",
    )
    disk_reserve_bytes: int = Field(
        default=512 * MIB,
        ge=0,
        le=2**50,
        description="Disk space that uploads leave free.",
    )
    child_memory_bytes: int = Field(
        default=1536 * MIB,
        ge=768 * MIB,
        le=2**40,
        description="Address space of a process that decodes media; one that needs more is ended.",
    )
    stall_s: float = Field(
        default=60,
        gt=0,
        le=3600,
        description="Seconds without progress after which tracking is ended. Time in which it "
        "waits for a processor does not count.",
    )
    job_cpu_h: float = Field(
        default=24, gt=0, le=1000, description="Processor hours that tracking one video may take."
    )
    find_defects: bool = Field(
        default=True,
        description="Search the unrolled wall for defects to propose while and after a film is "
        "tracked; without it, only when somebody asks.",
    )

    camera_networks: Annotated[tuple[IPv4Network | IPv6Network, ...], NoDecode] = Field(
        default=tuple(
            map(ip_network, ("10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "fc00::/7"))
        ),
        description="Networks, separated by commas, in which live cameras may be opened; the "
        "private ones by default.",
    )
    watch_folder: Path | None = Field(
        default=None,
        description="Folder in which recorders write files (MPEG-TS, MKV) or pipes that can be "
        "inspected while they grow.",
    )

    map_tiles: str | None = Field(
        default=None,
        max_length=1000,
        repr=False,
        description="Address of raster tiles below the map of assets, such as "
        "`https://tiles.example/{z}/{x}/{y}.png`; the browsers of all users fetch them from there. "
        "None by default.",
    )
    map_attribution: str | None = Field(
        default=None,
        max_length=200,
        description="Whose tiles they are, as their provider wants it shown on the map.",
    )

    store: str | None = Field(
        default=None,
        description="Object store for films, photos, tiles and tracks in place of the data folder: "
        "`s3://bucket/prefix?endpoint=https://host:port&region=name`; credentials come from "
        "`AWS_ACCESS_KEY_ID` and `AWS_SECRET_ACCESS_KEY`.",
    )
    scratch_bytes: int = Field(
        default=SCRATCH_BYTES,
        ge=MIB,
        description="Most bytes of an object store's films that are kept in the data folder to be "
        "decoded, unless more are in use at a time.",
    )
    dask: str | None = Field(
        default=None,
        pattern=r"^(tls|tcp)://[A-Za-z0-9._\-\[\]:]+:[0-9]{1,5}$",
        description="Address of a Dask scheduler whose workers track the films in place of this "
        "machine, such as `tls://scheduler:8786`; `tcp://` on this machine only.",
    )
    dask_ca: Path | None = Field(
        default=None, description="Certificate of the authority of the cluster (PEM)."
    )
    dask_cert: Path | None = Field(
        default=None, description="Certificate of this server for the cluster (PEM)."
    )
    dask_key: Path | None = Field(
        default=None, description="Private key of that certificate (PEM, without a password)."
    )
    archive_folders: Annotated[tuple[Path, ...], NoDecode] = Field(
        default=(),
        description="Folders, separated by colons like those of PATH, from which films of this "
        "machine may be added to the archive.",
    )
    inbox: Path | None = Field(
        default=None,
        description="Folder whose new films are added to the archive by its rules and tracked, "
        "such as the one that a recorder writes to.",
    )
    inbox_settle_s: float = Field(
        default=30,
        gt=0,
        le=86_400,
        description="Seconds without a change after which a film in the inbox is complete.",
    )

    pace: float | None = Field(
        default=None,
        gt=0,
        le=1000,
        description="Track videos at most at this multiple of their own speed; the demo uses it, "
        "so that one can watch. Without it tracking runs as fast as possible.",
    )

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Read no files of settings: to find that none is named took as long as all the rest."""
        return init_settings, env_settings

    @classmethod
    def load(cls, **given: Any) -> Self:
        """Load from the environment, except for given values.

        Raises:
            InvalidSettings: A value is not allowed; the text names the variable, the value (never
            that of the token) and the allowed values.
        """
        try:
            return cls(**given)
        except ValidationError as error:
            raise InvalidSettings("; ".join(map(_reason, error.errors())) + ".") from error

    @property
    def database_url(self) -> str | None:
        """URL of the database; None for the file in the data folder."""
        return None if self.database is None else self.database.get_secret_value()

    @property
    def map_tiles_origin(self) -> str | None:
        """Scheme, host and port of the server of tiles."""
        if self.map_tiles is None:
            return None
        address = urlsplit(self.map_tiles)
        return f"{address.scheme}://{address.netloc}"

    @property
    def has_tls(self) -> bool:
        """Whether the server uses TLS."""
        return self.tls_cert is not None

    @model_validator(mode="after")
    def _certificate_with_key(self) -> Self:
        if (self.tls_cert is None) != (self.tls_key is None):
            raise ValueError("CHAINAGE_TLS_CERT and CHAINAGE_TLS_KEY go together")
        return self

    @model_validator(mode="after")
    def _scheduler_is_safe(self) -> Self:
        """Whoever reaches a scheduler can run code on its workers."""
        address = urlsplit(self.dask or "")
        if address.scheme == "tls" and not (self.dask_ca and self.dask_cert and self.dask_key):
            raise ValueError(
                "CHAINAGE_DASK with tls:// needs CHAINAGE_DASK_CA, CHAINAGE_DASK_CERT and "
                "CHAINAGE_DASK_KEY"
            )
        if address.scheme == "tcp" and address.hostname not in _THIS_MACHINE:
            raise ValueError(
                "CHAINAGE_DASK: whoever reaches a scheduler can run code on its workers, so tcp:// "
                "is allowed on this machine only; use tls://"
            )
        return self

    @model_validator(mode="after")
    def _webhook_with_secret(self) -> Self:
        if (self.webhook_url is None) != (self.webhook_secret is None):
            raise ValueError("CHAINAGE_WEBHOOK_URL and CHAINAGE_WEBHOOK_SECRET go together")
        return self

    @field_validator("database")
    @classmethod
    def _of_postgresql(cls, url: SecretStr | None) -> SecretStr | None:
        if url is not None and not url.get_secret_value().startswith("postgresql://"):
            raise ValueError("It is an address that begins with postgresql://")
        return url

    @field_validator("meter_counter")
    @classmethod
    def _host_and_port(cls, address: str | None) -> str | None:
        found = address is None or _PEER.fullmatch(address)
        if not found or (address and not 0 < int(address.rpartition(":")[2]) < 2**16):
            raise ValueError("It is a port, or a host and a port such as 127.0.0.1:8095")
        return address

    @field_validator("map_tiles")
    @classmethod
    def _of_tiles(cls, address: str | None) -> str | None:
        if address is not None and (
            not _TILES.fullmatch(address)
            or sorted(_PLACEHOLDERS.findall(address)) != ["{x}", "{y}", "{z}"]
        ):
            raise ValueError(
                "It is an address (http or https, without a user name and password) with {z}, {x} "
                "and {y}, such as https://tiles.example/{z}/{x}/{y}.png"
            )
        return address

    @field_validator("company_logo")
    @classmethod
    def _usable_logo(cls, path: Path | None) -> Path | None:
        if path is None:
            return None
        try:
            with path.open("rb") as file:
                content = file.read(_LOGO_BYTES + 1)
        except OSError as error:
            raise ValueError(f"The logo cannot be read: {error.strerror}") from error
        if len(content) > _LOGO_BYTES:
            raise ValueError("The logo is larger than 2 MiB; save it smaller")
        try:
            require_picture(content, MOST_LOGO_PX)
        except UnusablePicture as error:
            raise ValueError(f"The logo {error}") from error
        return path

    @field_validator("allowed_hosts", "camera_networks", "trusted_proxies", mode="before")
    @classmethod
    def _split(cls, value: object) -> object:
        if isinstance(value, str):
            return tuple(name.strip() for name in value.split(",") if name.strip())
        return value

    @field_validator("archive_folders", mode="before")
    @classmethod
    def _split_folders(cls, value: object) -> object:
        if isinstance(value, str):
            return tuple(name for name in value.split(os.pathsep) if name)
        return value


def _reason(fault: ErrorDetails) -> str:
    if not fault["loc"]:  # the fault concerns several settings
        return fault["msg"].removeprefix("Value error, ")
    name = str(fault["loc"][0])
    found = "" if name in _SECRET else f" (found {fault['input']!r})"
    return f"{PREFIX}{name.upper()}: {fault['msg'].removeprefix('Value error, ')}{found}"
