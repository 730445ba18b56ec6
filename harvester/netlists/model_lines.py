"""Model cards, and the keys of every model that ngspice 39 knows.

ngspice leaves out a key that it does not know, with a warning, so that a misspelt one gives another
circuit: here it is refused.  Ratings of a part, which other simulators write down, are read and
left out.

Source of the keys: ngspice 39's tables of model parameters (its ``devhelp``), its sources'
``mod1set`` and the like.
"""

import difflib
import re
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass

from harvester.errors import InputError, invalid, shown, unknown
from harvester.netlists.expression_tree import Node
from harvester.netlists.read_lines import Line
from harvester.netlists.words import Words, tokens_of

_RATINGS = """
    bv_max fv_max iave ibvl ic_max icrating id_max idr_max irms mfg pd_max qg ron rth_ext te_max type vbc_max
    vbe_max vce_max vceo vcs_max vds vds_max vgd_max vgdr_max vgs_max vgsr_max vpk
"""
_MOS = """
    vto vt0 kp gamma phi lambda rd rs cbd cbs is pb cgso cgdo cgbo rsh cj mj cjsw mjsw js tox ld u0 uo fc nsub
    tpg nss tnom kf af level
"""
_MOS_MORE = {
    1: "",
    2: "delta uexp ucrit vmax xj neff nfs",
    3: "xl wd xw delvto delvt0 vmax xj nfs xd alpha eta delta input_delta theta kappa",
    6: "kv nv kc nc nvth ps gamma1 sigma lambda0 lambda1",
}
_BIPOLAR = """
    is bf nf vaf va ikf ik ise c2 ne br nr var vb ikr isc c4 nc rb irb rbm re rc cje vje pe mje me tf xtf vtf
    itf ptf cjc vjc pc mjc mc xcjc tr cjs csub ccs vjs ps mjs ms xtb eg xti fc kf af iss ns subs tnom tref level
    ibe ibc nkf tlev tlevc tbf1 tbf2 tbr1 tbr2 tikf1 tikf2 tikr1 tikr2 tirb1 tirb2 tnc1 tnc2 tne1 tne2 tnf1 tnf2
    tnr1 tnr2 trb1 trb2 trc1 trc2 tre1 tre2 trm1 trm2 tvaf1 tvaf2 tvar1 tvar2 ctc cte cts tvjc tvje tvjs titf1
    titf2 ttf1 ttf2 ttr1 ttr2 tmje1 tmje2 tmjc1 tmjc2 tmjs1 tmjs2 tns1 tns2 tis1 tis2 tise1 tise2 tisc1 tisc2
    tiss1 tiss2
"""
_DIODE = """
    level is js jsw tnom tref rs trs trs1 trs2 n ns tt ttt1 ttt2 cjo cj0 cj vj pb m mj tm1 tm2 cjp cjsw php mjsw
    ikf ik ikr nbv area pj tlev tlevc eg xti cta ctc ctp tpb tvj tphp jtun jtunsw ntun xtitun keg kf af fc fcs
    bv ibv ib tcv isr nr
"""
_VERTICAL = """
    vto vth0 kp phi lambda theta rd rs rg tnom kf af rq vq mtriode tcvth vtotc mu bex texp0 texp1 trd1 trd2 trg1
    trg2 trs1 trs2 trb1 trb2 subshift ksubthres tksubthres1 tksubthres2 bv ibv nbv rds rb n tt eg xti is vj cjo
    m fc cgdmin cgdmax a cgs
"""
_JFET = """
    vt0 vto beta lambda rd rs cgs cgd pb is fc b tnom tcv vtotc bex betatce xti eg kf af nlev gdsnoi level
"""
_KINDS = {
    "r": "rsh narrow dw short dlr tc1 tc1r tc2 tc2r tce defw w l tnom r res lf wf ef kf af",
    "c": "cap cj cox cjsw capsw defw w defl l narrow short del tc1 tc2 tnom di thick",
    "l": "ind tc1 tc2 tnom csect dia length nt mu",
    "d": _DIODE,
    "npn": _BIPOLAR,
    "pnp": _BIPOLAR,
    "njf": _JFET,
    "nmos": "",
    "vdmos": _VERTICAL,
    "sw": "vt vh ron roff",
    "csw": "it ih ron roff",
}
_OF_DIODE = {
    "js": "is",
    "cj0": "cjo",
    "cj": "cjo",
    "pb": "vj",
    "mj": "m",
    "ik": "ikf",
    "ib": "ibv",
    "tref": "tnom",
}
_OF_BIPOLAR = {"va": "vaf", "ik": "ikf", "vb": "var", "pe": "vje", "me": "mje", "pc": "vjc", "mc": "mjc", "csub": "cjs",
               "ccs": "cjs", "ps": "vjs", "ms": "mjs", "tref": "tnom"}  # fmt: skip
_OF_RESISTOR = {"res": "r", "tc1r": "tc1", "tc2r": "tc2"}
_OF_MOSFET = {"vt0": "vto", "uo": "u0"}
# Other names of keys, by the type of the model: here each has the first.
_ALIASES = {
    "d": _OF_DIODE,
    **dict.fromkeys(("npn", "pnp"), _OF_BIPOLAR),
    **dict.fromkeys(("nmos", "pmos", "njf", "pjf"), _OF_MOSFET),
    "vdmos": {"vth0": "vto"},
    "r": _OF_RESISTOR,
    "res": _OF_RESISTOR,
}
KEYS = {kind: frozenset(keys.split()) for kind, keys in _KINDS.items()}
KEYS |= {"res": KEYS["r"], "pjf": KEYS["njf"], "pmos": KEYS["nmos"]}
OF_LETTER = {
    "r": ("r", "res"),
    "c": ("c",),
    "l": ("l",),
    "d": ("d",),
    "q": ("npn", "pnp"),
    "j": ("njf", "pjf"),
    "m": ("nmos", "pmos", "vdmos"),
    "s": ("sw",),
    "w": ("csw",),
}
IDEAL = frozenset({"ron", "roff", "vfwd", "vrev", "rrev"})  # keys of LTspice's ideal diode
_WORDS = {"vdmos": ("nchan", "pchan")}
_MOS_LEVELS = (1, 2, 3, 6)  # the others write log files
_LEVELS = {
    "d": (1, 2, 3),
    **dict.fromkeys(("npn", "pnp", "njf", "pjf"), (1, 2)),
    "nmos": _MOS_LEVELS,
    "pmos": _MOS_LEVELS,
}


@dataclass(frozen=True)
class WrittenModel:
    """A model as it is written: its type, its trees, whose names have no values yet, and its words."""

    line: Line
    name: str
    kind: str
    trees: Mapping[str, Node]
    words: tuple[str, ...] = ()


def model_name(line: Line) -> str:
    """The name of a .model card's model, in lower case; "" if it has none."""
    return [*line.text.lower().split(), ""][1]


def read_model(line: Line) -> WrittenModel:
    """The model of a .model card.

    Raises InputError for a type, a level, a key or a word that ngspice does not know, and for a key
    given twice.
    """
    where = f"netlist {line.where}"
    tokens = tokens_of(line.text.lower())
    name = "".join(tokens[1:2])
    kind = "".join(tokens[2:3])
    rest = tokens[3:]
    if kind.startswith("ako:"):
        must = f"have the keys of {kind[4:]} itself, because ngspice has no ako:"
        raise invalid(f"model {name} in {where}", must, line.text[:60])
    if kind not in KEYS or name == "=":
        raise invalid(where, f"have a model of one of the types {', '.join(KEYS)}", line.text[:60])
    words, texts = _texts(line, kind, rest)
    known = KEYS[kind] or _mosfet_keys(where, texts)
    if kind == "d" and is_ideal(texts):
        known = IDEAL
        name = f"{name}, LTspice's ideal diode,"
    if kind in ("r", "res") and not {"tc1", "tc2", "tce"} & texts.keys():
        texts.pop(
            "t_abs", None
        )  # a temperature of PSpice's, on which the resistance does not depend
    reader = Words(line, "")
    trees: dict[str, Node] = {}
    for key, text in texts.items():
        if key not in known and key not in _RATINGS.split():
            raise _unknown_key(name, where, key, known)
        if key in known:
            trees[key] = reader.number(text)
    _check_level(where, kind, texts)
    return WrittenModel(line, model_name(line), kind, trees, tuple(words))


def _texts(line: Line, kind: str, rest: list[str]) -> tuple[list[str], dict[str, str]]:
    """The words of a card without a value, and the texts of its keys by their first names."""
    where = f"netlist {line.where}"
    words: list[str] = []
    texts: dict[str, str] = {}
    while rest:
        key = rest.pop(0)
        if key in _WORDS.get(kind, ()):
            words.append(key)
            continue
        if rest and rest[0] == "=":
            rest.pop(0)
        if not rest or rest[0] == "=":
            raise invalid(where, f"give a value to {key}", line.text[:60])
        if glued := re.fullmatch(r"([a-z]\w*?)-(\.?\d.*)", key):
            raise invalid(where, f"have {glued[1]}={glued[2]} with a sign =", key)
        canonical = _ALIASES.get(kind, {}).get(key, key)
        if canonical in texts:
            raise invalid(where, f"give {canonical} once, by one of its names", line.text[:60])
        texts[canonical] = rest.pop(0)
    return words, texts


def is_ideal(keys: Container[str]) -> bool:
    """Whether the model of a diode with such keys is LTspice's ideal one."""
    return any(key in keys for key in IDEAL)


def _unknown_key(name: str, where: str, key: str, known: Iterable[str]) -> InputError:
    """The error of a key that ngspice leaves out; all keys are listed if they are few."""
    names = sorted(known)
    if len(names) < 20 or difflib.get_close_matches(key, names, n=1):
        return unknown(f"key of model {name} in {where}", key, names)
    return InputError(
        f"unknown key of model {name} in {where} {shown(key)}: remove it, as ngspice leaves it out"
    )


def _mosfet_keys(where: str, texts: Mapping[str, str]) -> frozenset[str]:
    """The keys of a MOSFET of its level."""
    _check_level(where, "nmos", texts)
    return frozenset(_MOS.split()) | frozenset(
        _MOS_MORE[int(float(texts.get("level", "1")))].split()
    )


def _check_level(where: str, kind: str, texts: Mapping[str, str]) -> None:
    """Refuse a level that is not a number or that is not known: others write log files."""
    levels = _LEVELS.get(kind, ())
    text = texts.get("level")
    if text is not None and text not in [
        spelt for level in levels for spelt in (f"{level}", f"{level}.0")
    ]:
        raise invalid(where, f"have a model of level {', '.join(map(str, levels))}", text)
