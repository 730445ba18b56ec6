"""The output of the commands: answers, warnings and errors, with the library's `name` turned into --name."""

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from harvester.errors import InputError, shown

_ARGUMENT = re.compile(r"`([a-z][a-z_]*)`")
_OTHER_NAMES = {"ledger": "energy_balance"}  # of options, by argument
_FILE = re.compile(r"`?\bFILE\b`?")
MOST_LETTERS, LAST_LETTERS = 1400, 400  # letters of an error, and at its end
_WARNING = re.compile(r"^(\s*)(warning)(?=[:,])", re.MULTILINE)


def coloured() -> bool | None:
    """The value of click's ``color``: False if NO_COLOR is set to something, else None, which asks the terminal."""
    return False if os.environ.get("NO_COLOR") else None


def typed(text: str) -> str:
    """Turn the arguments in a text of the library, `name` in backticks, into options: --name."""
    return _ARGUMENT.sub(lambda m: _option(m[1]), text).replace("`FILE`", "FILE")


def _option(argument: str) -> str:
    """The option of an argument of the library."""
    return "--" + _OTHER_NAMES.get(argument, argument).replace("_", "-")


def echo(text: str, err: bool = False, nl: bool = True) -> None:
    """Print a text of the library, on stderr with ``err``, with its warnings in colour on a terminal."""
    text = _WARNING.sub(lambda m: m[1] + click.style(m[2], fg="yellow", bold=True), typed(text))
    click.echo(text, err=err, nl=nl, color=coloured())


def echo_json(answer: dict[str, Any]) -> None:
    """Print one JSON object."""
    click.echo(typed(json.dumps(answer, allow_nan=False)))


def echo_answer(answer: Any, as_json: bool) -> None:
    """Print an answer of the library as a text, or as one JSON object."""
    if as_json:
        echo_json(answer.as_json())
    else:
        echo(str(answer))


def echo_written(folder: str, *names: str) -> None:
    """Print which files of a folder were written."""
    click.echo(f"written: {Path(folder)}/{', '.join(names)}")


@contextmanager
def naming(file: str) -> Iterator[None]:
    """Name the command's file in errors about FILE, the library's name for it."""
    try:
        yield
    except InputError as error:
        name = shown(Path(file).name)
        text = str(error)
        if Path(file).name in text:
            raise
        raise type(error)(_FILE.sub(lambda _: f"FILE {name}", text, count=1)) from None


def complain(text: str) -> None:
    """Print an error as one printable line on stderr, without its middle if it is long."""
    text = " ".join(typed(text).split())
    if len(text) > MOST_LETTERS:
        text = f"{text[: MOST_LETTERS - LAST_LETTERS]} ... {text[-LAST_LETTERS:]}"
    text = "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)
    click.echo(
        f"{click.style('harvester:', fg='red', bold=True)} {text}", err=True, color=coloured()
    )
