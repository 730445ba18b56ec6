"""Help that teaches: options in groups, commands in the order one needs them, examples; colours on a terminal only.

click does the rest: groups and examples are all that it lacks.
"""

import os
import re
from collections.abc import Callable, Sequence
from typing import Any

import click

WIDTH = 110
_ARGUMENT = re.compile(r"`([a-z][a-z_]*)`")
_WARNING = re.compile(r"^(\s*)(warning)(?=[:,])", re.MULTILINE)


class Option(click.Option):
    """An option that belongs to a group of its command's help."""

    def __init__(self, *arguments: Any, group: str = "Options", **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.group = group


def option(*names: str, group: str = "Options", **options: Any) -> Callable[[Any], Any]:
    """`click.option` with a group."""
    return click.option(*names, cls=Option, group=group, **options)


class Command(click.Command):
    """A command whose help has its options in groups, and examples at its end."""

    def __init__(self, *arguments: Any, examples: Sequence[str] = (), **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.examples = examples

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The groups, in the order of their first options, click's own last."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for param in sorted(self.get_params(ctx), key=lambda one: one.name == "help"):
            record = param.get_help_record(ctx)
            if record is not None:
                kind = "Arguments" if isinstance(param, click.Argument) else "Other"
                groups.setdefault(getattr(param, "group", kind), []).append(record)
        for name, records in groups.items():
            with formatter.section(_bold(name)):
                formatter.write_dl(records)
        if self.examples:
            with formatter.section(_bold("Examples")):
                for example in self.examples:
                    formatter.write(f"  {example}\n")


def command(*examples: str) -> Callable[[Callable[..., Any]], Command]:
    """`click.command`, whose help ends with examples."""
    return click.command(cls=Command, examples=examples)


class Group(click.Group):
    """The program: its help is a text around the commands, which stand in ``sections`` in the order of use."""

    command_class = Command

    def __init__(self, *arguments: Any, sections: dict[str, Sequence[str]] | None = None, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.sections = sections or {}

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Section by section; a command that is in none stands in the last."""
        named = [name for names in self.sections.values() for name in names]
        for title, names in self.sections.items():
            last = title == list(self.sections)[-1]
            here = [*names, *(name for name in self.list_commands(ctx) if last and name not in named)]
            with formatter.section(_bold(title)):
                formatter.write_dl([(name, self.commands[name].get_short_help_str(WIDTH)) for name in here])


def _bold(text: str) -> str:
    return click.style(text, bold=True)


def coloured() -> bool | None:
    """Click's ``color``: False where NO_COLOR is set to something, else None, which is by the terminal."""
    return False if os.environ.get("NO_COLOR") else None


def typed(text: str) -> str:
    """The library's text with its arguments, `name` in backticks, as options: --name."""
    return _ARGUMENT.sub(lambda m: "--" + m[1].replace("_", "-"), text).replace("`FILE`", "FILE")


def echo(text: str) -> None:
    """Print an answer; its warnings are seen on a terminal."""
    text = typed(text)
    click.echo(_WARNING.sub(lambda m: m[1] + click.style(m[2], fg="yellow", bold=True), text), color=coloured())


def complain(text: str) -> None:
    """One line on stderr."""
    text = typed(text)
    click.echo(f"{click.style('harvester:', fg='red', bold=True)} {' '.join(text.split())}", err=True, color=coloured())
