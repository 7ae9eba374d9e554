"""The picture of the slope by blocks beside continuum and source."""

import json
import sys

from graben.stages.dem_run import stage as dem_run
from pipelines.upscaling import slope_compare

SCENE = """
kind = "blocks"
fidelity = "draft"
[domain]
outline = [["0 m","0 m"],["8 m","0 m"],["8 m","5 m"],["4 m","5 m"],["3 m","2 m"],["0 m","2 m"]]
[tessellation]
edge = "1.5 m"
rounding = "0.1 m"
[numerics]
steps = 2000
[output]
vtk = false
[programme]
falling = true
[[programme.supports]]
start = ["0 m","0 m"]
end = ["8 m","0 m"]
[[programme.loads]]
start = ["5.1 m","5 m"]
end = ["6.1 m","5 m"]
rate = "0.25 MPa/s"
"""


def test_the_curves_of_a_run_are_drawn_in_megapascals(tmp_path, monkeypatch):
    scene, blocks, picture = tmp_path / "s.toml", tmp_path / "s.nc", tmp_path / "s.png"
    scene.write_text(SCENE)
    headline = dem_run.run(scene, blocks)
    blocks.with_suffix(".json").write_text(json.dumps(headline))
    band = tmp_path / "band.json"
    band.write_text(json.dumps({"failure_load_low_pa": 1e7, "failure_load_high_pa": 1.3e7}))
    settlement, load, rest = slope_compare.curves(blocks)
    assert load.max() * 1e6 <= headline["largest_load_pa"] * 1.001 and (rest <= load).all()
    assert settlement[0] >= 0.0 and len(settlement) == len(load)
    monkeypatch.setattr(sys, "argv", ["slope_compare", str(blocks), "-o", str(picture), "--band", str(band)])
    slope_compare.main()
    assert picture.read_bytes()[:4] == b"\x89PNG"
