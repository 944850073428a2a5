"""S3 clients of a store: which failures they sit out, and for how long.

obstore repeats what is safe to repeat after a server error, a lost connection or a timeout; a write
that timed out may have arrived, so it is left to `Store`, whose writes are create-only or replace
like by like and may be made again.
"""

from __future__ import annotations

import os
import random
import time
from collections.abc import Callable, Mapping
from datetime import timedelta
from typing import Any, TypeVar

from obstore import exceptions
from obstore.store import S3Store

T = TypeVar("T")

#: seconds for a small request, and for the next bytes of a large one
_QUICK, _BULK = 10, 120

#: what no repetition cures
_FINAL = (
    exceptions.AlreadyExistsError,
    exceptions.InvalidPathError,
    exceptions.NotFoundError,
    exceptions.NotSupportedError,
    exceptions.PermissionDeniedError,
    exceptions.PreconditionError,
    exceptions.UnauthenticatedError,
    exceptions.UnknownConfigurationKeyError,
)


def s3_clients(
    url: str, patience: float, options: Mapping[str, Any] | None = None
) -> tuple[S3Store, S3Store]:
    """Two clients of s3://bucket/prefix: one for small requests, one for large files and lists.

    Credentials and the endpoint come from the usual AWS_* variables, over which `options` win; an
    endpoint without TLS is used as it is given.
    """
    config = dict(options or {})
    endpoint = str(
        config.get("endpoint")
        or os.environ.get("AWS_ENDPOINT_URL")
        or os.environ.get("AWS_ENDPOINT")
        or ""
    )
    plain = endpoint.startswith("http://")
    retry: Any = {
        "max_retries": 100,
        "retry_timeout": timedelta(seconds=patience),
        "backoff": {
            "init_backoff": timedelta(milliseconds=100),
            "max_backoff": timedelta(seconds=3),
            "base": 2,
        },
    }

    def client(seconds: int) -> S3Store:
        limits: Any = {
            "allow_http": plain,
            "connect_timeout": timedelta(seconds=5),
            "read_timeout": timedelta(seconds=seconds),
            "timeout": timedelta(seconds=60 * seconds if seconds == _BULK else seconds),
        }
        return S3Store.from_url(url, client_options=limits, retry_config=retry, **config)

    return client(_QUICK), client(_BULK)


def repeated(call: Callable[[], T], patience: float) -> T:
    """What a write returns, made again for up to `patience` seconds while the store fails."""
    end, rest = time.monotonic() + patience, 0.1
    while True:
        try:
            return call()
        except exceptions.BaseError as error:
            if isinstance(error, _FINAL) or time.monotonic() + rest > end:
                raise
        time.sleep(rest * random.uniform(0.5, 1.5))
        rest = min(2 * rest, 3.0)
