"""The point driver: closed forms, any mix of control, independence of the increments, and paths without solution."""

import numpy as np
import pytest

from graben.mechanics.materials.laws import pack
from graben.mechanics.materials.point import follow

E, NU = 2e9, 0.25
ELASTIC = pack("elastic", {"young_modulus": E, "poisson_ratio": NU})
DP = {
    "young_modulus": 1.8e9,
    "poisson_ratio": 0.2,
    "friction_angle": 0.9,
    "dilation_angle": 0.6,
    "flow_stress_ratio": 0.85,
    "initial_yield": 5e4,
    "hardening_gain": 1e6,
    "hardening_rate": 300.0,
}
BRITTLE = {
    "damage": "ductile",
    "initiation_strain_050": 2e-3,
    "initiation_strain_060": 6e-3,
    "failure_displacement": 0.02,
    "max_damage": 0.9999,
}


def biaxial(confining, strain=0.04, steps=51):
    path = np.zeros((steps, 4))
    path[:, 0], path[:, 1] = -confining, -np.linspace(0, strain, steps)
    return path, np.array([-confining, -confining, -confining, 0.0])


def test_elastic_biaxial_test_in_plane_strain():
    path, start = biaxial(1e6)
    r = follow("elastic", ELASTIC, "seee", path, stress=start)
    assert r.complete.all()
    axial = path[:, 1]
    np.testing.assert_allclose(r.stress[0, :, 1] + 1e6, E / (1 - NU**2) * axial, rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(r.strain[0, :, 0], -NU / (1 - NU) * axial, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("control", ["ssss", "sess", "eees", "sssses", "essees"])
def test_any_mix_of_control_in_elasticity(control):
    n = len(control)
    rng = np.random.default_rng(0)
    strain = rng.normal(size=n) * 1e-3
    lame, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    stress = 2 * mu * strain
    stress[:3] += lame * strain[:3].sum()
    goal = np.where([c == "s" for c in control], stress, strain)
    r = follow("elastic", ELASTIC, control, np.array([np.zeros(n), goal]))
    np.testing.assert_allclose(r.stress[0, -1], stress, rtol=1e-8)
    np.testing.assert_allclose(r.strain[0, -1], strain, rtol=1e-8)


def test_stress_under_control_is_held_and_strain_under_control_is_met():
    par = pack("drucker-prager", DP)
    path, start = biaxial(2e6)
    path[:, 3] = np.linspace(0, 1e5, len(path))
    r = follow("drucker-prager", par, "sees", path, stress=start)
    assert r.complete.all()
    np.testing.assert_allclose(r.stress[0, :, 0], -2e6, rtol=1e-7)
    np.testing.assert_allclose(r.stress[0, :, 3], path[:, 3], atol=1.0)
    np.testing.assert_allclose(r.strain[0, :, 1], path[:, 1], rtol=1e-9, atol=1e-15)


def test_more_increments_converge_at_first_order_or_better():
    par = pack("drucker-prager", {**DP, **BRITTLE, "failure_displacement": 0.5})
    path, start = biaxial(1e6)
    ends = [follow("drucker-prager", par, "seee", path, stress=start, parts=k).stress[0, :, 1] for k in (1, 2, 4, 32)]
    errors = [np.abs(e - ends[-1]).max() for e in ends[:-1]]
    assert errors[1] < 0.62 * errors[0] and errors[2] < 0.62 * errors[1]


def test_a_path_without_solution_stops_and_keeps_what_it_reached():
    par = pack("drucker-prager", {**DP, "initial_yield": 1e6, "hardening_gain": 0.0})
    path = np.zeros((11, 4))
    path[:, 1] = -np.linspace(0, 1e8, 11)  # an axial stress far beyond the strength
    r = follow("drucker-prager", par, "sses", path)
    assert not r.complete[0] and 0.0 <= r.reached[0] < 1.0
    assert np.isfinite(r.stress).all() and np.isfinite(r.strain).all()
    np.testing.assert_array_equal(r.stress[0, 2], r.stress[0, 10])


def test_reached_varies_continuously_with_a_parameter():
    ends = []
    for u in np.linspace(0.020, 0.021, 6):
        par = pack("drucker-prager", {**DP, **BRITTLE, "failure_displacement": u})
        path, start = biaxial(1e6)
        r = follow("drucker-prager", par, "seee", path, stress=start, length=10.0)
        assert np.isfinite(r.stress).all() and np.isfinite(r.strain).all()
        ends.append(r.reached[0])
    assert np.ptp(ends) < 3.0


def test_several_paths_give_what_each_gives_alone():
    par = pack("drucker-prager", {**DP, **BRITTLE})
    paths = [biaxial(c) for c in (0.5e6, 2e6, 8e6)]
    both = follow(
        "drucker-prager", par, "seee", np.array([p for p, _ in paths]), stress=np.array([s for _, s in paths])
    )
    for i, (path, start) in enumerate(paths):
        alone = follow("drucker-prager", par, "seee", path, stress=start)
        np.testing.assert_array_equal(both.stress[i], alone.stress[0])


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"control": "see"}, "control"),
        ({"control": "xeee"}, "control"),
        ({"targets": np.zeros((3, 5))}, "targets"),
        ({"targets": np.full((3, 4), np.nan)}, "finite"),
        ({"parts": 0}, "parts"),
    ],
)
def test_bad_arguments_are_named(change, text):
    arguments = {"control": "seee", "targets": np.zeros((3, 4)), "parts": 1, **change}
    with pytest.raises(ValueError, match=text):
        follow("elastic", ELASTIC, arguments["control"], arguments["targets"], parts=arguments["parts"])
