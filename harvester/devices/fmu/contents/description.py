"""The description of an FMU's variables in XML, as FMI 2.0 and 3.0 have it, and its terminals."""

import re
from typing import Any, NamedTuple
from xml.etree import ElementTree as Xml

from harvester import __version__
from harvester.devices.fmu.variables import INPUT, OUTPUT, PARAMETER, TIME, TUNABLE, Variable

# The powers of SI's base units in each unit of the variables
BASE_UNITS = {
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "(m/s2)2/Hz": {"m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "A": {"A": 1},
    "W": {"kg": 1, "m": 2, "s": -3},
    "J": {"kg": 1, "m": 2, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.s": {"kg": 1, "m": 1, "s": -1},
    "kg": {"kg": 1},
    "N/m": {"kg": 1, "s": -2},
    "N/m2": {"kg": 1, "m": -1, "s": -2},
    "N/m3": {"kg": 1, "m": -2, "s": -2},
    "N.s/m": {"kg": 1, "s": -1},
    "N.s/m3": {"kg": 1, "m": -2, "s": -1},
    "N.s/m5": {"kg": 1, "m": -4, "s": -1},
    "N.s2/m2": {"kg": 1, "m": -1},
    "N/V": {"m": -1, "s": 1, "A": 1},
    "F": {"kg": -1, "m": -2, "s": 4, "A": 2},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2},
    "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "Hz": {"s": -1},
}
CAUSALITY = {
    PARAMETER: ("parameter", "fixed"),
    TUNABLE: ("parameter", "tunable"),
    INPUT: ("input", "continuous"),
    OUTPUT: ("output", "continuous"),
    TIME: ("independent", "continuous"),
}
PORTS = {
    "base": (("base_acceleration", "acceleration"), ("base_force", "force")),
    "electrodes": (("voltage", "voltage"), ("current", "current")),
}
SQUARE = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
TOOL = f"harvester {__version__}"


class ModelFacts(NamedTuple):
    """A model's name, its token, a title, its inner step (s), and whether an event ends a step."""

    name: str
    token: str
    title: str
    step: float
    stops: bool


def description(variables: list[Variable], model: ModelFacts, fmi: int) -> str:
    """The file modelDescription.xml of an FMU of version ``fmi``."""
    made = _of_3 if fmi == 3 else _of_2
    return _text(made(variables, model))


def terminals(variables: list[Variable]) -> str:
    """The file terminalsAndIcons.xml of FMI 3: an icon, and base and electrodes as ports."""
    root = Xml.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    picture = Xml.SubElement(root, "GraphicalRepresentation")
    Xml.SubElement(picture, "CoordinateSystem", SQUARE, suggestedScalingFactorTo_mm="0.1")
    Xml.SubElement(picture, "Icon", SQUARE)
    every = Xml.SubElement(root, "Terminals")
    names = {variable.name for variable in variables}
    for port, members in PORTS.items():
        if all(name in names for name, _ in members):
            terminal = Xml.SubElement(every, "Terminal", name=port, matchingRule="bus")
            for name, member in members:
                Xml.SubElement(
                    terminal, "TerminalMemberVariable", variableName=name, memberName=member,
                    variableKind="signal",
                )  # fmt: skip
    return _text(root)


def _text(root: Xml.Element) -> str:
    Xml.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + Xml.tostring(root, "unicode") + "\n"


def _root(version: str, model: ModelFacts, **more: str) -> Xml.Element:
    return Xml.Element(
        "fmiModelDescription",
        more,
        fmiVersion=version,
        modelName=model.name,
        description=re.sub(r"[^ -~]", " ", model.title),
        generationTool=TOOL,
        variableNamingConvention="structured",
        license="GPL-3.0-or-later",
    )


def _units(root: Xml.Element, variables: list[Variable]) -> None:
    """The definitions of the variables' units."""
    every = Xml.SubElement(root, "UnitDefinitions")
    for unit in sorted({variable.unit for variable in variables} & set(BASE_UNITS)):
        powers = {base: str(power) for base, power in BASE_UNITS[unit].items()}
        Xml.SubElement(Xml.SubElement(every, "Unit", name=unit), "BaseUnit", powers)


def _number(value: float, variable: Variable) -> str:
    return str(int(value)) if variable.integer else repr(float(value))


def _numbers(variable: Variable) -> dict[str, str]:
    """Unit, range and start of a variable, as attributes."""
    attributes = {}
    if variable.unit in BASE_UNITS and not variable.integer:
        attributes["unit"] = variable.unit
    if variable.kind in (PARAMETER, TUNABLE, INPUT):
        attributes["min"] = _number(variable.least, variable)
        attributes["max"] = _number(variable.most, variable)
        attributes["start"] = _number(variable.start, variable)
    return attributes


def _attributes(variable: Variable, reference: int) -> dict[str, str]:
    causality, variability = CAUSALITY[variable.kind]
    if variable.integer and variable.kind == OUTPUT:
        variability = "discrete"
    return {
        "name": variable.name,
        "valueReference": str(reference),
        "description": variable.meaning,
        "causality": causality,
        "variability": variability,
    }


def _of_2(variables: list[Variable], model: ModelFacts) -> Xml.Element:
    root = _root("2.0", model, guid=model.token, numberOfEventIndicators="0")
    Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=model.name,
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        canNotUseMemoryManagementFunctions="true",
    )
    every = _model_variables(root, variables, model)
    outputs = []
    for reference, variable in enumerate(variables):
        scalar = Xml.SubElement(every, "ScalarVariable", _attributes(variable, reference))
        if variable.kind in (PARAMETER, TUNABLE):
            scalar.set("initial", "exact")
        if variable.kind == OUTPUT:
            scalar.set("initial", "calculated")
            outputs.append(reference + 1)
        Xml.SubElement(scalar, "Integer" if variable.integer else "Real", _numbers(variable))
    structure = Xml.SubElement(root, "ModelStructure")
    for part in ("Outputs", "InitialUnknowns"):
        unknowns = Xml.SubElement(structure, part)
        for index in outputs:
            Xml.SubElement(unknowns, "Unknown", index=str(index))
    return root


def _model_variables(
    root: Xml.Element, variables: list[Variable], model: ModelFacts
) -> Xml.Element:
    """The element of all variables, behind the others of both versions."""
    _units(root, variables)
    categories = Xml.SubElement(root, "LogCategories")
    Xml.SubElement(categories, "Category", name="logStatusError")
    Xml.SubElement(root, "DefaultExperiment", startTime="0", stepSize=repr(model.step))
    return Xml.SubElement(root, "ModelVariables")


def _of_3(variables: list[Variable], model: ModelFacts) -> Xml.Element:
    root = _root("3.0", model, instantiationToken=model.token)
    Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=model.name,
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        canHandleVariableCommunicationStepSize="true",
        canReturnEarlyAfterIntermediateUpdate="false",
        hasEventMode="true",
        mightReturnEarlyFromDoStep=str(model.stops).lower(),
    )
    every = _model_variables(root, variables, model)
    outputs = []
    for reference, variable in enumerate(variables):
        attributes: dict[str, Any] = _attributes(variable, reference) | _numbers(variable)
        if variable.kind in (PARAMETER, TUNABLE):
            attributes["initial"] = "exact"
        if variable.kind == OUTPUT:
            attributes["initial"] = "calculated"
            outputs.append(str(reference))
        Xml.SubElement(every, "Int32" if variable.integer else "Float64", attributes)
    structure = Xml.SubElement(root, "ModelStructure")
    for part in ("Output", "InitialUnknown"):
        for reference_text in outputs:
            Xml.SubElement(structure, part, valueReference=reference_text)
    return root
