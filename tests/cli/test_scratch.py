"""The scratch command: JSON contract, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

from click.testing import CliRunner

from graben.cli.scratch import main

QUICK = [
    a
    for s in (
        "specimen.length='80 um'", "specimen.width='80 um'", "mesh.size='4 um'", "tip.start='30 um'",
        "tip.path='8 um'", "numerics.slide_speed=0.04", "numerics.indent_speed=0.01", "output.frames=0",
    )
    for a in ("--set", s)
]  # fmt: skip


def test_json_has_the_contract_keys(tmp_path: Path) -> None:
    scene = tmp_path / "s.toml"
    scene.write_text('kind = "scratch"\n')
    out = tmp_path / "s.nc"
    result = CliRunner().invoke(main, [str(scene), "-o", str(out), "--json", "-q", *QUICK])
    assert result.exit_code == 0, result.output
    headline = json.loads(result.stdout)
    assert {"groove_area_m2", "degree_of_wear", "normal_force_n", "s_over_a"} <= set(headline)
    assert out.exists() and out.with_suffix(".pvd").exists()


def test_exit_codes(tmp_path: Path) -> None:
    scene = tmp_path / "s.toml"
    scene.write_text('kind = "scratch"\n[tip]\nradius = "2 N"\nsize = 3\n')
    result = CliRunner().invoke(main, [str(scene), "-o", str(tmp_path / "s.nc")])
    assert result.exit_code == 2
    assert "tip.radius" in result.output and "tip.size" in result.output
    scene.write_text('kind = "scratch"\n')
    extra = ["--set", "numerics.energy_limit=1e-9"]
    result = CliRunner().invoke(main, [str(scene), "-o", str(tmp_path / "s.nc"), "-q", *QUICK, *extra])
    assert result.exit_code == 3 and "energy error" in result.output
    assert not (tmp_path / "s.nc").exists()
