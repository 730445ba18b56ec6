"""Who may talk to the page's server: requests are judged by their first lines, before a byte of their body is read.

A path begins with the token of the address, the host is this machine's at the server's port, and
the origin, which browsers send with a websocket and from another page, is that as well.  Anything
else is 403 at once, and its connection is closed.  What the server logs is one line each, without
the token.
"""

import logging
import os
from typing import Any

from tornado.httputil import HTTPHeaders, HTTPMessageDelegate, HTTPServerRequest, ResponseStartLine
from tornado.routing import Router

REFUSAL = b"403: the address must have the token that `harvester explore` printed\n"
# No request of the page has a body: files come through its websocket.
LIMITS = {
    "max_body_size": 64_000,
    "max_header_size": 16_000,
    "body_timeout": 10.0,
    "idle_connection_timeout": 300.0,
}


class Guard(Router):
    """Hands the requests that may talk to the server on to its application, and refuses all others."""

    def __init__(self, application: Router, token: str, hosts: tuple[str, ...]) -> None:
        self._application = application
        self._token = token
        self._hosts = hosts

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> HTTPMessageDelegate | None:
        """The application's handler of a request, or the refusal."""
        origin = request.headers.get("Origin")
        parts = (request.path or "").split("/")
        inside = parts[1:2] == [self._token] and ".." not in parts
        if (
            not inside
            or request.host not in self._hosts
            or origin not in (None, *(f"http://{h}" for h in self._hosts))
        ):
            return _Refusal(request)
        return self._application.find_handler(request, **kwargs)


class _Refusal(HTTPMessageDelegate):
    """The answer 403, and no more of the connection."""

    def __init__(self, request: HTTPServerRequest) -> None:
        self._connection = request.connection

    def headers_received(self, start_line: Any, headers: HTTPHeaders) -> None:
        """Answer before the body."""
        assert self._connection is not None
        about = HTTPHeaders(
            {
                "Content-Length": str(len(REFUSAL)),
                "Content-Type": "text/plain",
                "Connection": "close",
            }
        )
        self._connection.write_headers(
            ResponseStartLine("HTTP/1.1", 403, "Forbidden"), about, REFUSAL
        )
        self._connection.finish()

    def data_received(self, chunk: bytes) -> None:
        """Forget what comes all the same."""


class OneLine(logging.Formatter):
    """A log entry as one line without the token; with a traceback if HARVESTER_TRACEBACK is set."""

    def __init__(self, token: str) -> None:
        super().__init__()
        self._token = token

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        text = " ".join(record.getMessage().split())[:500]
        if record.exc_info and os.environ.get("HARVESTER_TRACEBACK"):
            text += "\n" + self.formatException(record.exc_info)
        return f"harvester explore: {text}".replace(self._token, "TOKEN")


def quieten(token: str) -> None:
    """Let everything that is logged pass through `OneLine`."""
    handler = logging.StreamHandler()
    handler.setFormatter(OneLine(token))
    handler.setLevel(logging.WARNING)
    for name in list(logging.root.manager.loggerDict):
        logging.getLogger(name).handlers.clear()
        logging.getLogger(name).propagate = True
    logging.root.handlers[:] = [handler]
