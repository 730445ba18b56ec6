"""Checks of further modes, a magnifier and a ball next to the device that they belong to.

Each raises InputError.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from harvester.errors import InputError, invalid
from harvester.scene.modal_parameters import ModalParameters
from harvester.scene.physical import Ball, Magnifier, Mode

MOST = 3  # tables [[mode]]: the second to the fourth mode
TURN = 2.0 * math.pi


def check_beside(
    modal: ModalParameters,
    modes: Sequence[Mode],
    magnifier: Magnifier | None,
    ball: Ball | None,
    stop: bool,
    stiffness_noise: float | None,
) -> None:
    """Refuse further modes, a magnifier and a ball that cannot be; ``stop``: the device has one."""
    _check_modes(modal, modes, stiffness_noise)
    noise = bool(stiffness_noise)
    if magnifier is not None:
        _check_alone("magnifier", {"[[mode]]": bool(modes), "excitation.stiffness_noise": noise})
        if magnifier.restitution is not None and stop:
            raise InputError(
                "magnifier.restitution must be left out next to [stop], but both are given"
            )
    if ball is not None:
        beside = {
            "[stop]": stop,
            "[magnifier]": magnifier is not None,
            "excitation.stiffness_noise": noise,
        }
        _check_alone("ball", beside)


def changed_modes(modes: Sequence[Mode], changes: Mapping[str, Any]) -> tuple[Mode, ...]:
    """Further modes with some keys set, such as "2.frequency" of the first of them."""
    keys_by_mode: list[dict[str, Any]] = [{} for _ in modes]
    for key, value in changes.items():
        number, _, name = key.partition(".")
        if int(number) > len(modes) + 1:
            raise invalid(
                f"mode.{key}", f"be of a mode that the scene has, {len(modes) + 1} at most", number
            )
        keys_by_mode[int(number) - 2][name] = value
    return tuple(mode.replace(**keys) for mode, keys in zip(modes, keys_by_mode, strict=True))


def _check_modes(
    modal: ModalParameters, modes: Sequence[Mode], stiffness_noise: float | None
) -> None:
    """Refuse too many modes, modes that are not in the order of their frequencies, and a coupling too strong.

    A coupling theta puts theta^2/(2 Cp) of energy into the capacitance at a displacement of 1,
    which must be less than the mode's spring holds there, stiffness/2: else the capacitance is
    not that of the clamped piezo.
    """
    if not modes:
        return
    if len(modes) > MOST:
        raise invalid(
            "mode", f"be at most {MOST} tables, the second to the fourth mode", len(modes)
        )
    if stiffness_noise:
        raise InputError(
            "excitation.stiffness_noise must be left out next to [[mode]], but both are given"
        )
    below = modal.frequency / TURN
    for number, mode in enumerate(modes, 2):
        if not mode.frequency > below:
            must = f"be above that of the mode before, {below:.6g} Hz"
            raise invalid(f"mode.{number}.frequency", must, mode.frequency)
        below = mode.frequency
        spring = mode.mass * (TURN * mode.frequency) ** 2
        if (mode.coupling or 0.0) ** 2 >= spring * modal.capacitance:
            most = math.sqrt(spring * modal.capacitance)
            must = f"be below {most:.4g} N/V in size, at which the piezo holds all the energy of the mode's spring"
            raise invalid(f"mode.{number}.coupling", must, mode.coupling)


def _check_alone(table: str, others: Mapping[str, bool]) -> None:
    """Refuse any of ``others`` next to a table."""
    for other, given in others.items():
        if given:
            raise InputError(f"{other} must be left out next to [{table}], but both are given")


def contact_mass(modal: ModalParameters, modes: Sequence[Mode]) -> float:
    """The mass M/(phi.phi) that a stop meets: with further modes less than that of the first, M."""
    shares = ((1.0 if mode.at_stop is None else mode.at_stop) ** 2 / mode.mass for mode in modes)
    return 1.0 / (1.0 / modal.mass + math.fsum(shares))
