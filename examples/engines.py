"""All engines on one scene: mean power, its error, and by how many standard errors each is off.

.venv/bin/python examples/engines.py            # a few seconds
.venv/bin/python examples/engines.py --quick    # to 5 % only
"""

import argparse
import math
from pathlib import Path

import harvester as hv

HERE = Path(__file__).parent


def main() -> None:
    """Run each, print a table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("scene", nargs="?", default=HERE / "paper_figure3.toml")
    options.add_argument("--quick", action="store_true", help="an error of 5 % instead of 1 %")
    given = options.parse_args()
    within = 0.05 if given.quick else 0.01

    scene = hv.load(given.scene)
    engines = [hv.Published(), hv.Averaged(), hv.Ensemble(within=within), hv.Spice(within=within)]
    answers = {engine.NAME: engine.run(scene) for engine in engines}
    reference = answers["ensemble"].mean_power
    print(
        f"{'engine':<10} {'mean power':>12} {'error (95 %)':>13} {'seconds':>8}   against ensemble"
    )
    for name, answer in answers.items():
        power = answer.mean_power
        known = name != "published"  # which does not know its own error
        error = f"{power.known_error95:.2g}" if known else "not known"
        against = f"times {power.value / reference.value:.3f}"
        if name == "spice":
            z = (power.value - reference.value) / math.hypot(power.stderr, reference.stderr)
            against += f", z = {z:+.2f}"
        print(f"{name:<10} {power.value:>12.4g} {error:>13} {answer.seconds:>8.2g}   {against}")


if __name__ == "__main__":
    main()
