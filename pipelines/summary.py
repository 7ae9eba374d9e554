"""Headline numbers of the chains.

python pipelines/summary.py write CHAIN FOLDER    FOLDER/*.json of the stages -> FOLDER/summary.json
python pipelines/summary.py table RESULTS         one table of both chains, and where the pictures are
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

# (row, unit, what one unit is in SI, chain, stage, key), in the order of the table.
ROWS = [
    ("fit to our blocks, RMSE of vertical stress", "MPa", 1e6, "upscaling", "calibration", "rmse_pa"),
    ("fit to UDEC's curves, RMSE of vertical stress", "MPa", 1e6, "upscaling", "calibration-udec", "rmse_pa"),
    ("slope, failure load (law from our blocks)", "MPa", 1e6, "upscaling", "slope", "failure_load_pa"),
    ("slope, lowest failure load in the band", "MPa", 1e6, "upscaling", "slope-band", "failure_load_low_pa"),
    ("slope, highest failure load in the band", "MPa", 1e6, "upscaling", "slope-band", "failure_load_high_pa"),
    ("scratch, groove area", "um2", 1e-12, "wear", "scratch", "groove_area_m2"),
    ("scratch, degree of wear", "1", 1.0, "wear", "scratch", "degree_of_wear"),
    ("scratch, path over contact half-width s/a", "1", 1.0, "wear", "scratch", "s_over_a"),
    ("scratch, normal force", "N", 1.0, "wear", "scratch", "normal_force_n"),
]


def stages_of(folder: Path) -> dict[str, Any]:
    """The headline objects that the stages left in a folder, by stage name."""
    files = sorted(p for p in folder.glob("*.json") if p.name != "summary.json")
    return {p.stem: json.loads(p.read_text(encoding="utf-8")) for p in files}


def write(chain: str, folder: Path) -> None:
    """Gather the stages' headline numbers into FOLDER/summary.json; the chain's main ones stand on top."""
    stages = stages_of(folder)
    top: dict[str, Any] = {"chain": chain}
    for _, _, _, of, stage, key in ROWS:
        if of == chain and key in stages.get(stage, {}):
            name = key if stage != "calibration-udec" else "udec_" + key
            top[name] = stages[stage][key]
    if chain == "upscaling":
        top["parameters"] = stages["calibration"]["parameters"]
    else:
        top["mixtures"] = stages["astm-g65-mixtures"]["mixtures"]
        top["wear_rate_m3_per_s"] = stages["own-bed-and-groove"]["mixtures"][0]["wear_rate_m3_per_s"]
    part = folder / ".summary.json.part"
    part.write_text(json.dumps({**top, "stages": stages}, indent=1) + "\n", encoding="utf-8")
    os.replace(part, folder / "summary.json")


def table(results: Path) -> None:
    """Print one table of both chains and the paths of their pictures and ParaView files."""
    from rich.console import Console
    from rich.table import Table

    chains = {c: json.loads((results / c / "summary.json").read_text()) for c in ("upscaling", "wear")}
    console = Console(width=100)
    shown = Table(title="graben: what the two chains found", title_justify="left")
    for column in ("quantity", "value", "unit"):
        shown.add_column(column, justify="right" if column == "value" else "left")
    for name, value in chains["upscaling"]["parameters"].items():
        shown.add_row(
            f"law from our blocks: {name}", f"{value:.4g}" if isinstance(value, float) else str(value), "SI"
        )
    for row, unit, one, chain, stage, key in ROWS:
        value = chains[chain]["stages"].get(stage, {}).get(key)
        shown.add_row(row, "none" if value is None else f"{value / one:.4g}", unit)
    shown.add_row("wear rate, our bed and groove", f"{chains['wear']['wear_rate_m3_per_s']:.4g}", "m3/s")
    for mixture in chains["wear"]["mixtures"]:
        shown.add_row(f"wear rate, {mixture['name']}", f"{mixture['wear_rate_m3_per_s']:.4g}", "m3/s")
    console.print(shown)
    for title, pattern in (("Pictures", "*/*.png"), ("For ParaView", "*/*.pvd")):
        console.print(f"\n{title}:")
        for path in sorted(results.glob(pattern)):
            console.print(f"  {path}", highlight=False)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["write", ("upscaling" | "wear") as chain, folder]:
            write(chain, Path(folder))
        case ["table", results]:
            table(Path(results))
        case _:
            sys.exit(__doc__)
