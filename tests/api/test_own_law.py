"""A law of one's own in a module beside the package: at a point, calibrated and in fem-run, as j2 of the package."""

import sys
from pathlib import Path

import numpy as np
import pytest

import graben
from tests.api.laws import STEEL
from tests.conftest import command, laws_forgotten

NAME = "own_steel:voce"
DEFINED = '\n\ngraben.law("voce", VOCE, ["equivalent_plastic_strain"])(voce)\n'
FORMULA = {"gain": "hardening_gain", "rate": "hardening_rate"}  # names of the same parameters in j2
STRAIN = np.concatenate([np.linspace(0.0, -0.003, 7), np.linspace(-0.005, -0.05, 12)])
QUICK = {"swarm": {"starts": 1, "particles": 8, "generations": 15}, "refine": {"best": 2}}
FIXED = {"young_modulus": "200 GPa", "poisson_ratio": 0.3}
FREE = {
    "initial_yield": {"lower": "100 MPa", "upper": "600 MPa"}, "gain": {"lower": "50 MPa", "upper": "800 MPa"},
    "rate": {"lower": 2.0, "upper": 80.0},
}  # fmt: skip
PLATE = {
    "kind": "fem", "fidelity": "draft",
    "mesh": {"size": "0.25 m", "corners": [["0 m", "0 m"], ["1 m", "0 m"], ["1 m", "1 m"], ["0 m", "1 m"]],
             "patches": [[0, 1, 2, 3]], "refine": []},
    "gravity": {"density": "7800 kg/m^3"},
    "supports": [{"start": ["0 m", "0 m"], "end": ["1 m", "0 m"], "fix": "both"}],
    "loads": [{"start": ["0 m", "1 m"], "end": ["0.5 m", "1 m"], "rate": "100 MPa/s"}],
    "stepping": {"goal": "end", "end": "4 s", "first": "1 s", "largest": "1 s", "tolerance": 1e-11},
}  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def module_beside_the_package(tmp_path_factory):
    """A folder of the user's with a module that defines the law; Python finds it, and it is compiled once."""
    folder = tmp_path_factory.mktemp("laws")
    source = Path(__file__).with_name("laws.py").read_text(encoding="utf-8")
    (folder / "own_steel.py").write_text(source + DEFINED, encoding="utf-8")
    (folder / "broken_steel.py").write_text("this is no Python", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch, laws_forgotten():
        patch.syspath_prepend(folder)
        yield
        sys.modules.pop("own_steel", None)


def steel(law):
    """The same material by either law."""
    ours = law == "j2"
    values = {(FORMULA.get(name, name) if ours else name): value for name, value in STEEL.items()}
    return graben.material(law, **values, **({"hardening": "exponential"} if ours else {}))


def test_at_a_point():
    for mode in ("triaxial", "plane-strain"):
        mine, ours = (graben.follow(steel(law), STRAIN, mode=mode) for law in (NAME, "j2"))
        assert mine.complete and mine.state["equivalent_plastic_strain"][-1] > 0.03
        np.testing.assert_allclose(mine.stress, ours.stress, rtol=1e-9, atol=0.3)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A test on the steel, as a file."""
    path = tmp_path_factory.mktemp("test") / "press.csv"
    test = graben.follow(steel("j2"), STRAIN, mode="plane-strain")
    columns = np.column_stack([test.strain[:, 1], test.stress[:, 1], test.strain[:, 0], test.stress[:, 0]])
    np.savetxt(path, columns, delimiter=",", header="strain_yy,stress_yy_pa,strain_xx,stress_xx_pa", comments="")
    return path


def fitted(law, measured, **more):
    """calibrate, the same scene by either law."""
    ours = law == "j2"
    free = {(FORMULA.get(name, name) if ours else name): bounds for name, bounds in FREE.items()}
    fixed = {**FIXED, "hardening": "exponential"} if ours else FIXED
    tables = {"kind": "calibrate", "law": law, "seed": 2, "fidelity": "draft", **QUICK, **more}
    return graben.run({**tables, "fixed": fixed, "free": free}, curves=[measured])


def test_calibrated_and_used_in_fem_run(measured, tmp_path):
    """The whole chain by files and commands, without a line of Python that makes the law known."""
    mine, ours = fitted(NAME, measured), fitted("j2", measured)
    for name, truth in {"initial_yield": 3e8, "gain": 2e8, "rate": 20.0}.items():
        assert mine["parameters"][name] == pytest.approx(truth, rel=1e-3)
        assert mine["parameters"][name] == pytest.approx(ours["parameters"][FORMULA.get(name, name)], rel=1e-5)

    file = mine.output.with_suffix(".material.toml")
    assert graben.material(file) == graben.material(mine.output) and graben.material(file).law == NAME
    scene = graben.scene(PLATE, material={"file": str(file)})
    (tmp_path / "plate.toml").write_text(scene.source.effective_text, encoding="utf-8")
    made = command("fem-run", tmp_path / "plate.toml", "-o", tmp_path / "plate.nc", "-q")
    assert made.exit_code == 0, made.output
    found, same = graben.open(tmp_path / "plate.nc"), graben.run(PLATE, material=ours).open()
    assert found["plastic_strain"].values.max() > 0.005
    for name in ("displacement", "stress", "plastic_strain"):
        largest = np.abs(same[name].values).max()
        np.testing.assert_allclose(found[name], same[name], atol=1e-5 * largest)


def test_in_fem_run_against_the_law_of_the_package():
    mine, ours = (graben.run(PLATE, material=steel(law)) for law in (NAME, "j2"))
    found, same = mine.open(), ours.open()
    for name in ("displacement", "stress", "plastic_strain"):
        largest = np.abs(same[name].values).max()
        np.testing.assert_allclose(found[name], same[name], atol=1e-9 * largest)
    table = graben.provenance(mine.output).scene["material"]
    assert table["law"] == NAME and graben.run(PLATE, material=table)["settlement_m"] == mine["settlement_m"]


def test_fitted_to_arrays():
    test = graben.follow(steel(NAME), STRAIN, mode="plane-strain")
    free = {"initial_yield": (1e8, "600 MPa"), "gain": FREE["gain"], "rate": (2.0, 80.0)}
    found = graben.fit({"press": test}, NAME, free, FIXED, fidelity="draft", seed=2, **QUICK)
    assert found.parameters == pytest.approx({"initial_yield": 3e8, "gain": 2e8, "rate": 20.0}, rel=1e-3)
    assert found.material.law == NAME and found.material.parameters["young_modulus"] == 200e9
    assert found.stress["press"].shape == test.stress.shape and found.rmse < 1e4
    np.testing.assert_allclose(found.stress["press"][:, 1], test.stress[:, 1], atol=1e5)


def test_a_body_is_carried_to_its_limit_load():
    """A strip under a rising pressure yields where Voce's curve saturates."""
    loads = [{"start": (0, 1), "end": (1, 1), "rate": 1e8}]
    supports = [{"start": (0, 0), "end": (1, 0), "fix": "y"}, {"start": (0, 0), "end": (0, 1), "fix": "x"}]
    found = graben.plane_analysis(
        graben.mesh.rectangle(1.0, 1.0, 0.5), graben.material(NAME, **{**STEEL, "rate": 2000.0}), supports, loads,
        stepping={"end": 9, "first": 0.5, "largest": 0.5, "smallest": 1e-3},
    )  # fmt: skip
    # plane strain of a von Mises body: 2 / sqrt(3) of the uniaxial strength, from 300 + 200 MPa
    assert found.headline["failed"]
    assert found.headline["failure_load_pa"] == pytest.approx(5e8 * 2 / np.sqrt(3.0), rel=0.02)
    assert found.plastic_strain[-1].min() > 1e-3 and (found.damage == 0.0).all()


def test_worker_processes_find_it_by_its_module(measured):
    plan = {"search": "appso", "swarm": {"starts": 1, "particles": 4, "generations": 2}, "refine": {"best": 1}}
    one, two = (fitted(NAME, measured, workers=n, **plan) for n in (1, 2))
    assert one["parameters"] == two["parameters"]


def test_worker_processes_say_why_they_do_not_know_a_law(measured):
    graben.material(NAME, **STEEL)  # this process imports the module and so knows "voce"; its workers do not
    with pytest.raises(graben.BadInput, match=r"law that worker processes find: one of .*, or module:law"):
        fitted("voce", measured, search="appso", workers=2)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        ("own_steel:none", "own_steel:voce, or module:law"),
        ("no_such_module:voce", "module that can be imported .*no_such_module"),
        ("broken_steel:voce", "module that can be imported .*syntax"),
        (":voce", "module that can be imported"),
    ],
)
def test_a_module_without_it_is_a_fault_of_the_input(law, said, tmp_path):
    graben.material(NAME, **STEEL)
    for call in (
        lambda: graben.material(law, young_modulus=1e9),
        lambda: graben.scene("fem", material={"law": law}),
        lambda: graben.scene("calibrate", law=law),
        lambda: graben.fit([], law, {"rate": (1.0, 2.0)}),
    ):
        with pytest.raises(graben.BadInput, match=said):
            call()
    with pytest.raises(graben.BadInput, match="without a colon"):
        graben.law("a:b", [graben.Parameter("x", "1")])(lambda deps, sig, state, par, length: 0)
