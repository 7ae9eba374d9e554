import math

import pytest

from graben.schemas.quantities import to_si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("65 GPa", "Pa", 65e9),
        ("10 GPa/m", "Pa/m", 10e9),
        ("32 deg", "rad", math.radians(32)),
        ("2.7 g/cm^3", "kg/m^3", 2700.0),
        ("200 rpm", "rad/s", 200 * 2 * math.pi / 60),
        ("1e-3 mm", "m", 1e-6),
        ("2 um", "m", 2e-6),
        ("-0.5 MPa", "Pa", -5e5),
    ],
)
def test_quantities_become_si(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("65 GPa", "m", "dimension"),
        ("65 Gpq", "Pa", "quantity in Pa"),
        ("65", "Pa", "dimension"),
        (65e9, "Pa", "bare number"),
        ("nan Pa", "Pa", "finite"),
        ("", "Pa", "quantity in Pa"),
        ("two metres", "m", "quantity in m"),
        ("__import__('os')", "m", "quantity in m"),
    ],
)
def test_what_is_no_such_quantity_is_refused_with_what_was_expected(text, unit, words):
    with pytest.raises(ValueError, match=words):
        to_si(text, unit)
