"""Power against the load resistance, by all engines that serve the scene, with a plot.

.venv/bin/python examples/load_sweep.py            # 25 loads, half a minute; out/load_sweep.png
.venv/bin/python examples/load_sweep.py --quick    # 4 loads
"""

import argparse
from pathlib import Path

import harvester as hv

HERE = Path(__file__).parent


def main() -> None:
    """Sweep, draw, print the best."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--quick", action="store_true", help="few loads")
    options.add_argument("--out", type=Path, default=Path("out/load_sweep.png"))
    given = options.parse_args()

    scene = hv.load(HERE / "plate_with_stop.toml")
    loads = hv.logspace("1 kohm", "10 Mohm", 4 if given.quick else 25)
    engines = [hv.Published(), hv.Averaged(), hv.Ensemble(within=0.01)]
    execution = hv.Execution(workers=1 if given.quick else None)
    table = hv.sweep(scene, vary={"load.resistance": loads}, engines=engines, execution=execution)

    best = max(
        (row for row in table.of("ensemble") if row.mean_power),
        key=lambda row: row.mean_power.value,
    )
    print(
        f"best of these loads: {best.varied['load.resistance']:.3g} ohm, {best.mean_power.format('W')}"
    )
    given.out.parent.mkdir(parents=True, exist_ok=True)
    table.plot().savefig(given.out)
    print(given.out)


if __name__ == "__main__":
    main()
