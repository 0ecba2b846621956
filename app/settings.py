"""Every setting of the server, read from the environment as `CHAINAGE_<NAME>`."""

from ipaddress import IPv4Network, IPv6Network, ip_network
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, SecretStr, ValidationError, field_validator, model_validator
from pydantic_core import ErrorDetails
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from app.errors import InvalidSettings
from app.logs import LogFormat

PREFIX = "CHAINAGE_"
GIB = 2**30
MIB = 2**20


class Settings(BaseSettings):
    """What an operator may change; handed to `create_app`, never a global."""

    # Compose files pass on what is unset as empty.
    model_config = SettingsConfigDict(
        env_prefix=PREFIX, env_ignore_empty=True, extra="forbid", frozen=True
    )

    data: Path = Field(
        default=Path("chainage-data"),
        description="Data folder: database, uploads and inspections. One server at a time uses it.",
    )
    token: SecretStr | None = Field(
        default=None,
        min_length=1,
        description="Access token of the server; without it one is made and kept in the data "
        "folder.",
    )
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(),
        description="Host names, separated by commas, under which the server may be reached, "
        "besides localhost and plain addresses.",
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
        default=None, description="Picture on the report (PNG or JPEG), such as the company's logo."
    )
    log_format: LogFormat = Field(
        default="text",
        description="Form of the log on standard error: `text` to be read, `json` with an object a "
        "line for programs.",
    )
    max_jobs: int = Field(
        default=1, ge=1, le=16, description="Videos that are tracked at the same time."
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
        description="Free disk space that uploads leave untouched.",
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
        description="Seconds without progress after which tracking is ended.",
    )
    job_cpu_h: float = Field(
        default=24, gt=0, le=1000, description="Processor hours that tracking one video may take."
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

    pace: float | None = Field(
        default=None,
        gt=0,
        le=1000,
        description="Track videos no faster than so many times their own speed; the demo does, so "
        "that one can watch. Without it tracking is as fast as it can.",
    )

    @classmethod
    def load(cls, **given: Any) -> Self:
        """From the environment, except for what is given.

        Raises:
            InvalidSettings: A value that is not allowed; the text names the variable, the value
            (never that of the token) and what is allowed.
        """
        try:
            return cls(**given)
        except ValidationError as error:
            raise InvalidSettings("; ".join(map(_reason, error.errors())) + ".") from error

    @property
    def has_tls(self) -> bool:
        """Whether the server speaks TLS."""
        return self.tls_cert is not None

    @model_validator(mode="after")
    def _certificate_with_key(self) -> Self:
        if (self.tls_cert is None) != (self.tls_key is None):
            raise ValueError("CHAINAGE_TLS_CERT and CHAINAGE_TLS_KEY go together")
        return self

    @field_validator("allowed_hosts", "camera_networks", mode="before")
    @classmethod
    def _split(cls, value: object) -> object:
        if isinstance(value, str):
            return tuple(name.strip() for name in value.split(",") if name.strip())
        return value


def _reason(fault: ErrorDetails) -> str:
    if not fault["loc"]:  # it is about several settings
        return fault["msg"].removeprefix("Value error, ")
    name = str(fault["loc"][0])
    found = "" if name == "token" else f" (found {fault['input']!r})"
    return f"{PREFIX}{name.upper()}: {fault['msg']}{found}"
