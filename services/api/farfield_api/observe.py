"""What a server tells of itself: log lines and numbers for each request, and traces if wanted.

Every request has an id, its own or the client's (X-Request-Id), which stands in its log lines and
in the answer. Numbers are labelled by route, never by address, so there are few of them.
"""

from __future__ import annotations

import json
import logging
import re
import secrets
import time
from collections.abc import Callable
from contextvars import ContextVar
from typing import Any

from farfield_core.dispatch import Event
from opentelemetry import trace
from opentelemetry.sdk.resources import Resource
from opentelemetry.sdk.trace import SpanProcessor, TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor
from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

log = logging.getLogger("farfield.request")
cell_log = logging.getLogger("farfield.cell")

request_id: ContextVar[str] = ContextVar("request_id", default="")

_ID = re.compile(r"^[A-Za-z0-9._-]{1,64}$")
_NAMED = ("scene", "bake", "cell", "upload")


class JsonLines(logging.Formatter):
    """One JSON object a line."""

    def format(self, record: logging.LogRecord) -> str:
        """The line of a record."""
        line: dict[str, Any] = {
            "time": time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(record.created))
            + f".{int(record.msecs):03d}Z",
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if identity := request_id.get():
            line["request"] = identity
        line |= getattr(record, "fields", {})
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, default=str)


class Metrics:
    """The numbers of one server."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        made: dict[str, Any] = {"registry": self.registry}
        self.requests = Counter(
            "farfield_requests", "Requests answered.", ["method", "route", "status"], **made
        )
        self.seconds = Histogram(
            "farfield_request_seconds",
            "Seconds until a request was answered.",
            ["route"],
            buckets=(0.005, 0.02, 0.05, 0.1, 0.25, 1, 5, 30),
            **made,
        )
        self.received = Counter("farfield_received_bytes", "Bytes of request bodies.", **made)
        self.sent = Counter("farfield_sent_bytes", "Bytes of answers.", **made)
        self.cells = Counter("farfield_cells", "Cells that ended.", ["outcome"], **made)
        self.cell_seconds = Counter(
            "farfield_cell_seconds", "Seconds spent baking cells that are done.", **made
        )
        self.streams = Gauge("farfield_open_requests", "Requests under way.", **made)


class Tracing:
    """Spans of requests and of cells, sent nowhere unless there is an address."""

    def __init__(self, address: str, processor: SpanProcessor | None = None) -> None:
        self._provider: TracerProvider | None = None
        self._bakes: dict[str, trace.SpanContext] = {}
        if address:
            from opentelemetry.exporter.otlp.proto.http.trace_exporter import (  # noqa: PLC0415
                OTLPSpanExporter,
            )

            processor = BatchSpanProcessor(OTLPSpanExporter(endpoint=address))
        if processor is not None:
            self._provider = TracerProvider(resource=Resource.create({"service.name": "farfield"}))
            self._provider.add_span_processor(processor)

    @property
    def tracer(self) -> trace.Tracer | None:
        """Makes spans; None where nobody wants them."""
        return self._provider.get_tracer("farfield") if self._provider else None

    def asked(self, bake: str) -> None:
        """The request under way asked for a bake: its cells belong to this trace."""
        context = trace.get_current_span().get_span_context()
        if self._provider and context.is_valid:
            self._bakes[bake] = context

    def cell(self, event: Event) -> None:
        """A cell ended."""
        parent = self._bakes.get(event.bake)
        tracer = self.tracer
        if tracer is None or parent is None:
            return
        end = time.time_ns()
        start = end - int(event.figures.get("seconds", 0.0) * 1e9)
        context = trace.set_span_in_context(trace.NonRecordingSpan(parent))
        span = tracer.start_span(f"cell {event.cell}", context, start_time=start)
        span.set_attribute("farfield.bake", event.bake)
        span.set_attribute("farfield.cell", event.cell or "")
        for name, value in event.figures.items():
            span.set_attribute(f"farfield.{name}", value)
        if event.kind == "failed":
            span.set_status(trace.StatusCode.ERROR, event.reason or "")
        span.end(end)

    def close(self) -> None:
        """Send what is left."""
        if self._provider:
            self._provider.shutdown()


def cell_listener(metrics: Metrics, tracing: Tracing) -> Callable[[Event], None]:
    """What listens to a dispatcher: counts, logs and traces cells."""

    def listen(event: Event) -> None:
        if event.kind not in ("done", "failed", "retried"):
            return
        metrics.cells.labels(event.kind).inc()
        metrics.cell_seconds.inc(max(0.0, event.figures.get("seconds", 0.0)))
        fields = {"bake": event.bake, "cell": event.cell, **event.figures}
        if event.reason:
            fields["reason"] = event.reason
        level = logging.INFO if event.kind == "done" else logging.WARNING
        cell_log.log(level, "cell %s", event.kind, extra={"fields": fields})
        if event.kind != "retried":
            tracing.cell(event)

    return listen


class Observe:
    """ASGI middleware, outermost."""

    def __init__(self, app: ASGIApp, metrics: Metrics, tracing: Tracing) -> None:
        self._app = app
        self._metrics = metrics
        self._tracing = tracing

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get("x-request-id", "")
        identity = given if _ID.match(given) else secrets.token_hex(8)
        token = request_id.set(identity)
        metrics, begun, status = self._metrics, time.perf_counter(), 500

        async def counted() -> Message:
            message = await receive()
            if body := message.get("body"):
                metrics.received.inc(len(body))
            return message

        async def marked(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)["X-Request-Id"] = identity
            elif body := message.get("body"):
                metrics.sent.inc(len(body))
            await send(message)

        metrics.streams.inc()
        tracer = self._tracing.tracer
        try:
            if tracer is None:
                await self._app(scope, counted, marked)
            else:
                with tracer.start_as_current_span(f"{scope['method']} {scope['path']}") as span:
                    span.set_attribute("farfield.request", identity)
                    await self._app(scope, counted, marked)
                    span.set_attribute("http.response.status_code", status)
                    span.update_name(f"{scope['method']} {_route(scope)}")
        finally:
            metrics.streams.dec()
            seconds = time.perf_counter() - begun
            route = _route(scope)
            metrics.requests.labels(scope["method"], route, str(status)).inc()
            metrics.seconds.labels(route).observe(seconds)
            named = scope.get("path_params", {})
            fields = {
                "method": scope["method"],
                "path": scope["path"],
                "status": status,
                "seconds": round(seconds, 4),
                **{name: named[name] for name in _NAMED if name in named},
            }
            log.info("%s %s %d", scope["method"], scope["path"], status, extra={"fields": fields})
            request_id.reset(token)


def _route(scope: Scope) -> str:
    """The route that answered, below the API's prefix; "other" where none did."""
    return str(getattr(scope.get("route"), "path", "") or "other")


def log_to_stderr(style: str) -> None:
    """Have the server's own log written, as text or as JSON lines."""
    handler = logging.StreamHandler()
    if style == "json":
        handler.setFormatter(JsonLines())
    else:
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s %(message)s"))
    for name in ("farfield", "farfield_api", "farfield_core", "uvicorn.error"):
        logger = logging.getLogger(name)
        logger.handlers = [handler]
        logger.setLevel(logging.INFO)
        logger.propagate = False
