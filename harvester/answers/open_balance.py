"""Whether a power balance or an energy balance, which is 0 in the equations, is 0 within its errors."""

from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.uncertainty.value import Value

# share that is borne beside what the errors explain: of 23 examples ngspice alone left 0.9 % at
# most
OPEN = 0.02


def open_balance(balance: Value) -> Diagnostic | None:
    """The warning that a ``balance``, as a fraction of the power in or of the balance's largest entry, stays open.

    Chance explains twice the half-width of 95 %, which one answer of 10,000 passes (of eight runs,
    one of 500).  The step explains three times its bias: that is measured at twice the step as of
    second order, and were it of the first, it would be three times as large.
    """
    explained = 2.0 * balance.sampling95 + 3.0 * (balance.bias or 0.0) + OPEN
    return (
        warning("open_balance", share=balance.value, most=explained)
        if abs(balance.value) > explained
        else None
    )
