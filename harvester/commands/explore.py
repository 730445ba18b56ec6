"""The command `harvester explore`."""

import io

import click
import cloup

from harvester.commands.help import command
from harvester.errors import MissingProgramError


@command(
    "harvester explore",
    "harvester explore mine.toml",
    "harvester explore mine.toml --host 192.168.1.20",
)
@cloup.argument(
    "path",
    metavar="[SCENE]",
    required=False,
    help="A scene file to start from.  Default: a plate against a stop.",
)
@cloup.option_group(
    "Where",
    cloup.option(
        "--port",
        type=click.IntRange(0, 65535),
        default=0,
        help="Port of the app.  Default: any free port.",
    ),
    cloup.option(
        "--host",
        metavar="ADDRESS",
        help="Listen on this network address, e.g. for a phone; also prints a QR code. Whoever has that address "
        "can use the app, and it is not encrypted.  Default: 127.0.0.1, this machine alone.",
    ),
)
def explore(path: str | None, port: int, host: str | None) -> None:
    """Open an app in the browser: move sliders and see the power at once."""
    from harvester.explore.draft import Draft, first

    # says what is wrong before anything is served
    draft = first() if path is None else Draft.read(path)
    try:
        import panel  # noqa: F401
        import segno  # noqa: F401
    except ImportError:
        raise MissingProgramError(
            "explore must have Panel, but it is not installed: python -m pip install 'piezo-harvester[explore]'"
        ) from None
    from harvester.explore.server import HOST, Server

    server = Server(draft.copy, port, host or HOST)
    if host is None:
        click.echo(f"open {server.url}\nonly this machine sees it, with that address; ^C ends it")
    else:
        click.echo(
            f"open {server.url}\nwhoever has that address sees it, and it is not encrypted; ^C ends it"
        )
        click.echo(_qr_code(server.url))
    server.run()


def _qr_code(text: str) -> str:
    """A text as a QR code of half blocks, for a terminal with light letters on dark."""
    import segno

    drawn = io.StringIO()
    segno.make(text, error="l", micro=False).terminal(drawn, border=2, compact=True)
    return drawn.getvalue()
