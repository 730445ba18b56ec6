"""Who may talk to the page's server: requests are judged by their first lines, before a byte of their body is read.

A path begins with the token of the address, the host is this machine's at the server's port, and
the origin, which browsers send with a websocket and from another page, is that as well.  Anything
else is 403 at once, and its connection is closed.  The server logs one line each, without
the token.
"""

import logging
import os
from collections.abc import Callable
from typing import Any

from tornado.httputil import HTTPHeaders, HTTPMessageDelegate, HTTPServerRequest, ResponseStartLine
from tornado.routing import Router

FULL = b"503: too many pages are open; close some, or wait a minute\n"
REFUSAL = b"403: the address must have the token that `harvester explore` printed\n"
# No request of the page has a body: files come through its websocket.
LIMITS = {
    "max_body_size": 64_000,
    "max_header_size": 16_000,
    "body_timeout": 10.0,
    "idle_connection_timeout": 300.0,
}


def headers_for(hosts: tuple[str, ...]) -> dict[str, str]:
    """The headers of each answer: no other page may frame or read it, and it loads its own alone.

    Bokeh's page has scripts and styles in its text, compiles its templates, and loads modules from
    blobs.
    """
    sockets = " ".join(f"ws://{host}" for host in hosts)
    policy = {
        "default-src": "'self'",
        "script-src": "'self' 'unsafe-inline' 'unsafe-eval' blob:",
        "style-src": "'self' 'unsafe-inline'",
        "img-src": "'self' data: blob:",
        "font-src": "'self' data:",
        "connect-src": f"'self' {sockets}",
        "object-src": "'none'",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    return {
        "Content-Security-Policy": "; ".join(f"{what} {where}" for what, where in policy.items()),
        "X-Content-Type-Options": "nosniff",
        "X-Frame-Options": "DENY",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Resource-Policy": "same-origin",
    }


class Guard(Router):
    """Hands the requests that may talk to the server on to its application, and refuses all others.

    ``full()`` is whether there are as many pages as there may be: another one is then refused.
    """

    def __init__(
        self,
        application: Router,
        token: str,
        hosts: tuple[str, ...],
        full: Callable[[], bool] = lambda: False,
    ) -> None:
        self._application = application
        self._token = token
        self._hosts = hosts
        self._full = full
        self._headers = headers_for(hosts)

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> HTTPMessageDelegate | None:
        """The application's handler of a request, or the refusal."""
        self._add_headers(request)
        origin = request.headers.get("Origin")
        parts = (request.path or "").split("/")
        inside = parts[1:2] == [self._token] and ".." not in parts
        if (
            not inside
            or request.host not in self._hosts
            or origin not in (None, *(f"http://{h}" for h in self._hosts))
        ):
            return _Refusal(request, ResponseStartLine("HTTP/1.1", 403, "Forbidden"), REFUSAL)
        if not any(parts[2:]) and self._full():
            start = ResponseStartLine("HTTP/1.1", 503, "Service Unavailable")
            return _Refusal(request, start, FULL)
        return self._application.find_handler(request, **kwargs)

    def _add_headers(self, request: HTTPServerRequest) -> None:
        """Let the answer to a request have our headers, and none that lets other pages read it."""
        connection: Any = request.connection
        write = connection.write_headers

        def write_headers(start_line: Any, headers: HTTPHeaders, *rest: Any, **named: Any) -> Any:
            """Write them with ours."""
            for name in [name for name in headers if name.startswith("Access-Control-")]:
                del headers[name]
            headers.update(self._headers)
            return write(start_line, headers, *rest, **named)

        connection.write_headers = write_headers


class _Refusal(HTTPMessageDelegate):
    """An answer such as 403, and no more of the connection."""

    def __init__(self, request: HTTPServerRequest, start: ResponseStartLine, text: bytes) -> None:
        self._connection = request.connection
        self._start = start
        self._text = text

    def headers_received(self, start_line: Any, headers: HTTPHeaders) -> None:
        """Answer before the body."""
        assert self._connection is not None
        about = HTTPHeaders(
            {
                "Content-Length": str(len(self._text)),
                "Content-Type": "text/plain",
                "Connection": "close",
            }
        )
        self._connection.write_headers(self._start, about, self._text)
        self._connection.finish()

    def data_received(self, chunk: bytes) -> None:
        """Forget data that arrive all the same."""


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
