"""The data of a semiconductor or a switch in the equations: its model card, if it is a known one, and its area."""

from collections.abc import Set

from harvester.errors import InputError
from harvester.netlists.part import ROOM, CircuitPart, ModelCard, unserved

# Keys that do nothing at 27 degrees: temperature coefficients, and noise.
_NO_EFFECT = frozenset([
    "tnom", "tref", "level", "eg", "xti", "xtb", "kf", "af", "subs", "trs", "trs1", "trs2",
    "ttt1", "ttt2", "tm1", "tm2", "tlev", "tlevc", "cta", "ctc", "ctp", "tpb", "tvj", "tphp",
    "tcv", "xtitun", "keg", "ntun", "cte", "cts", "tvje", "tvjc", "tvjs", "tbf1", "tbf2", "tbr1",
    "tbr2", "tikf1", "tikf2", "tikr1", "tikr2", "tirb1", "tirb2", "tnc1", "tnc2", "tne1", "tne2",
    "tnf1", "tnf2", "tnr1", "tnr2", "trb1", "trb2", "trc1", "trc2", "tre1", "tre2", "trm1",
    "trm2", "tvaf1", "tvaf2", "tvar1", "tvar2", "titf1", "titf2", "ttf1", "ttf2", "ttr1", "ttr2",
    "tmje1", "tmje2", "tmjc1", "tmjc2", "tmjs1", "tmjs2", "tns1", "tns2", "tis1", "tis2", "tise1",
    "tise2", "tisc1", "tisc2", "tiss1", "tiss2", "vtotc", "bex", "betatce", "nlev", "gdsnoi",
])  # fmt: skip
_POSITIVE = frozenset([
    "n", "nf", "nr", "ne", "nc", "bf", "br", "phi", "vj", "pb", "vje", "pe", "vjc", "pc", "nbv",
    "bv",
])  # fmt: skip
_NOT_NEGATIVE = frozenset([
    "rs", "rd", "rb", "rc", "re", "cjo", "cje", "cjc", "cbd", "cbs", "cgs", "cgd", "tt", "tf",
    "tr",
])  # fmt: skip


def model_of(part: CircuitPart, kinds: tuple[str, ...], known: Set[str]) -> ModelCard:
    """The model of an element, one of the ``kinds``, with parameters that are ``known``.

    Raises UnservedError for another, InputError for numbers that no such model has.
    """
    card = part.model
    assert card is not None, "the reader checks this"
    if card.kind not in kinds:
        raise unserved(part, f"has a model of the type {card.kind}")
    if {"temp", "dtemp"} & part.options.keys():
        raise unserved(part, "has a temperature of its own")
    for key, value in card.values.items():
        if key not in known | _NO_EFFECT:
            raise unserved(part, f"has a model with the parameter {key}")
        if key in _NOT_NEGATIVE and value < 0.0:
            raise InputError(
                f"{part.where} must have a model whose {key} is at least 0, but has {value:g}"
            )
        if key in _POSITIVE and not value > 0.0:
            raise InputError(
                f"{part.where} must have a model whose {key} is above 0, but has {value:g}"
            )
    if card.value("tnom", "tref", default=ROOM) != ROOM or card.value("level", default=1.0) != 1.0:
        raise unserved(
            part, f"has a model of another level than 1, or of another tnom than {ROOM:g}"
        )
    return card


def area_of(part: CircuitPart) -> float:
    """The area of a diode or a transistor, times how many are side by side.

    Raises InputError if it is not above 0.
    """
    of_model = 1.0 if part.model is None else part.model.value("area", default=1.0)
    area = part.options.get("area", of_model) * part.multiplicity
    if not area > 0.0:
        raise InputError(f"{part.where} must have an area above 0, but has {area:g}")
    return area
