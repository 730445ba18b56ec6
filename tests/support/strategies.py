"""Random scenes, options and netlists: sensible ones, extreme ones, and ones with something wrong.

The keys come from the package's own tables, so that a new key is drawn as soon as it exists; a
sensible value lies around the example that the key's own error message gives.
"""

import math

import tomli_w
from hypothesis import strategies as st

from harvester.scene.keys import TABLES, key_kind
from harvester.scene.table import key_names

NUMBERS = {
    name: {key: kind for key in key_names(table) if (kind := key_kind(name, key)) is not None}
    for name, table in TABLES.items()
}
TEXTS = {"excitation": ("acceleration_file", "acceleration_psd_file"), "load": ("netlist",)}
RECORDS = (
    "shake.csv",
    "shake_psd.csv",
    "none.csv",
    "../outside.csv",
    "/etc/hostname",
    "scene.toml",
    ".",
    "",
)
NETLISTS = ("bridge", "doubler", "parallel_sshi", "series_sshi", "sece", "resistor")
LOADS = (*NETLISTS, "brigde", "none.cir", "../outside.cir", "/etc/passwd", "")

# Which keys go together; the first `PLAIN` of each are what the paper has.
PLAIN = 4
STOPS = ((), (), ("restitution",), ("restitution",))
STOPS += (("restitution", "gap"), ("stiffness",), ("stiffness", "damping"), ("stiffness", "gap"))
STOPS_OF_NUMBERS = ((), (), ("restitution",), ("restitution",), ("restitution", "gap"))
STOPS_OF_NUMBERS += (
    ("stop_stiffness", "stop_damping"),
    ("restitution", "gap", "opposite_restitution", "opposite_gap"),
)
SHAKING = (
    ("acceleration_psd",),
    ("acceleration_psd",),
    ("acceleration_psd", "stiffness_noise"),
    ("stiffness_noise",),
    ("acceleration_amplitude", "frequency"),
    ("acceleration_amplitude", "frequency", "acceleration_psd"),
    ("acceleration_psd", "correlation_time"),
    ("acceleration_psd", "centre_frequency", "bandwidth"),
    ("acceleration_file",),
    ("acceleration_psd_file",),
    (),
)
NOISES = (
    ("D11",),
    ("D11", "D22"),
    ("D11", "D22", "D12"),
    ("D11", "eps1"),
    ("D22",),
    ("drive", "drive_frequency"),
    ("D11", "drive", "drive_frequency"),
    ("D11", "correlation_time"),
    ("D11", "centre_frequency", "bandwidth"),
    (),
)
NO_VALUES = [
    math.nan,
    math.inf,
    -math.inf,
    True,
    "",
    "1",
    "x",
    "1 V",
    "-1 kg",
    "1e999 ohm",
    "nan",
    "1e3 kg kg",
    [],
    [1.0],
]
NO_VALUES += [
    [1.0],
    {},
    "9" * 5000,
    10**400,
    -1,
    0,
    1e308,
    5e-324,
    "1 Mohm/0",
    "1 m^99999999",
    "\u00b5",
    "a\nb",
    "\x1b[31m",
]
WRONG = st.sampled_from(NO_VALUES)
EDGES = (0.0, 1.0, -1.0, 1e-50, 1e50, 1e-12, 1e12, 1e-6, 1e6)


def one(kind, sensible):
    """A number that a key may well have; with ``sensible`` False also an extreme one that it must accept or refuse."""
    example = kind.read(kind.example.strip("'") if "'" in kind.example else float(kind.example))
    if kind.most < math.inf:
        usual = st.floats(kind.least, kind.most) | st.sampled_from([kind.least, kind.most])
    else:
        usual = st.floats(-1.0, 1.0).map(lambda power: example * 10.0**power)
        if kind.above == kind.least == -math.inf:
            usual = st.tuples(usual, st.sampled_from([1.0] * 9 + [-1.0])).map(math.prod)
    return usual if sensible else usual | st.sampled_from(EDGES)


def table(name, keys, sensible):
    """A table with these keys; keys of text have theirs."""
    texts = {"netlist": LOADS, "acceleration_file": RECORDS, "acceleration_psd_file": RECORDS[1:]}
    values = {
        key: st.sampled_from(texts[key][:1] if sensible else texts[key])
        if key in texts
        else one(NUMBERS[name][key], sensible)
        for key in keys
    }
    return st.fixed_dictionaries(values)


@st.composite
def tables(draw, sensible=True, plain=False):
    """A scene as nested dictionaries; ``plain``: with no effect but those of the paper, so that formulas know it."""

    def maybe(*keys):
        return tuple(key for key in keys if draw(st.integers(0, 3)) == 0)

    def often(*keys):
        return tuple(key for key in keys if draw(st.integers(0, 9)))

    if draw(st.booleans()):
        keys = often("c1", "mu", "beta") + maybe(
            "c2", "c3", "alpha", *(() if plain else ("alpha2", "linear"))
        )
        keys += draw(st.sampled_from(NOISES[:PLAIN] if plain else NOISES))
        keys += draw(st.sampled_from(STOPS_OF_NUMBERS[:PLAIN] if plain else STOPS_OF_NUMBERS))
        return {"nondimensional": draw(table("nondimensional", keys, sensible))}
    keys = draw(st.sampled_from([("damping",), ("damping_ratio",), ("damping_ratio",), ()]))
    keys += maybe(
        "cubic_stiffness",
        "damping_x2",
        "damping_x4",
        *(() if plain else ("quadratic_stiffness", "damping_v")),
    )
    scene = {"oscillator": draw(table("oscillator", ("mass", "stiffness", *keys), sensible))}
    scene["piezo"] = draw(table("piezo", ("coupling", "capacitance"), sensible))
    stop = draw(st.sampled_from(STOPS[:PLAIN] if plain else STOPS))
    if stop:
        scene["stop"] = draw(table("stop", stop, sensible))
    if "restitution" in stop and not plain and draw(st.booleans()):
        scene["opposite_stop"] = draw(table("opposite_stop", ("restitution", "gap"), sensible))
    scene["excitation"] = draw(
        table("excitation", draw(st.sampled_from(SHAKING[:PLAIN] if plain else SHAKING)), sensible)
    )
    load = (
        ("resistance",)
        if plain
        else draw(st.sampled_from([("resistance",), ("resistance",), ("netlist",), ()]))
    )
    if load:
        scene["load"] = draw(table("load", load, sensible))
        if "netlist" in load and draw(st.booleans()):
            names = st.sampled_from(
                ["R", "C", "R", "C"]
                if sensible
                else ["R", "L", "Cp", "nothing", "R; quit", ".control"]
            )
            values = one(NUMBERS["load"]["resistance"], sensible)
            scene["load"]["parameters"] = draw(st.dictionaries(names, values, max_size=2))
    return scene


@st.composite
def broken(draw):
    """A scene with one thing wrong, or odd: a key more or less, a value of another kind, an extreme."""
    scene = draw(tables(sensible=False))
    name = draw(st.sampled_from([*TABLES, "nothing"]))
    keys = [*NUMBERS.get(name, ()), *TEXTS.get(name, ()), "nothing", "restitutoin"]
    what = draw(st.sampled_from(["value", "edge", "without", "no table", "odd table", "odd title"]))
    present = [(t, k) for t, some in scene.items() for k in some]
    if what == "odd title":
        scene = {"title": draw(st.text(max_size=50) | WRONG)} | scene
    elif what == "no table":
        scene.pop(draw(st.sampled_from(list(scene))))
    elif what == "odd table":
        scene[name] = draw(WRONG | st.lists(st.just({}), max_size=2))
    elif what == "without" and present:
        t, k = draw(st.sampled_from(present))
        del scene[t][k]
    else:
        if present and draw(st.booleans()):
            name, key = draw(st.sampled_from(present))
        else:
            key = draw(st.sampled_from(keys))
        scene.setdefault(name, {})[key] = draw(WRONG if what == "value" else st.sampled_from(EDGES))
    return scene


def written(scene):
    """The scene file, of bytes that need not be one."""
    try:
        return tomli_w.dumps(scene).encode("utf-8", "surrogatepass")
    except ValueError:  # a number of more digits than Python prints
        return b"[oscillator]\nmass = " + b"9" * 5000 + b"\n"


scenes = st.one_of(
    tables(), tables(plain=True), tables(plain=True), tables(plain=True, sensible=False), broken()
)


@st.composite
def near(draw, scenes):
    """One of the scenes with other numbers, in one of three with extreme ones: its kernels are compiled already."""
    scene = draw(st.sampled_from(scenes))
    extreme = draw(st.sampled_from([False, False, True]))
    found = {}
    for name, some in scene.items():
        if isinstance(some, dict):
            found[name] = {
                key: draw(_around(NUMBERS[name].get(key), value, extreme))
                for key, value in some.items()
            }
    return found


def _around(kind, value, extreme):
    """Numbers around a scene's own; with ``extreme`` also some far from it."""
    if kind is None or isinstance(value, dict):
        return st.just(value)
    if kind.most < math.inf:
        return one(kind, True)
    usual = st.floats(-1.0, 1.0).map(lambda power: kind.read(value) * 10.0**power)
    return st.one_of(*[usual] * 9, st.sampled_from(EDGES)) if extreme else usual


ODD_WORDS = [
    "nan",
    "inf",
    "-inf",
    "-1",
    "0",
    "1e999",
    "-0",
    "",
    " ",
    "--",
    "-",
    "1%",
    "101%",
    "1 kg",
    "0x10",
    "1_0",
]
ODD_WORDS += [
    "9" * 400,
    "../..",
    "/proc/self/mem",
    "/dev/full",
    "~",
    "a\nb",
    "\x1b[31m",
    "%s",
    "{}",
    "$(id)",
    "\udcff",
]
ODD = st.text(max_size=12) | st.sampled_from(ODD_WORDS)
RANGES = [
    "load.resistance=1k:1M:2",
    "load.resistance=1k,1M",
    "nondimensional.mu=.1:1:2",
    "stop.restitution=0:1:2",
]
RANGES += [
    "load.resistance=1k",
    "load.resistance=1k:1M:0",
    "load.resistance=1k:1M:10000000000",
    "load.resistnce=1k:2k:2",
]
RANGES += [
    "load.resistance=1M:1k:2",
    "=",
    "a=b",
    "title=1:2:3",
    "load.netlist=1:2:3",
    "load.resistance=-1:1:3",
]
OPTIONS = {  # what each option may well have; the other half of the time it has an odd value
    "--engine": ["published", "averaged", "ensemble", "spice", "ideal", "enssemble"],
    "--within": ["20%", "0.5", "90%"],
    "--budget": ["1s", ".5", "0.02min"],
    "--dt": ["0.005", "0.1", "1e-9", "1e9"],
    "--trajectories": ["2", "16", "1", "1000000000000"],
    "--duration": ["1", "20", "1e-9", "1e300"],
    "--seed": ["1", "0", "99999999999999999999999"],
    "--vary": [
        "load.resistance=1k:1M",
        "nondimensional.mu=.1:1",
        "load.resistance=1M:1k",
        "load.resistance=1k",
        *RANGES,
    ],
    "--points": ["points.csv", "none.csv", "scene.toml", "."],
    "--sweep": ["3Hz:5Hz:3", ".5:1.5:3", "1:2", "3Hz:3Hz:3", "5Hz:3Hz:3", "3Hz:5Hz:1000000000000"],
    "--out": ["out", "scene.toml", "out/deep", "/proc/out"],
    "--workers": ["1", "2", "0", "1000000"],
    "--scheduler": ["tcp://127.0.0.1:1", "tcp://", "localhost"],
}


@st.composite
def options(draw, command):
    """Arguments of a click command: each of its options now and then, with a good value or an odd one."""
    arguments = []
    for option in command.params:
        name = option.opts[-1]
        if name.startswith("--") and (option.required or draw(st.integers(0, 3)) == 0):
            arguments.append(name)
            if not option.is_flag:
                known = st.sampled_from(OPTIONS.get(name, ["1"]))
                arguments.append(draw(known if draw(st.booleans()) else ODD))
    return arguments


LINES = [
    "R{k} {a} {b} {v}",
    "C{k} {a} {b} {v} ic=1",
    "L{k} {a} {b} {v}",
    "D{k} {a} {b} diode",
    "V{k} {a} {b} {v}",
    "I{k} {a} {b} {v}",
    "B{k} {a} {b} V=v({a})*{v}",
    "B{k} {a} {b} I=exp(v({a},{b})*{v})",
    "B{k} {a} {b} V=1/(v({b})-v({b}))",
    "E{k} {a} {b} {b} {a} {v}",
    "F{k} {a} {b} V1 {v}",
    "G{k} {a} {b} cur='v({a})^{v}'",
    "S{k} {a} {b} {a} 0 switch",
    "M{k} {a} {b} 0 0 mos",
    "Q{k} {a} {b} 0 bjt",
    "T{k} {a} 0 {b} 0 Z0=50 TD={v}",
    "K{k} L1 L2 {v}",
    "X{k} {a} {b} inner",
    ".model diode D(Is={v})",
    ".model switch sw(vt={v} vh={v})",
    ".model mos nmos level=1 vto={v}",
    ".model bjt npn(bf={v})",
    ".param q={v} r='q*{v}'",
    ".include {w}",
    ".subckt inner x y",
    ".ends",
    "+ {w}={v}",
    "*# {w}",
    ".control",
    "{w} {a} {b} {v}",
]
VALUES = [
    "1",
    "1k",
    "1Meg",
    "1u",
    "0",
    "-1",
    "1e300",
    "1e-300",
    "{R}",
    "{1/0}",
    "'R*2'",
    "nan",
    "inf",
    "{{",
    "}",
    "time",
    "a b",
]
WORDS = [
    "shell",
    "/etc/passwd",
    "mine.cir",
    "../outside.cir",
    "system",
    "$HOME",
    "`id`",
    "set",
    "Rload",
    "quit",
    "@r1[i]",
    "file=x",
]


@st.composite
def netlists(draw):
    """The text of a file that is a netlist, nearly one, or none."""

    def line():
        names = {"k": st.integers(1, 30), "v": st.sampled_from(VALUES), "w": st.sampled_from(WORDS)}
        names |= dict.fromkeys("ab", st.sampled_from(["p", "n", "a", "0", "x.y", "gnd"]))
        return draw(st.sampled_from(LINES)).format(
            **{name: draw(value) for name, value in names.items()}
        )

    body = [line() for _ in range(draw(st.integers(0, 8)))]
    text = [
        "* title",
        ".subckt mine p n R=1Meg",
        *body,
        "Rload p n {R}",
        ".ends",
        *([line()] if draw(st.booleans()) else []),
    ]
    if draw(st.integers(0, 3)) == 0:
        text.insert(draw(st.integers(0, len(text))), draw(st.text(max_size=30)))
    whole = "\n".join(text) + "\n"
    if draw(st.integers(0, 5)) == 0:
        at = draw(st.integers(0, len(whole) - 1))
        whole = whole[:at] + whole[at + draw(st.integers(1, 10)) :]
    return whole.encode("utf-8", "surrogatepass")
