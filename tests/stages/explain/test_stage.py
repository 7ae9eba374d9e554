"""explain: what is modelled and left out, sizes, times, and what makes a run dearer."""

import json

import pytest

from graben.cli.scene import KINDS
from graben.declared.costs import COSTS
from graben.declared.knobs import FIDELITIES, STAGES
from graben.errors import BadInput
from graben.schemas.kinds import SCENES
from graben.stages.explain import machine, stage
from graben.stages.explain.features import FEATURES
from tests.conftest import made

BLOCKS = {"kind": "blocks", "numerics": {"steps": 1000}}


@pytest.fixture(autouse=True)
def a_machine(monkeypatch):
    """One that is twice as slow as that of the costs."""
    monkeypatch.setattr(stage, "slowness", lambda: 2.0)


def test_every_kind_has_costs_and_features():
    assert set(COSTS) == set(FEATURES) == set(SCENES)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind(kind, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(made("scene", kind).output, encoding="utf-8")
    found = json.loads(made("explain", path, "--json").stdout)
    assert found["models"] and found["leaves_out"] and found["memory_bytes"] > 1e8
    assert kind == "wear" or found["error_of"] in {s.headline for s in STAGES}
    if kind != "calibrate":
        assert found["cpu_s"] > 0.0 and found["warnings"] == []
    else:  # its curves are missing
        assert found["cpu_s"] is None and len(found["warnings"]) == 1


def test_time_is_start_and_work():
    found = stage.run(BLOCKS)
    cost = COSTS["blocks"]
    assert found["steps"] == 1000
    assert found["cpu_s"] == pytest.approx(2.0 * cost.at(found["sizes"]["zones"] * 1000))
    assert set(found["fidelities"]) == set(FIDELITIES)


def test_what_makes_a_run_dearer_comes_first():
    growth = COSTS["blocks"].growth
    found = stage.run({"kind": "blocks", "numerics": {"steps": 10_000_000}})
    keys = {row["key"]: row for row in found["keys"]}
    assert keys["tessellation.edge"]["to"] == "0.25 m" and keys["tessellation.edge"]["cost"] == pytest.approx(
        4**growth, 0.1
    )
    assert keys["numerics.steps"]["to"] == "20000000" and keys["numerics.steps"]["cost"] == pytest.approx(
        2**growth, 0.05
    )
    costs = [row["cost"] for row in found["keys"]]
    assert costs == sorted(costs, reverse=True) and min(costs) > 1.05


def test_a_feature_moves_from_left_out_to_modelled():
    plain = stage.run(BLOCKS)
    strong = stage.run(BLOCKS, overrides=["joints.tension=1 MPa", "rock.zones=mohr-coulomb"])
    for words, held in (("tensile strength of joints", "tension"), ("yield of the rock between joints", "yield")):
        assert words in plain["leaves_out"] and words not in strong["leaves_out"]
        assert any(held in text for text in strong["models"])


def test_a_faulty_scene_is_refused():
    with pytest.raises(BadInput, match="no_such_key"):
        stage.run({"kind": "fem", "no_such_key": 1})


def test_the_yardstick_is_kept(monkeypatch, tmp_path):
    monkeypatch.setattr(machine.kernel_cache, "folder", lambda: tmp_path / "kernels")
    monkeypatch.setattr(machine, "yardstick", lambda: 3.0 * machine.YARDSTICK_S)
    assert machine.slowness() == pytest.approx(3.0)
    monkeypatch.setattr(machine, "yardstick", lambda: pytest.fail("measured again"))
    assert machine.slowness() == pytest.approx(3.0)
    (tmp_path / "machine.json").write_text("no json")
    monkeypatch.setattr(machine, "yardstick", lambda: machine.YARDSTICK_S)
    assert machine.slowness() == pytest.approx(1.0)


def test_without_a_cache_it_is_measured_each_time(monkeypatch):
    monkeypatch.setattr(machine.kernel_cache, "folder", lambda: None)
    assert machine.slowness() > 0.0
