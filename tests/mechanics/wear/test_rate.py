"""Wear rates H (8.13)-(8.14), balance of forces, grooves at other forces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graben.mechanics.wear.rate import GrooveTable, balanced_forces, carried_load, wear_rates

AREA = 0.5 * 18e-3 * 12.7e-3
SPEED = np.pi * 0.2285 * 200 / 60


def test_first_row_of_h_table_8_4():
    rate = wear_rates(np.array([9e7]), AREA, np.array([0.37]), np.array([88.4e-12]), SPEED)
    assert rate == pytest.approx([8.07e-7], rel=5e-3)


def test_load_of_h_example():
    """9e7 contacts per m2 at 2 N each carry 20.6 kN, not 130 N."""
    assert carried_load(np.array([9e7]), AREA, np.array([2.0])) == pytest.approx(20.57e3, rel=1e-3)


@given(
    st.lists(st.floats(1e5, 1e9), min_size=1, max_size=4),
    st.floats(1.0, 1e4),
    st.lists(st.floats(0.1, 10.0), min_size=4, max_size=4),
)
def test_balanced_forces_carry_the_load(contacts, load, relative):
    weights = np.array(relative[: len(contacts)])
    force = balanced_forces(np.array(contacts), AREA, load, weights)
    assert carried_load(np.array(contacts), AREA, force) == pytest.approx(load)
    assert force / weights == pytest.approx(np.full(len(contacts), force[0] / weights[0]))


def table() -> GrooveTable:
    """H 8.4: two grains at 2 N."""
    return GrooveTable(
        np.array([2.0, 2.0]), np.array([50e-6, 100e-6]), np.array([88.4e-12, 60e-12]), np.array([0.37, 0.12])
    )


def test_table_gives_back_its_samples():
    assert table().at(2.0, 50e-6) == pytest.approx((88.4e-12, 0.37))
    assert table().at(2.0, 100e-6) == pytest.approx((60e-12, 0.12))


def test_similar_grooves_scale_with_the_grain():
    """The same F / R^2 on a grain three times as large: nine times the area, the same degree of wear."""
    small, large = table().at(1.0, 50e-6), table().at(9.0, 150e-6)
    assert large[0] == pytest.approx(9.0 * small[0])
    assert large[1] == pytest.approx(small[1])


def test_outside_the_samples_the_area_goes_with_the_three_halves_power():
    light, lighter = table().at(0.02, 50e-6), table().at(0.005, 50e-6)
    assert light[0] / lighter[0] == pytest.approx(4.0**1.5)
    assert light[1] == lighter[1] == 0.12
    assert "below" in table().doubts(0.02, 50e-6)[0]
    assert "above" in table().doubts(20.0, 50e-6)[0]
    assert table().doubts(1.0, 50e-6) == []
    assert table().at(0.0, 50e-6)[0] == 0.0


def test_exponent_follows_from_geometry():
    """Segment of a ball pressed to half-width a at pressure p: F = p pi a^2 / 2, area 2/3 a^3 / R for a << R."""
    radius, pressure = 50e-6, 5e9

    def segment(force):
        half = np.sqrt(2 * force / (np.pi * pressure))
        angle = np.arcsin(half / radius)
        return force, radius**2 * (angle - 0.5 * np.sin(2 * angle))

    force, area = segment(1e-3)
    one = GrooveTable(np.array([force]), np.array([radius]), np.array([area]), np.array([0.3]))
    for other in (2e-4, 5e-3):
        assert one.at(other, radius)[0] == pytest.approx(segment(other)[1], rel=5e-3)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (([2.0], [5e-5], [-1e-12], [0.3]), "area"),
        (([0.0], [5e-5], [1e-12], [0.3]), "force"),
        (([2.0, 2.0], [5e-5, 5e-5], [1e-12, 2e-12], [0.3, 0.3]), "keep one"),
        (([2.0, 1.0], [5e-5], [1e-12], [0.3]), "same number"),
    ],
)
def test_bad_tables(values, words):
    with pytest.raises(ValueError, match=words):
        GrooveTable(*(np.array(v) for v in values))


def test_no_contact_no_force():
    with pytest.raises(ValueError, match="no contact"):
        balanced_forces(np.zeros(2), AREA, 130.0, np.ones(2))
