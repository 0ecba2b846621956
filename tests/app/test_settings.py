"""Settings from the environment, and what is said of those that cannot be used."""

import cv2
import numpy as np
import pytest

from app.errors import InvalidSettings
from app.settings import Settings


@pytest.fixture
def environment(monkeypatch):
    def put(**variables):
        for name, value in variables.items():
            monkeypatch.setenv(f"CHAINAGE_{name}", value)

    return put


def test_what_is_given_goes_before_the_environment(environment, tmp_path):
    environment(DATA="elsewhere", MAX_JOBS="2", ALLOWED_HOSTS="culverts.example, other.example")
    settings = Settings.load(data=tmp_path)
    assert (settings.data, settings.max_jobs) == (tmp_path, 2)
    assert settings.allowed_hosts == ("culverts.example", "other.example")


@pytest.mark.parametrize("name", Settings.model_fields)
def test_an_empty_variable_counts_as_not_set(environment, name):
    environment(**{name.upper(): ""})
    assert getattr(Settings.load(), name) == Settings.model_fields[name].default


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("MAX_JOBS", "99", "Input should be less than or equal to 16 (found '99')"),
        ("MAX_JOBS", "two", "Input should be a valid integer, unable to parse"),
        ("STALL_S", "-1", "Input should be greater than 0 (found '-1')"),
        ("PACE", "nan", "(found 'nan')"),
    ],
)
def test_a_wrong_value_is_named_with_what_is_allowed(environment, name, value, said):
    environment(**{name: value})
    with pytest.raises(InvalidSettings) as error:
        Settings.load()
    assert str(error.value).startswith(f"CHAINAGE_{name}: ")
    assert said in str(error.value)


def test_all_wrong_values_are_named_at_once_and_never_the_token(environment):
    environment(MAX_JOBS="-1", JOB_CPU_H="1001")
    with pytest.raises(InvalidSettings, match=r"CHAINAGE_MAX_JOBS: .*; CHAINAGE_JOB_CPU_H: "):
        Settings.load()
    with pytest.raises(InvalidSettings) as error:
        Settings.load(token=b"\xff-secret", max_jobs=1, job_cpu_h=1)
    assert "CHAINAGE_TOKEN" in str(error.value)
    assert "secret" not in str(error.value)


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"WEBHOOK_URL": "https://client.example/hook"}, "CHAINAGE_WEBHOOK_SECRET go together"),
        ({"WEBHOOK_SECRET": "a-secret-of-sixteen"}, "CHAINAGE_WEBHOOK_SECRET go together"),
        ({"WEBHOOK_SECRET": "a-secret"}, "CHAINAGE_WEBHOOK_SECRET: "),
        ({"WEBHOOK_URL": "ftp://client.example/a-secret"}, "CHAINAGE_WEBHOOK_URL: "),
        ({"WEBHOOK_URL": "file:///etc/a-secret"}, "CHAINAGE_WEBHOOK_URL: "),
        ({"WEBHOOK_URL": "https://user:a-secret@client.example/"}, "CHAINAGE_WEBHOOK_URL: "),
        ({"WEBHOOK_URL": "https://client.example/a-secret b"}, "CHAINAGE_WEBHOOK_URL: "),
        ({"WEBHOOK_URL": "https://client.example/\r\na-secret"}, "CHAINAGE_WEBHOOK_URL: "),
        ({"METER_COUNTER": "host"}, "a port, or a host and a port such as 127.0.0.1:8095"),
        ({"METER_COUNTER": "host:0"}, "a port, or a host and a port"),
        ({"METER_COUNTER": "host:65536"}, "a port, or a host and a port"),
        ({"METER_COUNTER": "::1:8095"}, "a port, or a host and a port"),
    ],
)
def test_who_is_notified_is_an_address_and_no_secret_is_repeated(environment, variables, said):
    environment(**variables)
    with pytest.raises(InvalidSettings) as error:
        Settings.load()
    assert said in str(error.value)
    assert "a-secret" not in str(error.value)


@pytest.mark.parametrize("address", ["8095", "127.0.0.1:8095", "office-pc:1", "[::1]:65535"])
def test_a_meter_counter_is_named_by_its_port_or_host_and_port(environment, address):
    environment(METER_COUNTER=address)
    assert Settings.load().meter_counter == address


def test_settings_do_not_show_what_is_secret(environment):
    environment(WEBHOOK_URL="https://client.example/hidden", WEBHOOK_SECRET="hidden" * 3)
    assert "hidden" not in repr(Settings.load())


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "The logo cannot be read: No such file or directory"),
        (b"<svg></svg>", "The logo is no PNG or JPEG"),
        (b"\x89PNG\r\n\x1a\nbroken", "The logo is no PNG or JPEG, or it is damaged"),
        (b"\x89PNG\r\n\x1a\n" + bytes(2**21), "The logo is larger than 2 MiB; save it smaller"),
    ],
)
def test_a_logo_that_cannot_be_printed_is_refused_at_the_start(
    environment, tmp_path, content, said
):
    path = tmp_path / "logo.png"
    if content is not None:
        path.write_bytes(content)
    environment(COMPANY_LOGO=str(path))
    with pytest.raises(InvalidSettings, match=f"^CHAINAGE_COMPANY_LOGO: {said}"):
        Settings.load()


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_a_logo_is_a_png_or_a_jpeg(environment, tmp_path, suffix):
    path = tmp_path / f"logo{suffix}"
    assert cv2.imwrite(str(path), np.zeros((40, 120, 3), np.uint8))
    environment(COMPANY_LOGO=str(path))
    assert Settings.load().company_logo == path


@pytest.mark.parametrize(
    "address",
    [
        "https://tiles.example/{z}/{x}.png",
        "https://tiles.example/{z}/{x}/{y}/{s}.png",
        "https://{z}.example/{x}/{y}.png",
        "https://tiles.example/{z}/{x}/{y}{.png",
        "https://user:secret@tiles.example/{z}/{x}/{y}.png",
        "https://tiles.example; script-src *//{z}/{x}/{y}.png",
        "file:///tiles/{z}/{x}/{y}.png",
    ],
)
def test_tiles_of_the_map_have_an_address_with_three_placeholders(environment, address):
    environment(MAP_TILES=address)
    with pytest.raises(InvalidSettings, match=r"^CHAINAGE_MAP_TILES: It is an address") as error:
        Settings.load()
    assert "secret" not in str(error.value)
