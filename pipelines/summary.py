"""Headline numbers of the chains.

python pipelines/summary.py write CHAIN FOLDER    FOLDER/*.json of the stages -> FOLDER/summary.json
python pipelines/summary.py table RESULTS         a table a chain, what they warn of, and where the pictures are
"""

from __future__ import annotations

import csv
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graben.declared.laws import PARAMETERS
from graben.schemas.plain import write_json

UDEC = Path(__file__).parent / "upscaling/reference/udec_voronoi_granite_fit.csv"


@dataclass(frozen=True)
class Row:
    """One quantity of a table.

    unit : of the value, in SI
    key : where it stands in the headline of the stage; names and numbers of list items between dots
    published : by whom and how much, as the source prints it
    top : its name on top of summary.json, if it stands there
    """

    quantity: str
    unit: str
    stage: str
    key: str
    published: str = ""
    top: str = ""


UPSCALING = [
    Row("fit to our blocks, RMSE of vertical stress", "Pa", "calibration", "rmse_pa", "", "rmse_pa"),
    Row("fit to UDEC's curves, RMSE of vertical stress", "Pa", "calibration-udec", "rmse_pa", "Y: 1.03 MPa",
        "udec_rmse_pa"),
    Row("slope: failure load", "Pa", "slope", "failure_load_pa", "Y: 11.2 MPa (UDEC), 11.5 MPa (continuum)",
        "failure_load_pa"),
    Row("slope: lowest load in the band", "Pa", "slope-band", "failure_load_low_pa", "", "failure_load_low_pa"),
    Row("slope: highest load in the band", "Pa", "slope-band", "failure_load_high_pa", "", "failure_load_high_pa"),
    Row("slope by blocks: failure load", "Pa", "slope-blocks", "failure_load_pa", "Y: 11.2 MPa (UDEC, dead load)",
        "blocks_failure_load_pa"),
    Row("slope by blocks: lower end of its interval", "Pa", "slope-blocks", "failure_load_low_pa", "",
        "blocks_failure_load_low_pa"),
    Row("slope by blocks: upper end", "Pa", "slope-blocks", "failure_load_high_pa", "",
        "blocks_failure_load_high_pa"),
    Row("slope: settlement under the load", "m", "slope", "settlement_m", "Y: 130 to 220 mm (read off a figure)"),
]  # fmt: skip
WEAR = [
    Row("bed: contacts times diameter squared", "1", "bed", "classes.0.contacts_times_diameter_squared", "H: 0.9"),
    Row("scratch: groove area", "m2", "scratch", "groove_area_m2", "", "groove_area_m2"),
    Row("scratch: degree of wear", "1", "scratch", "degree_of_wear", "", "degree_of_wear"),
    Row("scratch: at a path over contact half-width s/a of", "1", "scratch", "s_over_a", "", "s_over_a"),
    Row("scratch: groove depth", "m", "scratch", "groove_depth_m"),
    Row("scratch: normal force", "N", "scratch", "normal_force_n", "", "normal_force_n"),
    Row("wear rate, our bed and groove", "m3/s", "own-bed-and-groove", "mixtures.0.wear_rate_m3_per_s"),
]
# Hoormazdi (2021), table 8.4, in the order of the scene's mixtures.
PUBLISHED_RATES = (8.07e-7, 7.67e-7, 6.83e-7, 5.87e-7, 4.68e-7, 2.93e-7, 0.44e-7)
# What one unit of people is in SI, the largest first: a value is shown in the first that it reaches.
SHOWN = {
    "Pa": [("GPa", 1e9), ("MPa", 1e5), ("kPa", 0.0)],
    "rad": [("deg", 0.0)],
    "m": [("m", 1.0), ("mm", 1e-4), ("um", 0.0)],
    "m2": [("m2", 1e-2), ("mm2", 1e-8), ("um2", 0.0)],
    "m3/s": [("mm3/s", 0.0)],
}
ONE = {
    "GPa": 1e9, "MPa": 1e6, "kPa": 1e3, "deg": 0.017453292519943295, "m": 1.0, "mm": 1e-3, "um": 1e-6, "m2": 1.0,
    "mm2": 1e-6, "um2": 1e-12, "mm3/s": 1e-9,
}  # fmt: skip


def shown(value: Any, unit: str) -> str:
    """A number in SI with the unit that people use for its size; a word as it is."""
    if value is None:
        return "none"
    if not isinstance(value, float | int):
        return str(value)
    for name, least in SHOWN.get(unit, []):
        if abs(value) >= least:
            return f"{value / ONE[name]:.3g} {name}"
    return f"{value:.3g} {unit}" if unit not in ("1", "word") else f"{value:.3g}"


def found(stages: dict[str, Any], row: Row) -> Any:
    value = stages.get(row.stage)
    for part in row.key.split("."):
        if value is None:
            return None
        value = value[int(part)] if isinstance(value, list) else value.get(part)
    return value


def stages_of(folder: Path) -> dict[str, Any]:
    """The headline objects that the stages left in a folder, by stage name."""
    files = sorted(p for p in folder.glob("*.json") if p.name != "summary.json")
    return {p.stem: json.loads(p.read_text(encoding="utf-8")) for p in files}


def write(chain: str, folder: Path) -> None:
    """Gather the stages' headline numbers into FOLDER/summary.json; the chain's main ones stand on top."""
    stages = stages_of(folder)
    rows = UPSCALING if chain == "upscaling" else WEAR
    top = {"chain": chain} | {row.top: found(stages, row) for row in rows if row.top}
    if chain == "upscaling":
        top["parameters"] = stages["calibration"]["parameters"]
    else:
        top["mixtures"] = stages["astm-g65-mixtures"]["mixtures"]
        top["wear_rate_m3_per_s"] = stages["own-bed-and-groove"]["mixtures"][0]["wear_rate_m3_per_s"]
    write_json(folder / "summary.json", {**top, "stages": stages}, indent=1)


def peaks(stages: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Averaged peaks of our blocks at each confinement beside UDEC's, of one tessellation each."""
    with UDEC.open(newline="", encoding="utf-8") as file:
        udec: dict[float, float] = {}
        for line in csv.DictReader(file):
            confinement = float(line["confining_stress_pa"])
            udec[confinement] = max(udec.get(confinement, 0.0), -float(line["stress_yy_pa"]))
    ours = {-path["confining_stress_pa"]: path["peak_stress_pa"]
            for name, stage in stages.items() if name.startswith("curves-") for path in stage["paths"]}  # fmt: skip
    return [
        (f"blocks: peak at {shown(pressure, 'Pa')} confinement", shown(peak, "Pa"),
         f"UDEC: {shown(udec[pressure], 'Pa')}" if pressure in udec else "")
        for pressure, peak in sorted(ours.items())
    ]  # fmt: skip


def rows_of(chain: str, stages: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Quantity, value with its unit, and the published number, of every row of a chain's table."""
    plain = [(row.quantity, shown(found(stages, row), row.unit), row.published)
             for row in (UPSCALING if chain == "upscaling" else WEAR)]  # fmt: skip
    if chain == "upscaling":
        fit = stages["calibration"]
        units = {p.name: p.unit for p in PARAMETERS[fit["law"]]}
        law = [(f"law of our blocks: {name.replace('_', ' ')}", shown(value, units[name]), "")
               for name, value in fit["parameters"].items()]  # fmt: skip
        return [*peaks(stages), *plain[:1], *law, *plain[1:]]
    mixtures = stages["astm-g65-mixtures"]["mixtures"]
    return plain + [
        (f"wear rate, {m['name']}", shown(m["wear_rate_m3_per_s"], "m3/s"), f"H: {shown(rate, 'm3/s')}")
        for m, rate in zip(mixtures, PUBLISHED_RATES, strict=True)
    ]


def table(results: Path) -> None:
    """Print a table a chain, what its stages warn of, and the paths of pictures and ParaView files."""
    from rich.console import Console
    from rich.table import Table

    console = Console(width=110)
    titles = {"upscaling": "Up-scaling: from blocks to a slope", "wear": "Wear: from grains to a rate"}
    for chain, title in titles.items():
        stages = json.loads((results / chain / "summary.json").read_text(encoding="utf-8"))["stages"]
        shown_table = Table(title=title, title_justify="left", title_style="bold")
        shown_table.add_column("quantity")
        shown_table.add_column("here", justify="right")
        shown_table.add_column("published")
        for row in rows_of(chain, stages):
            shown_table.add_row(*row)
        console.print(shown_table)
        for name, stage in stages.items():
            for warning in stage.get("warnings", []):
                console.print(f"warning, {name}: {warning}", style="yellow", highlight=False, markup=False)
        console.print()
    console.print("Y is Yetisir (2016), H is Hoormazdi (2021): docs/references.bib\n", highlight=False)
    for title, pattern in (("Pictures", "*/*.png"), ("For ParaView", "*/*.pvd")):
        console.print(f"{title}:")
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
