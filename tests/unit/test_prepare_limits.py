"""What preparing a scene may cost, as workers of a farm are told it."""

import pytest
from farfield_api.settings import ApiSettings
from farfield_core.dispatch.prepare import PrepareLimits
from farfield_core.errors import BadInputError


def test_workers_and_the_api_read_the_same() -> None:
    for environ in (
        {},
        {"FARFIELD_PREPARE_MEMORY_MB": "500", "FARFIELD_PREPARE_SECONDS": "60"},
        {"FARFIELD_PREPARE_MEMORY_MB": "0", "FARFIELD_PREPARE_CPU_SECONDS": "0"},
    ):
        limits = PrepareLimits.from_environment(environ)
        assert limits == ApiSettings.from_environment(environ).prepare_limits
    assert PrepareLimits.from_environment({}).memory_mb > 0


def test_what_is_no_number_is_refused_by_name() -> None:
    with pytest.raises(BadInputError, match="FARFIELD_PREPARE_SECONDS cannot be 'long'"):
        PrepareLimits.from_environment({"FARFIELD_PREPARE_SECONDS": "long"})
