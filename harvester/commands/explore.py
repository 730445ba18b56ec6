"""The command `harvester explore`."""

import click
import cloup

from harvester.commands.help import command
from harvester.errors import MissingProgramError


@command("harvester explore", "harvester explore mine.toml", "harvester explore mine.toml --port 8080")
@cloup.argument(
    "path", metavar="[SCENE]", required=False, help="A scene file to begin with.  Default: a plate against a stop."
)
@cloup.option_group(
    "Where",
    cloup.option(
        "--port", type=click.IntRange(0, 65535), default=0, help="Port on 127.0.0.1.  Default: any that is free."
    ),
)
def explore(path: str | None, port: int) -> None:
    """A page in the browser: turn knobs and see the power at once."""
    from harvester.explore.draft import Draft, first

    draft = first() if path is None else Draft.read(path)  # says what is wrong before anything is served
    try:
        import panel  # noqa: F401
    except ImportError:
        raise MissingProgramError(
            "explore must have Panel, but it is not installed: python -m pip install 'piezo-harvester[explore]'"
        ) from None
    from harvester.explore.server import Server

    server = Server(draft.copy, port)
    click.echo(f"open {server.url}\nonly this machine sees it, with that address; ^C ends it")
    server.run()
