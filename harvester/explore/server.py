"""The page's server: on 127.0.0.1 only, and nothing without the token of its address.

The token is the first part of every path, so that the page, what it fetches and its websocket all carry it; any other
request is refused before its body is read (`harvester.explore.guard`).
"""

import asyncio
import os
import secrets
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import panel as pn
from tornado.websocket import WebSocketClosedError

from harvester.errors import HarvesterError, InputError
from harvester.explore import in_worker, links
from harvester.explore.draft import Draft
from harvester.explore.guard import LIMITS, Guard, quieten
from harvester.explore.page import Explorer

HOST = "127.0.0.1"
MOST_BYTES = 80_000_000  # of a message: a file of `uploads.MOST_BYTES`, as text


class Frame(pn.Template):  # type: ignore[misc]
    """The page around its parts."""

    def __repr__(self) -> str:  # Panel's own, of all parts, is made for each of them, and takes seconds
        return "harvester explore"


class Server:
    """A server that is ready to be started; ``url`` is the address with the token."""

    def __init__(self, first: Callable[[], Draft], port: int) -> None:
        os.environ.setdefault("BOKEH_RESOURCES", "server")
        pn.extension(notifications=False)
        port = free_port(port)
        token = secrets.token_urlsafe(24)
        template = (Path(__file__).parent / "page.html").read_text()

        def page() -> Any:
            held = [one.decode(errors="replace") for one in pn.state.session_args.get("scene", [])]
            error = ""
            try:
                draft = links.opened(held[0]) if held else first()
            except HarvesterError as wrong:
                draft, error = first(), str(wrong)
            explorer = Explorer(draft, error)
            pn.state.on_session_destroyed(lambda _: explorer.close())
            made = Frame(template, items=explorer.roots())
            made.add_variable("app_favicon", "")  # page.html has one, or browsers would ask elsewhere
            made.add_variable("apple_icon", "")
            return made

        self._server = pn.io.server.get_server(
            {"/": page},
            port=port,
            address=HOST,
            prefix=token,
            websocket_origin=[f"{HOST}:{port}", f"localhost:{port}"],
            websocket_max_message_size=MOST_BYTES,
            title="harvester explore",
            http_server_kwargs=LIMITS,
            show=False,
            start=False,
            verbose=False,
        )
        guarded = Guard(self._server._tornado, token, (f"{HOST}:{port}", f"localhost:{port}"))
        self._server._http.request_callback = guarded
        quieten(token)
        self.url = f"http://{HOST}:{port}/{token}/"

    def run(self) -> None:
        """Serve until the program is interrupted."""
        try:
            self._server.start()
            self._server.io_loop.asyncio_loop.set_exception_handler(report_failure)
            self._server.io_loop.start()
        finally:
            for session in self._server.get_sessions():
                session.destroy()
            self._server.stop()
            in_worker.close()


def report_failure(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Report what failed while nobody waited for it, but not that a page was closed while it was being drawn."""
    if not isinstance(context.get("exception"), WebSocketClosedError):
        loop.default_exception_handler(context)


def free_port(port: int) -> int:
    """The port itself, or any free one for 0; InputError where another program has it."""
    with socket.socket() as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            one.bind((HOST, port))
        except OSError as error:
            raise InputError(
                f"`port` must be free, but {port} is not: {error.strerror}; leave it out for any that is"
            ) from None
        return int(one.getsockname()[1])
