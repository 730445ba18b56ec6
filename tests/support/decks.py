"""A deck, its board, and the power that ngspice alone has of each."""

from harvester.netlists.adoption import adopt
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from tests.support.ngspice_oracle import Oracle


def deck(folder, text, name="deck.cir", encoding="utf-8"):
    """The path of a deck."""
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return path


def powers(path, left, **given):
    """The adoption of a deck, and the powers (W) of its board and of the lines that are left of it."""
    adoption = adopt(path, **given)
    load = Load(
        netlist=str(path.with_name("board.cir")),
        terminals=adoption.terminals,
        resistor=adoption.resistor,
        store=adoption.store,
    )
    circuit = load_circuit(load, text=adoption.text)
    with Oracle() as ask:
        right = ask(left, adoption.terminals, adoption.resistor)
        options = [f".options {key}={value!r}" for key, value in circuit.settings.items()]
        mine = ask("\n".join([circuit.text, *options]), ("p", "0"), "r.xload.rload")
    assert (right.why, mine.why) == ("", "")
    return adoption, mine.power, right.power
