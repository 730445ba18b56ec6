"""Cards of a bench or a board: which a netlist may have, and the part of them that holds for the circuit."""

import re
from dataclasses import dataclass, field

from harvester.errors import InputError, invalid, shown, unknown
from harvester.netlists.expression_tree import Node
from harvester.netlists.read_lines import DeckError, Line
from harvester.netlists.words import Words

# cards that a load circuit may have
DEFINITIONS = (".subckt", ".ends", ".model", ".param", ".func", ".include")
PARAMETERS = (".param", ".params", ".parameter")
BENCH = (".tran", ".options", ".option", ".opt", ".temp", ".print", ".plot", ".meas", ".measure", ".save", ".ic",
         ".nodeset", ".title", ".backanno", ".wave", ".four", ".end")  # fmt: skip
LEFT_OUT = (".tran", ".ac", ".dc", ".op", ".noise", ".four", ".tf", ".sens", ".pz", ".disto",
            ".fft", ".print", ".plot", ".meas", ".measure", ".save", ".probe", ".nodeset",
            ".backanno", ".wave", ".net", ".title", ".end", ".width",
            ".loadbias", ".savebias")  # fmt: skip
# cards of other simulators, each with its remedy
REFUSED = {
    ".if": "keep the lines of the branch that is meant",
    ".alter": "make a deck of each variant",
    ".data": "make a deck of each variant, or a harvester sweep of the scene",
    ".csparam": "write .param",
    ".machine": "write its states as B sources and switches",
    ".ferret": "delete it, and copy the file that it fetches there",
}
# what a schematic has beside its elements
BOARD = (*BENCH, ".probe", ".op", ".ac", ".dc", ".global")
# Options that act on how ngspice computes or what it prints: this program sets those that matter
# itself.
_NUMERICAL = frozenset([
    "reltol", "abstol", "vntol", "chgtol", "trtol", "pivtol", "pivrel", "itl1", "itl2", "itl3",
    "itl4", "itl5", "itl6", "method", "maxord", "xmu", "interp", "savecurrents", "noacct", "acct",
    "list", "node", "nopage", "noinit", "nomod", "opts", "numdgt", "cptime", "limpts", "lvltim",
    "post", "probe", "filetype", "plotwinsize", "warn", "noopiter", "steps", "srcsteps",
    "keepopinfo", "seedinfo", "autostop", "minbreak", "maxwarns", "klu", "sparse", "rawfile",
    "acout", "rawfmt", "measdgt",
])  # fmt: skip
TEMPERATURES = ("temp", "tnom")
_VOLTAGE = re.compile(r"v\(\s*([^\s(),]+)\s*\)\s*=\s*(\{[^}]*\}|'[^']*'|[^\s,]+)")


@dataclass
class Settings:
    """The settings of cards for the whole circuit.

    ``options`` are the temperatures (``temp``, ``tnom``), ``initial`` the voltages of .ic cards by
    the nodes' names, and ``everywhere`` the names of nodes that .global cards make one in all
    subcircuits.
    """

    options: dict[str, Node] = field(default_factory=dict)
    initial: dict[str, Node] = field(default_factory=dict)
    everywhere: set[str] = field(default_factory=set)

    def add(self, line: Line, board: bool, inside: bool) -> None:
        """Read the settings of a card for the circuit.

        Refuse an unknown one, or one inside a subcircuit.
        """
        where = f"netlist {line.where}"
        word = line.word
        if word not in (BOARD if board else BENCH) or (inside and not board):
            raise _no_card(line, board, inside)
        text = line.text.lower()[len(word) :]
        if word in (".options", ".option", ".opt"):
            self._add_options(Words(line, text))
        elif word == ".temp":
            self.options["temp"] = Words(line, text).number(text.strip() or "{")
        elif word == ".global":
            self.everywhere |= set(text.split())
        elif word == ".ic" and board:
            if inside:
                raise invalid(where, "have .ic outside of subcircuits", line.text[:60])
            if _VOLTAGE.sub("", text).strip(" ,"):
                raise invalid(where, "give voltages of nodes, as in .ic v(out)=2", line.text[:60])
            self.initial |= {
                node: Words(line, text).number(value) for node, value in _VOLTAGE.findall(text)
            }

    def _add_options(self, words: Words) -> None:
        """Read the temperatures of an .options card.

        Refuse an option that changes a circuit in another way.
        """
        for key in (*words.pairs, *words.alone):
            if key in TEMPERATURES and key in words.pairs:
                self.options[key] = words.number(words.pairs[key])
            elif key not in _NUMERICAL:
                raise unknown(
                    f"option in {words.where}", key, sorted(_NUMERICAL | set(TEMPERATURES))
                )


def _no_card(line: Line, board: bool, inside: bool) -> InputError:
    """The error of a card that a circuit has not; a `DeckError` if `harvester adopt` leaves it out."""
    nets = "load.terminals in a scene names the piezo's nets"
    flat = f"in a flat netlist, such as KiCad's, {nets}"
    bench = "inside" if inside else f"(and a bench to run it by hand; {flat})"
    must = f"have only the cards {', '.join(DEFINITIONS)} {bench}"
    if board:
        must = "have only cards of a circuit, not of a simulation by hand"
    is_left_out = line.word in (*LEFT_OUT, ".step", ".control") and not inside
    kind = DeckError if is_left_out else InputError
    return kind(f"netlist {line.where} must {must}, but is {shown(line.word)}")
