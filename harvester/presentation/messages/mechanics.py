"""Messages about motions: the burn-in of trajectories, and the stability of rest."""

from collections.abc import Callable


def _burn_in_stopped(time: float, why: str, constant: str) -> str:
    reason = {
        "": "",
        "load": f"for the load's memory, {constant}, ",
        "response": f"for the response's own memory, about {constant}, ",
    }[why]
    return f"burn-in stopped at {time:g}/w0 because {reason}no stationary voltage was seen"


MESSAGES: dict[str, str | Callable[..., str]] = {
    # the burn-in
    "coarse_step": "step {step:g} is coarse for a response of frequency {frequency:.3g}",
    "dies_out": "the response dies out: the scene has no noise to sustain it",
    "burn_in_stopped": _burn_in_stopped,
    "impacts_accumulate": "below a restitution coefficient of {restitution:.3g} white noise makes impacts accumulate: "
    "infinitely many end in a finite time (Cornell, Swift and Bray 1998), so their number is not given",
    # the stability of rest
    "unreliable_restitution": "no averaging is reliable for a restitution coefficient of {restitution:g}, below 0.5",
    "exponent_doubtful": "averaging is doubtful: coupling and noise change lambda by about {error:.2g}",
    "slow_voltage": "averaging is doubtful: the slow voltage carries the orbits along",
    "leaves_the_stop": "averaging does not apply: without noise the mass leaves the stop for good",
}
