"""Plane strain at the edges: flat elements, nu near 1/2, contrasts of stiffness, loads far from yield or weight."""

import json
import math

import numpy as np
import pytest

from graben.mechanics.fem.body import Material, make_body
from graben.mechanics.fem.loads import edge_traction
from graben.mechanics.fem.newton import NewtonOptions, equilibrate
from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.meshes.mesh2d import QuadMesh
from tests.conftest import command

E, NU = 1e9, 0.2
ELASTIC = 'law = "elastic"\n[material.parameters]\nyoung_modulus = "{young}"\npoisson_ratio = {nu}'


def metal(last):
    table = '[[0.0, "1 kPa"]]' if last is None else f'[[0.0, "1 kPa"], [1.0, "{last}"]]'
    return f'law = "j2"\n[material.parameters]\nyoung_modulus = "1 GPa"\npoisson_ratio = 0.2\nhardening = {table}'


def column(folder, width=1.0, height=1.0, at=(0.0, 0.0), axes="xy", **changes):
    """A rectangle on smooth supports with a pressure on its far side; `axes` "yx" lies it on its side."""
    values = {
        "size": 0.25, "rate": "1 MPa/s", "goal": "end", "density": "0 kg/m^3", "first": 1.0, "unit": "m",
        "material": ELASTIC.format(young="1 GPa", nu=NU),
    } | changes  # fmt: skip
    turn = axes == "yx"

    def p(x, y):
        a, b = (at[0] - y, at[1] + x) if turn else (at[0] + x, at[1] + y)
        return f'["{a!r} {values["unit"]}", "{b!r} {values["unit"]}"]'

    w, h, fix = float(width), float(height), ("x", "y") if turn else ("y", "x")
    g = ("9.81", "0") if turn else ("0", "-9.81")
    (folder / "scene.toml").write_text(
        f"""kind = "fem"
[mesh]
method = "mapped"
size = "{values["size"]!r} {values["unit"]}"
refine = []
corners = [{p(0, 0)}, {p(w, 0)}, {p(w, h)}, {p(0, h)}]
patches = [[0, 1, 2, 3]]
[material]
{values["material"]}
[gravity]
density = "{values["density"]}"
horizontal = "{g[0]} m/s^2"
vertical = "{g[1]} m/s^2"
[[supports]]
name = "base"
start = {p(0, 0)}
end = {p(w, 0)}
fix = "{fix[0]}"
[[supports]]
name = "side"
start = {p(0, 0)}
end = {p(0, h)}
fix = "{fix[1]}"
[[loads]]
name = "top"
start = {p(0, h)}
end = {p(w, h)}
rate = "{values["rate"]}"
[stepping]
goal = "{values["goal"]}"
end = "1 s"
first = "{values["first"]} s"
largest = "{values["first"]} s"
smallest = "1e-4 s"
save_every = "1 s"
"""
    )
    result = command("fem-run", folder / "scene.toml", "-o", folder / "run.nc", "--overwrite", "--json", "-q")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def shortened(headline, pressure=1e6, height=1.0, nu=NU):
    """Settlement over that of a column free to widen in its plane: p h (1 - nu2) / E."""
    return headline["settlement_m"] / (pressure * height * (1.0 - nu**2) / E)


@pytest.mark.parametrize(("width", "height", "size"), [(1e4, 1.0, 1e4), (1.0, 1e4, 1e4)])
def test_elements_10000_times_as_long_as_thick(tmp_path, width, height, size):
    found = column(tmp_path, width=width, height=height, size=size)
    assert found["elements"] == 1
    assert shortened(found, height=height) == pytest.approx(1.0, rel=1e-8)


def test_nu_of_0_4999(tmp_path):
    found = column(tmp_path, material=ELASTIC.format(young="1 GPa", nu=0.4999))
    assert shortened(found, nu=0.4999) == pytest.approx(1.0, rel=1e-9)


def test_layers_of_stiffness_1_to_1e8():
    """Two layers in series: p (1 - nu2) (h1 / E1 + h2 / E2); the stress is the pressure in both."""
    x, y = np.meshgrid(np.linspace(0, 1, 3), np.linspace(0, 1, 5), indexing="ij")
    ids = np.arange(x.size).reshape(x.shape)
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1).reshape(-1, 4)
    mesh = QuadMesh(np.stack([x.ravel(), y.ravel()], axis=1), quads)
    upper = (mesh.points[mesh.quads].mean(axis=1)[:, 1] > 0.5).astype(np.int64)
    record = LAWS["elastic"]
    materials = []
    for young in (1e4, 1e12):
        par = pack("elastic", {"young_modulus": young, "poisson_ratio": 0.0})
        materials.append(Material(record.id, par, record.initial_state(par)))
    fixed = np.stack([x.ravel() == 0, y.ravel() == 0], axis=1).ravel()
    body = make_body(mesh, materials, fixed, upper)
    unit, _ = edge_traction(mesh, np.array([0.0, 1.0]), np.array([1.0, 1.0]))
    step = equilibrate(body, body.untouched(), 100.0 * unit, np.zeros(len(body.fixed)), NewtonOptions())
    assert step.converged
    top = step.state.displacement[1::2][mesh.points[:, 1] == 1.0]
    np.testing.assert_allclose(top, -100.0 * 0.5 * (1 / 1e4 + 1 / 1e12), rtol=1e-6)
    np.testing.assert_allclose(step.state.stress[..., 1], -100.0, rtol=1e-5)


def test_a_load_1e9_times_the_yield_load_ends_at_it(tmp_path):
    """Perfectly plastic in plane strain: 2 / sqrt(3) of the yield stress, from one first step of 1e12 Pa."""
    found = column(tmp_path, material=metal(None), rate="1e12 Pa/s", goal="failure")
    assert found["failure_load_pa"] == pytest.approx(2 / math.sqrt(3) * 1e3, rel=2e-3)
    assert found["failure_load_pa"] <= 2 / math.sqrt(3) * 1e3


def test_hardening_to_a_thousand_times_the_yield_stress_is_followed(tmp_path):
    """The limit is that of the end of the table; so far from the first shape the run says that strains are large."""
    found = column(tmp_path, material=metal("1 MPa"), rate="1e12 Pa/s", goal="failure")
    assert found["failure_load_pa"] == pytest.approx(2 / math.sqrt(3) * 1e6, rel=2e-3)
    assert found["movement_over_size"] > 0.1 and any("small displacements" in w for w in found["warnings"])


@pytest.mark.parametrize("pull", [1.0, -1.0])
def test_a_load_1e_10_of_the_weight_still_moves_the_body(tmp_path, pull):
    """Its unbalanced force is below the tolerance of all the others, and its settlement is asked for."""
    found = column(tmp_path, density="1e15 kg/m^3", rate=f"{pull} MPa/s")
    assert shortened(found, pressure=pull * 1e6) == pytest.approx(1.0, rel=1e-5)
    assert found["last_load_pa"] == pytest.approx(pull * 1e6)


@pytest.mark.parametrize("scale", [1e-6, 1e3])
def test_lengths_scale(tmp_path, scale):
    found = column(tmp_path, width=scale, height=2 * scale, size=0.25 * scale)
    assert shortened(found, height=2 * scale) == pytest.approx(1.0, rel=1e-9)


def test_turned_shifted_and_in_millimetres(tmp_path):
    """A column under weight and pressure: upright, on its side, 1e6 m away, in mm: the same dimensionless result."""
    soil = {"density": "2000 kg/m^3", "height": 2.0}
    one = column(tmp_path, **soil)["settlement_m"]
    assert column(tmp_path, axes="yx", **soil)["settlement_m"] == pytest.approx(one, rel=1e-9)
    assert column(tmp_path, at=(1e6, -1e6), **soil)["settlement_m"] == pytest.approx(one, rel=1e-7)
    in_mm = column(
        tmp_path, width=1e3, height=2e3, size=250.0, unit="mm", density="2 t/m^3", rate="1 MPa/s",
        material=ELASTIC.format(young="1000 N/mm^2", nu=NU),
    )  # fmt: skip
    assert in_mm["settlement_m"] == pytest.approx(one, rel=1e-9)
