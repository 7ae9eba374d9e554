"""Packing: every fault named, tables behind the numbers, words as indices."""

import numpy as np
import pytest

from graben.mechanics.materials.laws import LAWS, find, pack

BASE = {
    "young_modulus": 2e9,
    "poisson_ratio": 0.2,
    "friction_angle": 0.9,
    "initial_yield": 1e5,
    "hardening_gain": 1e6,
    "hardening_rate": 100.0,
}


def test_pack_puts_numbers_words_and_tables_in_their_slots():
    law = LAWS["drucker-prager"]
    values = {k: v for k, v in BASE.items() if not k.startswith("hardening")}
    par = pack("drucker-prager", {**values, "hardening": "table", "hardening_table": [[0.0, 1e6], [0.1, 2e6]]})
    assert par[law.index("young_modulus")] == 2e9
    assert par[law.index("hardening")] == 3.0
    assert par[-5:].tolist() == [2.0, 0.0, 1e6, 0.1, 2e6]
    assert par.flags.c_contiguous and par.dtype == np.float64


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"young_modulus": -1.0}, "young_modulus"),
        ({"young_modulus": None}, "required"),
        ({"poisson_ratio": 0.5}, "poisson_ratio"),
        ({"poisson_ratio": float("nan")}, "poisson_ratio"),
        ({"flow_stress_ratio": 0.7}, "flow_stress_ratio"),
        ({"hardening": "cubic"}, "one of exponential"),
        ({"colour": 1.0}, "colour"),
        ({"peak_yield": 1e6}, "counts only with hardening = 'barcelona'"),
        ({"damage": "ductile"}, "initiation_strain_050"),
    ],
)
def test_faults_name_the_parameter(change, text):
    with pytest.raises(ValueError, match=text):
        pack("drucker-prager", {**BASE, **change})


def test_all_faults_come_at_once():
    with pytest.raises(ValueError) as error:
        pack("drucker-prager", {"young_modulus": -1.0, "poisson_ratio": 2.0})
    assert all(n in str(error.value) for n in ("young_modulus", "poisson_ratio", "friction_angle", "hardening_gain"))


@pytest.mark.parametrize(
    "table", [[[0.0, 1e6], [0.0, 2e6]], [[0.0, np.inf]], [], [[1.0, 2.0, 3.0]], "steel"], ids=lambda t: str(t)[:20]
)
def test_tables_that_make_no_sense_are_refused(table):
    values = {k: v for k, v in BASE.items() if not k.startswith("hardening")}
    with pytest.raises(ValueError, match="hardening_table"):
        pack("drucker-prager", {**values, "hardening": "table", "hardening_table": table})


def test_laws_have_distinct_ids_and_states_that_match_their_names():
    assert len({law.id for law in LAWS.values()}) == len(LAWS)
    with pytest.raises(ValueError, match=r"one of .*elastic.* or module:law"):
        find("granite")
