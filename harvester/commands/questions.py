"""Questions on a terminal for the values that the options of `harvester new` left out.

They are printed on stderr, so that stdout holds nothing but the answer.
"""

from collections.abc import Callable

import click

from harvester.commands.messages import typed
from harvester.devices.datasheet import FIELDS, SHAKING, STOP
from harvester.devices.device import missing, read
from harvester.errors import InputError

EMPTY = "empty: unknown"


def ask(texts: dict[str, str], netlist: bool) -> None:
    """Ask for the fields that ``texts`` still lacks, and add it.

    ``netlist`` states that the load is one.
    """
    click.echo(
        "A scene of your device.  Values carry their unit; ^C leaves without a file.", err=True
    )
    while needed := missing(texts):
        *choices, last = needed[0]
        if not any(_ask_field(texts, name, EMPTY) for name in choices):
            _ask_field(texts, last, None)
    if not _any_known(texts, STOP) and _ask_field(texts, "restitution", "empty: no stop"):
        _ask_field(texts, "gap", "empty: 0")
    quiet = not _any_known(texts, SHAKING) and not _ask_field(
        texts, "acceleration_psd", "empty: no noise"
    )
    if quiet and _ask_field(texts, "acceleration_amplitude", "empty: none"):
        _ask_field(texts, "drive_frequency", None)
    if "resistance" not in texts and not netlist:
        _ask_field(texts, "resistance", "empty: none yet")


def ask_title() -> str:
    """Ask for the title of the scene."""
    return _prompt("Title (empty: none)", str)


def _any_known(texts: dict[str, str], group: str) -> bool:
    """Whether a field of a group is known."""
    return any(field.name in texts for field in FIELDS.values() if field.group == group)


def _ask_field(texts: dict[str, str], name: str, empty: str | None) -> bool:
    """Ask for one field until the answer is a value or, if ``empty`` allows it, empty.

    Whether it is a value.
    """

    def checked(text: str) -> str:
        try:
            if text.strip():
                read(name, text)
            elif empty is None:
                raise InputError(f"`{name}` must be given, but is left out")
        except InputError as error:
            raise click.UsageError(typed(str(error))) from None
        return text.strip()

    text = _prompt(FIELDS[name].question + (f" ({empty})" if empty else ""), checked)
    if text:
        texts[name] = text
    return bool(text)


def _prompt(question: str, checked: Callable[[str], str]) -> str:
    """Ask a question until ``checked`` accepts the answer, which may be empty."""
    return str(click.prompt(question, default="", show_default=False, value_proc=checked, err=True))
