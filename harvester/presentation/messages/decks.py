"""Remarks of `harvester adopt` on the lines of a deck."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {
    "deck_drive": "left out: {text} ({line}), the drive between {nets}, which the scene's device "
    "replaces",
    "deck_no_drive": "no source is between {nets}, and nothing is left out there",
    "deck_capacitance": "left out: {text} ({line}), the piezo's own capacitance, which the scene "
    "has: [piezo] capacitance = {value} F",
    "deck_capacitance_open": "left out: {text} ({line}), the piezo's own capacitance, which the "
    "scene has as a number: [piezo] capacitance",
    "deck_motion": "left out: {text}, in series with the drive: the mass, spring and damper of the "
    "deck's own model, which the scene's [oscillator] replaces",
    "deck_series": "left out: {text}, in series with the drive, which the scene's device does not "
    "have",
    "deck_meter": "left out: {text}, which measures a current of the deck's own model of the piezo",
    "deck_measurement": "left out: {text} ({line}), which reads the deck's own model of the piezo, or "
    "is fed by an element that does",
    "deck_start": "left out: {text} of .ic ({line}), a part of the deck's own model of the piezo",
    "deck_written": "written: {out}",
    "deck_unwritten": "nothing was written: `out` board.cir writes the board",
    "deck_table": "its table in a scene:",
    "deck_new": "a new scene of it: {command}",
    "deck_cards": "left out: {cards} (settings of the deck's own simulation)",
    "deck_commands": lambda count: (
        f"left out: {count} command{'s' * (count > 1)} between .control and .endc, which never run here"
    ),
    "deck_command_changes": "left out: the command {command} ({line}), which may change the "
    "circuit",
    "deck_option": "left out: the option {option}, which changes the circuit in ngspice",
    "deck_kept": "kept: {card}",
    "deck_source_kept": "kept: {element}, a source of the board's own; the power that it supplies "
    "is not harvested",
    "deck_load": "load: {element}, whose power is reported; another one: `load` NAME",
    "deck_store": "storage capacitor: {element}; another one: `store` NAME",
    "deck_step": "{text} is: harvester sweep SCENE --vary {key}={values}",
    "deck_step_left_out": "left out: {text}, because it does not step a single value of one element",
    "deck_step_too_long": "left out: {text}, because its values are not 2 to {most} numbers: give a "
    "range to `vary` of harvester sweep",
    "deck_library": "left out: {library}, which is not in the deck's folder",
    "deck_own_model": "models of the package, which may differ from the deck's library: {models}",
}
