"""A server whose event streams end when it stops, instead of being waited for."""

from __future__ import annotations

import os
import socket

import uvicorn

from farfield_api.app import create_app_from_environment
from farfield_api.observe import log_to_stderr


class Server(uvicorn.Server):
    """uvicorn's, telling the application when it begins to stop.

    The lifespan's end comes too late for that: only after all connections are closed.
    """

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop: streams first, then what is left."""
        app = self.config.loaded_app
        while not hasattr(app, "state") and hasattr(app, "app"):
            app = app.app  # uvicorn's own middleware
        app.state.stopping = True
        await super().shutdown(sockets)


def main() -> None:
    """Serve on FARFIELD_HOST and FARFIELD_PORT: what an image runs."""
    log_to_stderr("json" if os.environ.get("FARFIELD_LOGS") == "json" else "text")
    config = uvicorn.Config(
        create_app_from_environment(),
        host=os.environ.get("FARFIELD_HOST", "127.0.0.1"),
        port=int(os.environ.get("FARFIELD_PORT", "8000")),
        timeout_graceful_shutdown=10,
        # ours says the same, with ids
        access_log=False,
        log_config=None,
    )
    Server(config).run()


if __name__ == "__main__":
    main()
