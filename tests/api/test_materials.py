"""graben.material, graben.follow, graben.law: laws at a point, and laws of one's own."""

import math
import pickle

import numba
import numpy as np
import pytest

import graben
from graben.declared.laws import PARAMETERS
from graben.mechanics.fitting.curves import Curve, CurveFit
from graben.mechanics.materials.law import NOT_CONVERGED, NOT_FINITE
from graben.mechanics.materials.laws import LAWS, update
from tests.api.laws import STEEL, VOCE, voce

STRAIN = np.linspace(0.0, -0.04, 41)


def steel():
    """The same material by a law of the package."""
    return graben.material(
        "j2", young_modulus=STEEL["young_modulus"], poisson_ratio=0.3, hardening="exponential",
        initial_yield=STEEL["initial_yield"], hardening_gain=STEEL["gain"], hardening_rate=STEEL["rate"],
    )  # fmt: skip


pytestmark = pytest.mark.usefixtures("foreign_laws")


def test_a_material_takes_units_and_numbers_and_names_every_fault(tmp_path):
    rock = graben.material("mohr-coulomb", young_modulus="10 GPa", poisson_ratio=0.25, friction_angle="30 deg",
                           dilation_angle=0.1, cohesion=2e6, tensile_strength=np.float64(1e6))  # fmt: skip
    assert rock.parameters["young_modulus"] == 1e10 and rock.parameters["friction_angle"] == math.radians(30)
    assert rock.record is graben.laws()["mohr-coulomb"] and rock.record.parameter("cohesion").unit == "Pa"
    rock.save(tmp_path / "rock.material.toml")
    assert graben.material(tmp_path / "rock.material.toml") == rock
    assert graben.material(tmp_path / "rock.material.toml", cohesion="3 MPa").parameters["cohesion"] == 3e6
    assert graben.scene("fem", material=rock).material.resolve() == (rock.law, rock.parameters)
    table = graben.material("j2", young_modulus="1 GPa", poisson_ratio=0.3, hardening=[[0.0, "1 MPa"], (0.1, 2e6)])
    assert table.parameters["hardening"] == [[0.0, 1e6], [0.1, 2e6]]
    with pytest.raises(graben.BadInput) as caught:
        graben.material("mohr-coulomb", young_modulus="10 kg", cohesion=[1, 2], friction="30 deg")
    assert {f.key for f in caught.value.faults} >= {"young_modulus", "cohesion"}
    with pytest.raises(graben.BadInput, match=r"elastic: poisson_ratio = 0.6: expected a number from -0.99"):
        graben.material("elastic", young_modulus=1e9, poisson_ratio=0.6)
    with pytest.raises(graben.BadInput, match="law = 'nothing'"):
        graben.material("nothing", young_modulus=1e9)


def test_modes_of_an_elastic_point_against_closed_forms():
    e, nu = 10e9, 0.25
    rock = graben.material("elastic", young_modulus=e, poisson_ratio=nu)
    strain = np.array([0.0, -0.001, -0.002])
    lame, shear = e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))
    expected = {
        "triaxial": e * strain, "plane-stress": e * strain, "plane-strain": e / (1 - nu**2) * strain,
        "uniaxial-strain": (lame + 2 * shear) * strain,
    }  # fmt: skip
    for mode, axial in expected.items():
        path = graben.follow(rock, strain, mode=mode)
        np.testing.assert_allclose(path.stress[:, 1], axial, rtol=1e-9)
        assert path.complete and path.reached == 2.0 and path.strain[:, 1].tolist() == strain.tolist()
    np.testing.assert_allclose(graben.follow(rock, strain, mode="shear").stress[:, 3], 2 * shear * strain, rtol=1e-12)
    confined = graben.follow(rock, strain, -5e6, "triaxial")
    np.testing.assert_allclose(confined.stress[:, 1], -5e6 + e * strain, rtol=1e-9)
    np.testing.assert_allclose(confined.stress[:, [0, 2]], -5e6, rtol=1e-9)
    assert graben.follow(rock, strain, -5e6, "plane-stress").stress[:, 2] == pytest.approx(0.0, abs=1e-6)


def test_any_mix_of_strains_and_stresses_is_a_word():
    rock = graben.material("elastic", young_modulus=10e9, poisson_ratio=0.25)
    strain, stress = np.zeros((3, 4)), np.zeros((3, 4))
    strain[:, 1] = [0.0, -0.001, -0.002]
    same = graben.follow(rock, strain, stress, "sese")
    np.testing.assert_array_equal(same.stress, graben.follow(rock, strain[:, 1], mode="triaxial").stress)
    assert graben.follow(rock, np.zeros((2, 6)), mode="eeeeee").stress.shape == (2, 6)
    assert graben.follow(rock, np.zeros((2, 3)), mode="eee").stress.shape == (2, 4)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"mode": "biaxial", "strain": [0.0]}, "`mode` one of plane-strain"),
        ({"strain": None}, "`strain` of shape"),
        ({"strain": [[0.0]]}, "`strain` of shape"),
        ({"strain": [0.0, 1.0], "stress": [0.0, 1.0, 2.0]}, "`stress` a number or of shape"),
        ({"strain": [0.0, 1.0], "stress": 1.0, "mode": "shear"}, "no `stress`"),
        ({"strain": np.zeros((2, 4)), "mode": "sese"}, "`strain` and `stress` of shape"),
        ({"strain": [0.0, math.nan]}, "finite"),
        ({"strain": [0.0, 1.0], "increments": 0}, "at least 1"),
        ({"strain": [0.0, 1.0], "start": [0.0, 1.0]}, "stress at the start"),
    ],
)
def test_paths_that_make_no_sense_are_refused(arguments, said):
    with pytest.raises(graben.BadInput, match=said):
        graben.follow(graben.material("elastic", young_modulus=1e9, poisson_ratio=0.2), **arguments)


def test_a_path_without_solution_ends_where_it_was():
    rock = graben.material("elastic", young_modulus=1e9, poisson_ratio=0.2)
    weak = graben.material("mohr-coulomb", young_modulus="1 GPa", poisson_ratio=0.2, friction_angle="30 deg",
                           dilation_angle="30 deg", cohesion="1 MPa", tensile_strength="0.1 MPa")  # fmt: skip
    stress = np.zeros((11, 4))
    stress[:, 1] = np.linspace(0.0, 1e6, 11)
    assert graben.follow(rock, None, stress, "ssss").complete
    pulled = graben.follow(weak, None, stress, "ssss")
    assert not pulled.complete and len(pulled.stress) == int(pulled.reached) + 1 < 11
    assert set(pulled.state) == set(weak.record.state_names) and np.isfinite(pulled.strain).all()


def test_a_law_from_outside_follows_its_closed_form():
    path = graben.follow(graben.material("voce test", **STEEL), STRAIN, mode="triaxial")
    young, yielded = 200e9, -path.stress[:, 1]
    plastic = path.state["equivalent_plastic_strain"]
    np.testing.assert_allclose(plastic, np.maximum(-STRAIN - yielded / young, 0.0), atol=1e-12)
    beyond = plastic > 1e-9
    np.testing.assert_allclose(yielded[beyond], 3e8 + 2e8 * (1.0 - np.exp(-20.0 * plastic[beyond])), rtol=1e-9)
    np.testing.assert_allclose(yielded[~beyond], -young * STRAIN[~beyond], rtol=1e-12)
    np.testing.assert_allclose(path.strain[:, 0], path.strain[:, 2], rtol=1e-12)


@pytest.mark.parametrize("mode", ["plane-strain", "plane-stress", "uniaxial-strain", "shear"])
def test_a_law_from_outside_goes_with_the_same_law_of_the_package(mode):
    here = graben.follow(graben.material("voce test", **STEEL), STRAIN, mode=mode)
    there = graben.follow(steel(), STRAIN, mode=mode)
    np.testing.assert_allclose(here.stress, there.stress, rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize("components", [4, 6])
def test_the_tangent_by_differences_is_that_of_the_law(components):
    mine, ours = graben.material("voce test", **STEEL), steel()
    deps = np.array([1e-3, -4e-3, 5e-4, 2e-3, -1e-3, 3e-4])[:components]
    sig, tangent = np.zeros((2, components)), np.zeros((2, components, components))
    for k, m in enumerate((mine, ours)):
        assert update(m.record.id, deps, sig[k], m.record.initial_state(m.packed), m.packed, 1.0, tangent[k]) == 0
    np.testing.assert_allclose(sig[0], sig[1], rtol=1e-10)
    np.testing.assert_allclose(tangent[0], tangent[1], atol=1e-6 * 200e9)


def test_a_law_may_give_its_tangent_and_be_compiled_already():
    @graben.law("spring test", [graben.Parameter("stiffness", "Pa", 0.0)], isotropic=False)
    @numba.njit
    def spring(deps, sig, state, par, length, tangent):
        """Every component by itself."""
        for i in range(deps.shape[0]):
            sig[i] += par.stiffness * deps[i]
        for i in range(tangent.shape[0]):
            tangent[i, i] = par.stiffness
        return 0

    m = graben.material("spring test", stiffness="2 GPa")
    assert m.record.title == "Every component by itself." and m.record.state_names[0] == "equivalent_plastic_strain"
    path = graben.follow(m, np.array([0.0, 1e-3]), mode="triaxial")
    np.testing.assert_allclose(path.stress[-1], [0.0, 2e6, 0.0, 0.0], atol=1e-3)


@pytest.mark.filterwarnings("ignore:Exception ignored")
@pytest.mark.parametrize(("answer", "code"), [("code", NOT_CONVERGED), ("raise", NOT_CONVERGED), ("nan", NOT_FINITE)])
def test_what_fails_changes_nothing(answer, code, capfd):
    way = ["code", "raise", "nan"].index(answer)

    @graben.law("failing test", [graben.Parameter("x", "1", 0.0)], {"memory": 3.0, "damage": 0.5})
    def failing(deps, sig, state, par, length):
        sig[:] = np.nan if way == 2 else 7.0
        state[:] = 7.0
        if way == 1:
            raise ValueError("no")
        return 5 if way == 0 else 0

    m = graben.material("failing test", x=1.0)
    sig, state, tangent = np.ones(4), m.record.initial_state(m.packed), np.ones((4, 4))
    assert m.record.state_names == ("equivalent_plastic_strain", "damage", "memory")
    assert state.tolist() == [0.0, 0.5, 3.0]
    assert update(m.record.id, np.ones(4), sig, state, m.packed, 1.0, tangent) == code
    assert sig.tolist() == [1.0] * 4 and state.tolist() == [0.0, 0.5, 3.0] and (tangent == 1.0).all()
    assert not graben.follow(m, [0.0, 1.0]).complete
    capfd.readouterr()


def test_definitions_that_make_no_law_are_refused():
    parameter = graben.Parameter("x", "1", 0.0, 1.0)

    def good(deps, sig, state, par, length):
        return 0

    def strange(deps, sig, state, par, length):
        return par.no_such_parameter

    for name, parameters, function, said in (
        ("j2", [parameter], good, "law of the package"),
        ("test", [], good, "at least one parameter"),
        ("test", [graben.Parameter("x", "1", choices=("a",))], good, "parameters that are numbers"),
        ("test", [graben.Parameter("x", "furlong")], good, "not 'furlong'"),
        ("test", [parameter], lambda deps, sig: 0, "not of 2 arguments"),
        ("test", [parameter], strange, "no_such_parameter"),
    ):
        with pytest.raises(graben.BadInput, match=said):
            graben.law(name, parameters)(function)
        assert "test" not in LAWS and "test" not in PARAMETERS
    with pytest.raises(graben.BadInput, match=r"from 0 to 1"):
        graben.law("test", [parameter])(good)
        graben.material("test", x=2.0)


def test_a_fit_asks_for_the_law_again_in_another_process():
    path = graben.follow(steel(), STRAIN, mode="plane-strain")
    fixed = {"poisson_ratio": 0.3, "young_modulus": 200e9, "initial_yield": 3e8, "gain": 2e8}
    fit = CurveFit("voce test", fixed, ["rate"], [Curve("c", path.stress, path.strain)])
    sent = pickle.dumps(fit)
    assert pickle.loads(sent).objective([[20.0]]) == fit.objective([[20.0]])
    graben.law("voce test", VOCE, ["equivalent_plastic_strain"])(voce)
    assert pickle.loads(sent)._id == LAWS["voce test"].id != fit._id
    del PARAMETERS["voce test"]
    with pytest.raises(ValueError, match=r"one of .*, or module:law"):
        pickle.loads(sent)
