"""Draw the slope by blocks beside the continuum and the source: load over settlement, with intervals.

python pipelines/upscaling/slope_compare.py BLOCKS.nc -o PICTURE [--continuum SLOPE.nc] [--band BAND.json]

The headline numbers of BLOCKS are read from the JSON beside it, which the Makefile's stages leave.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

import graben
from graben.schemas.artifact import read_artifact
from graben.schemas.quantities import to_si

# Yetisir (2016) 4.5, figure 4.6: failure load by UDEC, and the settlement read off there, smallest and largest.
SOURCE_PA = 11.2e6
SOURCE_SETTLEMENT_M = (0.13, 0.22)


def curves(blocks: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Settlement [m], pressure [MPa] and that which is borne at rest (looks,)."""
    data = read_artifact(blocks, "blocks")
    rate = to_si(graben.provenance(blocks).scene["programme"]["loads"][0]["rate"], "Pa/s")
    names = ("look_settlement", "look_load_time", "look_load_at_rest")
    settlement, load, rest = (data[name].values for name in names)
    return settlement, load * rate / 1e6, rest * rate / 1e6


def main() -> None:
    """Draw what is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("blocks", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--continuum", type=Path)
    parser.add_argument("--band", type=Path)
    a = parser.parse_args()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    settlement, load, rest = curves(a.blocks)
    headline: dict[str, Any] = json.loads(a.blocks.with_suffix(".json").read_text(encoding="utf-8"))
    axes.plot(settlement, load, color="tab:blue", label=f"{headline['blocks']} blocks")
    axes.plot(settlement, rest, color="tab:blue", lw=0.8, ls=":", label="blocks, load without inertia and damping")
    if headline["failure_load_pa"] is not None:
        low, high = (headline[f"failure_load_{end}_pa"] / 1e6 for end in ("low", "high"))
        axes.axhspan(low, high, color="tab:blue", alpha=0.15, lw=0, label="blocks, interval of the failure load")
    if a.continuum is not None:
        data = read_artifact(a.continuum, "fem")
        axes.plot(
            data["step_settlement"], data["step_pressure"] / 1e6, color="tab:orange", label="continuum (fem-run)"
        )
    if a.band is not None:
        band = json.loads(a.band.read_text(encoding="utf-8"))
        low, high = (band[f"failure_load_{end}_pa"] for end in ("low", "high"))
        if low is not None and high is not None:
            axes.axhspan(low / 1e6, high / 1e6, color="tab:orange", alpha=0.15, lw=0, label="continuum, band")
    axes.plot(SOURCE_SETTLEMENT_M, [SOURCE_PA / 1e6] * 2, "k|-", ms=10, label="Yetisir (2016), UDEC")
    axes.set_xlim(0.0, max(1.2 * float(np.max(settlement)), 0.25))
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("settlement under the load (m)")
    axes.set_ylabel("pressure behind the crest (MPa)")
    axes.legend(fontsize=8)
    figure.savefig(a.output, dpi=130)


if __name__ == "__main__":
    main()
