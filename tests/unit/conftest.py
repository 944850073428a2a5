"""Fixtures that several unit tests share."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import pytest
from farfield_worker.gl import context as gl


@pytest.fixture
def graphics() -> Iterator[moderngl.Context]:
    """The process's GL context; a GL error before or after the test fails it."""
    with gl.current() as context:
        assert context.error == "GL_NO_ERROR"
        yield context
    with gl.current() as context:
        assert context.error == "GL_NO_ERROR"
