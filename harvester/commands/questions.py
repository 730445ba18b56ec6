"""Questions for what the flags left out, on a terminal; on stderr, so that stdout is the answer's alone."""

from collections.abc import Callable

import click

from harvester.commands.messages import typed
from harvester.devices.device import missing, read
from harvester.devices.flags import FLAGS, SHAKING, STOP
from harvester.errors import InputError

EMPTY = "empty: unknown"


def ask(given: dict[str, str], others: dict[str, str | None]) -> None:
    """Fill ``given`` by flag, and title and netlist in ``others``; an answer that cannot be is asked for again."""
    click.echo("A scene of your device.  Values carry their unit; ^C leaves without a file.", err=True)
    while needed := missing(given):
        choice = needed[0]
        for name in choice[:-1]:
            if _value(given, name, EMPTY):
                break
        else:
            _value(given, choice[-1], None)
    if not _any(given, STOP) and _value(given, "restitution", "empty: no stop"):
        _value(given, "gap", "empty: 0")
    quiet = not _any(given, SHAKING) and not _value(given, "acceleration_psd", "empty: no noise")
    if quiet and _value(given, "acceleration_amplitude", "empty: none"):
        _value(given, "drive_frequency", None)
    if "resistance" not in given and others["netlist"] is None:
        _value(given, "resistance", "empty: none yet")
    if others["title"] is None:
        others["title"] = _prompt("Title (empty: none)", lambda text: text, "")


def _any(given: dict[str, str], group: str) -> bool:
    return any(flag.name in given for flag in FLAGS.values() if flag.group == group)


def _value(given: dict[str, str], name: str, empty: str | None) -> bool:
    """Ask for one value; False where it may be left out, as ``empty`` says, and is."""

    def checked(text: str) -> str:
        if text.strip():
            try:
                read(name, text)
            except InputError as error:
                raise click.UsageError(typed(str(error))) from None
        elif empty is None:
            raise click.UsageError(f"{FLAGS[name].option} must be given, but is left out")
        return text.strip()

    question = FLAGS[name].question + (f" ({empty})" if empty else "")
    text = _prompt(question, checked, "")
    if text:
        given[name] = text
    return bool(text)


def _prompt(question: str, checked: Callable[[str], str], default: str) -> str:
    return str(click.prompt(question, default=default, show_default=False, value_proc=checked, err=True))
