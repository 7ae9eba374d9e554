"""Small scenes of blocks at extremes: maps of bricks, compressed between smooth plates, by the command itself."""

import json

from graben.schemas.artifact import read_artifact
from tests.conftest import command

E, NU = 65e9, 0.2
PLANE = E / (1.0 - NU**2)


def rectangle(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def column(count, side=1.0, x0=0.0, y0=0.0):
    """Squares on top of one another."""
    return [rectangle(x0, y0 + side * k, x0 + side, y0 + side * (k + 1)) for k in range(count)]


def write_map(path, polygons):
    rings = [[[float(x), float(y)] for x, y in [*p, p[0]]] for p in polygons]
    features = [
        {"type": "Feature", "properties": {"id": k}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
        for k, ring in enumerate(rings)
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))


def compress(folder, polygons, *, unit=1.0, zones="elastic", check=True, **changes):
    """Headline and artifact of a compression of a map by 0.1 mm/s for 10 s; `unit` scales lengths and stiffness."""
    values = {
        "friction": "60 deg", "cohesion": "1 GPa", "kn": 10e9 / unit, "ks": 1e9 / unit, "pressure": 0.5e6,
        "speed": 1e-4 * unit, "rounding": 0.01 * unit, "edge": 0.5 * unit, "more": "", "numerics": "",
        "duration": "10 s", "poisson": NU, "ratio": 0.5,
    } | changes  # fmt: skip
    write_map(folder / "map.geojson", polygons)
    young = "" if zones == "rigid" else f'young = "{E!r} Pa"\npoisson = {values["poisson"]}'
    (folder / "scene.toml").write_text(
        f"""kind = "blocks"
fidelity = "draft"
[tessellation]
method = "file"
file = "map.geojson"
edge = "{values["edge"]!r} m"
rounding = "{values["rounding"]!r} m"
{values["more"]}
[rock]
zones = "{zones}"
{young}
[joints]
normal_stiffness = "{values["kn"]!r} Pa/m"
shear_stiffness = "{values["ks"]!r} Pa/m"
friction = "{values["friction"]}"
cohesion = "{values["cohesion"]}"
dilation = "0 deg"
[loading]
confining_pressure = "{values["pressure"]!r} Pa"
vertical_ratio = {values["ratio"]}
speed = "{values["speed"]!r} m/s"
duration = "{values["duration"]}"
states = 6
[numerics]
{values["numerics"]}
[output]
vtk = false
"""
    )
    result = command("dem-run", folder / "scene.toml", "-o", folder / "run.nc", "--overwrite", "--json", "-q")
    if not check:
        return result
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout), read_artifact(folder / "run.nc", "blocks")
