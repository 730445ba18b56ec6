"""How the help of a command looks: cloup's groups of options, bold headings, and examples at the end."""

from collections.abc import Callable, Sequence
from typing import Any

import click
import cloup

WIDTH = 110
NARROWEST = 20  # columns: help for a narrower terminal is that wide


class Formatter(cloup.HelpFormatter):
    """The lay-out of help, also for a terminal of one column, at which click cannot wrap."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.width = max(self.width, NARROWEST)


cloup.Context.formatter_class = Formatter  # of groups and commands alike
SETTINGS = cloup.Context.settings(
    help_option_names=["-h", "--help"],
    max_content_width=WIDTH,
    align_option_groups=False,
    align_sections=False,
    formatter_settings=cloup.HelpFormatter.settings(
        theme=cloup.HelpTheme(heading=cloup.Style(bold=True))
    ),
)


class Command(cloup.Command):
    """A command whose help ends with examples."""

    def __init__(self, *arguments: Any, examples: Sequence[str] = (), **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.examples = examples

    def get_short_help_str(self, limit: int = WIDTH) -> str:
        """The command's first sentence, never cut: the help of the program wraps it."""
        return super().get_short_help_str(WIDTH)

    def format_help(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the help, with the names of all engines if an option's says {engines}."""
        from harvester.engines.selection import ENGINES

        for option in self.params:
            if isinstance(option, click.Option) and option.help:
                option.help = option.help.replace("{engines}", ", ".join(ENGINES))
        super().format_help(ctx, formatter)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the examples as they are, each on one line."""
        with formatter.section("Examples"):
            for example in self.examples:
                formatter.write(f"  {example}\n")


def command(*examples: str) -> Callable[[Callable[..., Any]], Command]:
    """Make a function a command whose help ends with these examples."""
    return cloup.command(cls=Command, examples=examples)
