"""The keys of a load circuit in a scene's load.parameters: parameters of its header, and elements by their names."""

from collections.abc import Mapping
from pathlib import Path

from harvester.errors import InputError, shown, unknown
from harvester.netlists.flat import LOAD, STORE, Board
from harvester.netlists.netlist import Body

MOST_LISTED = 40  # names in an error
KINDS = "rclvi"  # whose values are parameters by their elements' names


class CircuitKeys:
    """The keys that a scene may set in a load circuit: parameters of its header, and ``elements`` that are numbers.

    For a flat netlist the load is R and the storage capacitor is C.
    """

    def __init__(self, body: Body, board: Board) -> None:
        self.body, self.board = body, board
        self.elements = [
            element.name
            for element in body.elements
            if element.kind in KINDS
            and not element.form
            and element.value is not None
            and element.value.is_constant
        ]
        self._spelling = dict(body.spelling)
        plain = {name.lower() for name in self.elements}
        self._spelling |= {
            letter.lower(): letter for role, letter in board.roles.items() if role in plain
        }

    def called(self, name: str) -> str:
        """The name of an element in a scene."""
        if name.lower() not in self.board.renamed.values():
            return name
        renamed = (each for each in self.body.elements if each.name.lower() == name.lower())
        return next((each.line.text.split(maxsplit=1)[0] for each in renamed), name)

    def given(
        self, path: Path, parameters: Mapping[str, float], capacitance: float | None
    ) -> dict[str, float]:
        """The scene's parameters in the netlist's spelling, Cp included.

        One without default must be among them.
        """
        elements = {name.lower(): name for name in self.elements}
        values: dict[str, float] = {}
        for key, value in parameters.items():
            name = self.board.roles.get(self.board.renamed.get(key.lower(), ""), key).lower()
            spelt = self._spelling.get(name) or elements.get(name)
            if spelt is None:
                raise self._unknown(path, key)
            values[spelt] = value
        if capacitance is not None and "cp" in self.body.spelling:
            values.setdefault(self.body.spelling["cp"], capacitance)
        for parameter, default in self.body.defaults.items():
            if default is None and self.body.spelling[parameter] not in values:
                raise InputError(
                    f"load.parameters must give {self.body.spelling[parameter]} of netlist {self.body.name}, which "
                    "has no default, but does not"
                )
        return values

    def _unknown(self, path: Path, key: str) -> InputError:
        """The error of a parameter that there is not."""
        names = [self.called(element) for element in self.elements]
        name = self.body.name or path.stem
        if self._spelling or self.board.roles:
            every = dict.fromkeys([*self._spelling.values(), *names])
            error = unknown(f"parameter of netlist {name}", key, every)
            listed = ", ".join(list(every)[:MOST_LISTED])
            return error if listed in str(error) else InputError(f"{error} It has {listed}")
        return InputError(
            f"unknown parameter of netlist {name} {shown(key)}: it has none but its elements "
            f"({', '.join(names[:20]) or 'none has a plain value'}); another one is on its first line, such as "
            f"'.subckt {name} p n {key}=1Meg'"
        )

    def split(self, given: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
        """The given values of parameters, and those of elements, by their names in lower case."""
        roles = {letter.lower(): role for role, letter in self.board.roles.items()}
        parameters = {
            name.lower(): value
            for name, value in given.items()
            if name.lower() in self.body.spelling
        }
        others = {
            name.lower(): value for name, value in given.items() if name.lower() not in parameters
        }
        return parameters, {roles.get(name, name): value for name, value in others.items()}

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """The values of all parameters that are plain numbers."""
        plain = {
            name: tree.value
            for name, tree in self.body.defaults.items()
            if tree is not None and tree.is_constant
        }
        values = {self.body.spelling[name]: value for name, value in plain.items()}
        numbers = {
            element.name.lower(): element.value.value
            for element in self.body.elements
            if element.value is not None
        }
        roles = [(self.board.roles.get(role, ""), role) for role in (STORE, LOAD)]
        values |= {
            letter: numbers[role]
            for letter, role in roles
            if letter and letter in self._spelling.values()
        }
        return values | dict(given)
