"""Settings from the environment, and what is said of those that cannot be used."""

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
    environment(MAX_JOBS="0", JOB_CPU_H="1001")
    with pytest.raises(InvalidSettings, match=r"CHAINAGE_MAX_JOBS: .*; CHAINAGE_JOB_CPU_H: "):
        Settings.load()
    with pytest.raises(InvalidSettings) as error:
        Settings.load(token=b"\xff-secret", max_jobs=1, job_cpu_h=1)
    assert "CHAINAGE_TOKEN" in str(error.value)
    assert "secret" not in str(error.value)
