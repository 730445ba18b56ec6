"""The page's server: on one address, 127.0.0.1 unless another is asked for, and nothing without its token.

The token is the first part of every path, so that the page, its resources and its websocket all
carry it; any other request is refused before its body is read (`harvester.explore.guard`).
"""

import asyncio
import errno
import ipaddress
import os
import secrets
import socket
import sys
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

HOST = "127.0.0.1"  # only this machine reaches it
# seconds that a thread which computes may keep the one that draws waiting; Python's own is 0.005
SWITCH = 0.001
MOST_PAGES = 50  # at a time; one that nobody looks at ends after half a minute
MOST_BYTES = 80_000_000  # of a message: a file of `uploads.MOST_BYTES`, as text


class Frame(pn.Template):  # type: ignore[misc]
    """The page around its parts."""

    # Panel's own, of all parts, is made for each of them, and takes seconds
    def __repr__(self) -> str:
        return "harvester explore"


class Server:
    """A server that is ready to be started on one address of this machine.

    ``url`` is its page with the token.

    Raises InputError for a ``host`` that is not an address of this machine, and for a ``port`` that
    is in use.
    """

    def __init__(self, first: Callable[[], Draft], port: int, host: str = HOST) -> None:
        os.environ.setdefault("BOKEH_RESOURCES", "server")
        pn.extension(notifications=False)
        self._pages: set[Explorer] = set()
        port = free_port(port, host)
        hosts = hosts_of(host, port)
        token = secrets.token_urlsafe(24)
        template = (Path(__file__).parent / "page.html").read_text()

        def page() -> Any:
            held = [
                value.decode(errors="replace") for value in pn.state.session_args.get("scene", [])
            ]
            error = ""
            try:
                draft = links.opened(held[0]) if held else first()
            except HarvesterError as wrong:
                draft = first()
                error = str(wrong)
            explorer = Explorer(draft, error)
            self._pages.add(explorer)
            pn.state.on_session_destroyed(lambda _: self._close(explorer))
            made = Frame(template, items=explorer.roots())
            # page.html has one, or browsers would ask elsewhere
            made.add_variable("app_favicon", "")
            made.add_variable("apple_icon", "")
            return made

        self._server = pn.io.server.get_server(
            {"/": page},
            port=port,
            address=host,
            prefix=token,
            websocket_origin=[*hosts],
            websocket_max_message_size=MOST_BYTES,
            title="harvester explore",
            http_server_kwargs=LIMITS,
            show=False,
            start=False,
            verbose=False,
        )
        self._server._http.request_callback = Guard(
            self._server._tornado, token, hosts, lambda: len(self._pages) >= MOST_PAGES
        )
        quieten(token)
        self.url = f"http://{hosts[0]}/{token}/"

    def run(self) -> None:
        """Serve until the program is interrupted."""
        sys.setswitchinterval(SWITCH)
        try:
            self._server.start()
            self._server.io_loop.asyncio_loop.set_exception_handler(report_failure)
            self._server.io_loop.start()
        finally:
            for explorer in [
                *self._pages
            ]:  # Bokeh calls nothing of a session's when its server ends
                self._close(explorer)
            self._server.stop()
            in_worker.close()

    def _close(self, explorer: Explorer) -> None:
        """End a page and its work."""
        self._pages.discard(explorer)
        explorer.close()


def report_failure(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Report an error for which nobody waited, but not that a page was closed while it was being drawn."""
    if not isinstance(context.get("exception"), WebSocketClosedError):
        loop.default_exception_handler(context)


def hosts_of(host: str, port: int) -> tuple[str, ...]:
    """The host names that a request may have: the address itself, and localhost if that is this machine's own."""
    bracketed = f"[{host}]" if ":" in host else host
    return (f"{bracketed}:{port}", *([f"localhost:{port}"] if host == HOST else []))


def free_port(port: int, host: str = HOST) -> int:
    """The port itself, or any free one for 0.

    Raises InputError if another program has it, and for a ``host`` that is not one address of this
    machine.
    """
    must = "`host` must be an IP address of this machine, such as 192.168.1.20"
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        raise InputError(f"{must}, but was '{host}'") from None
    if address.is_unspecified:
        raise InputError(f"{must}, but was '{host}', which is all of them: the page answers to one")
    with socket.socket(socket.AF_INET6 if address.version == 6 else socket.AF_INET) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((host, port))
        except OSError as error:
            if error.errno == errno.EADDRNOTAVAIL:
                raise InputError(f"{must}, but was '{host}', which is not one") from None
            raise InputError(
                f"`port` must be free, but {port} is not: {error.strerror}; leave it out for any that is"
            ) from None
        return int(listener.getsockname()[1])
