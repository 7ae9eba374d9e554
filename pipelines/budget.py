"""The finest fidelity at which a chain fits a time: python pipelines/budget.py upscaling "10 min" [--jobs 2]

Prints the fidelity; what it rests on goes to stderr. Exit code 2: not even a draft fits.
"""

from __future__ import annotations

import argparse
import logging
import sys
from pathlib import Path

from graben.declared.knobs import FIDELITIES
from graben.errors import Refused
from graben.schemas.quantities import to_si
from graben.stages.explain import stage as explain

HERE = Path(__file__).resolve().parent
COARSE = ["tessellation.edge=1 m", "tessellation.shortest_edge=0.48 m", "tessellation.rounding=0.1 m"]

# Scenes of a chain, how often each is run, and what a draft sets beside.
CHAINS: dict[str, list[tuple[str, int, list[str]]]] = {
    "upscaling": [
        ("upscaling/voronoi-granite.toml", 7, []),
        ("upscaling/slope-blocks.toml", 1, COARSE),
        ("upscaling/rev-study.toml", 1, []),
        ("upscaling/calibrate-udec.toml", 2, []),
        ("upscaling/slope.toml", 9, []),
    ],
    "wear": [("wear/bed.toml", 1, []), ("wear/scratch.toml", 1, []), ("wear/astm-g65-mixtures.toml", 2, [])],
}
# Pictures, averages and summaries, over the runs.
_BESIDE = 1.2


def seconds(chain: str, fidelity: str, jobs: int) -> float:
    """Predicted time of a chain, its runs shared out."""
    total = 0.0
    for scene, count, coarse in CHAINS[chain]:
        settings = [f"fidelity={fidelity}", *(coarse if fidelity == "draft" else [])]
        total += count * (explain.run(HERE / scene, overrides=settings)["cpu_s"] or 0.0)
    return _BESIDE * total / max(1, min(jobs, 2))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("chain", choices=CHAINS)
    parser.add_argument("budget")
    parser.add_argument("--jobs", type=int, default=1)
    args = parser.parse_args()
    try:
        budget = to_si(args.budget, "s")
    except Refused as error:
        print(f"BUDGET = {args.budget!r}: expected {error}", file=sys.stderr)
        return 2
    logging.disable(logging.WARNING)  # how curves are read is told when they are
    times = {f: seconds(args.chain, f, args.jobs) for f in FIDELITIES}
    told = ", ".join(f"{f} {t:.0f} s" for f, t in times.items())
    fits = [f for f, t in times.items() if t <= budget]
    if not fits:
        print(f"BUDGET = {args.budget!r}: expected at least {times['draft']:.0f} s ({told})", file=sys.stderr)
        return 2
    print(f"within {budget:.4g} s: fidelity {fits[-1]} (predicted: {told})", file=sys.stderr)
    print(fits[-1])
    return 0


if __name__ == "__main__":
    sys.exit(main())
