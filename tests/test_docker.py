"""Every container is closed as far as it can be, and watched."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

DOCKER = Path(__file__).parent.parent / "docker"


def services(name: str) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = yaml.safe_load((DOCKER / name).read_text())["services"]
    return found


SERVICES = [
    pytest.param(service, id=f"{name}-{key}")
    for name in ("compose.yaml", "compose.cluster.yaml")
    for key, service in services(name).items()
]


@pytest.mark.parametrize("service", SERVICES)
def test_a_container_cannot_do_more_than_it_must(service: dict[str, Any]) -> None:
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert service["mem_limit"]
    assert service["pids_limit"]
    # Nobody is root; our image names its user itself.
    assert service.get("user", "" if service["image"] == "chainage" else "0") != "0"
    # Our image has a health check for the server; everything else that stays states its own.
    is_server = service["image"] == "chainage" and "entrypoint" not in service
    is_short = service["restart"] == "no"
    assert is_server or is_short or service["healthcheck"]["test"]


def test_our_image_has_a_user_and_a_health_check() -> None:
    lines = (DOCKER / "Dockerfile").read_text().splitlines()
    assert "USER 10001:10001" in lines
    assert any(line.startswith("HEALTHCHECK ") for line in lines)


def test_only_the_proxy_is_open_to_other_machines() -> None:
    for key, service in services("compose.cluster.yaml").items():
        if key != "proxy":
            assert all(port.startswith("127.0.0.1:") for port in service.get("ports", ()))


def made_by(script: Path) -> dict[str, bytes]:
    """The certificates and passwords, by name."""
    subprocess.run(["bash", str(script)], check=True, capture_output=True)
    return {path.name: path.read_bytes() for path in (script.parent / "secrets").iterdir()}


def test_the_cluster_trusts_only_its_own_certificates(tmp_path: Path) -> None:
    script = tmp_path / "certificates.sh"
    script.write_bytes((DOCKER / "certificates.sh").read_bytes())
    made = made_by(script)
    assert made_by(script) == made  # the second time everything is kept
    secrets = yaml.safe_load((DOCKER / "compose.cluster.yaml").read_text())["secrets"]
    assert {Path(secret["file"]).name for secret in secrets.values()} <= made.keys()
    for name in ("node.crt", "proxy.crt"):
        command = ["openssl", "verify", "-CAfile", "ca.crt", name]
        subprocess.run(command, cwd=tmp_path / "secrets", check=True, capture_output=True)
