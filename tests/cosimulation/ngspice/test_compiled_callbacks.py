"""The lock-step's callbacks as C functions: where their machine code is kept."""

from harvester.cosimulation.ngspice import compiled_callbacks
from harvester.mechanics.kernels.coefficients import Coefficients


def test_a_callback_has_the_same_file_in_each_process(monkeypatch):
    """What it closes over names its file: a compiled function there is another in each process, which compiles anew."""
    monkeypatch.setattr(
        compiled_callbacks, "c_function", lambda signature: lambda function: function
    )
    act = compiled_callbacks.point_function.__wrapped__(Coefficients(mu=0.0, beta=0.0), True)
    closed = [cell.cell_contents for cell in act.__closure__]
    assert closed and all(isinstance(one, int | Coefficients) for one in closed)
