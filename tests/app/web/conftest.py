"""What the tests of the web layer share."""

import pytest
from builders import Client
from surveys import Survey, another


@pytest.fixture
def own(shared: Client, survey: Survey) -> str:
    """Id of a tracked inspection on the shared server, to which a test may do anything."""
    return another(survey, shared)
