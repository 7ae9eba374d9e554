"""Quantities: one plain number and one unit of the right dimension and meaning; everything else is refused."""

import math
import time

import pytest

from graben.errors import Refused
from graben.schemas import quantities
from graben.schemas.quantities import plain_number, to_si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("65 GPa", "Pa", 65e9),
        ("65GPa", "Pa", 65e9),
        ("10 GPa/m", "Pa/m", 10e9),
        ("32 deg", "rad", math.radians(32)),
        ("32°", "rad", math.radians(32)),
        ("2.7 g/cm^3", "kg/m^3", 2700.0),
        ("2.7 t/m**3", "kg/m^3", 2700.0),
        ("200 rpm", "rad/s", 200 * 2 * math.pi / 60),
        ("3 deg/s", "rad/s", math.radians(3)),
        ("10 1/s", "1/s", 10.0),
        ("10 /s", "1/s", 10.0),
        ("10 s^-1", "1/s", 10.0),
        ("2 kHz", "1/s", 2000.0),
        ("1e-3 mm", "m", 1e-6),
        (" +.5e1 m ", "m", 5.0),
        ("5 metres", "m", 5.0),
        ("2 um", "m", 2e-6),
        ("2 \u00b5m", "m", 2e-6),
        ("2 \u03bcm", "m", 2e-6),
        ("2\u00a0m", "m", 2.0),
        ("2\u202fm", "m", 2.0),
        ("\u22122 m", "m", -2.0),
        ("3 MN/m²", "Pa", 3e6),
        ("3 N·m⁻²", "Pa", 3.0),
        ("3 N/(m*s)", "Pa/s", 3.0),
        ("3 kg/m/s^2", "Pa", 3.0),
        ("-0.5 MPa", "Pa", -5e5),
        ("1 ksi", "Pa", 6894757.293168),
        ("0 m", "m", 0.0),
    ],
)
def test_quantities_become_si(text, unit, value):
    if unit == "Pa/s":  # dimensions of N/(m s) are those of viscosity, not of a rate of pressure
        with pytest.raises(Refused, match="dimension"):
            to_si(text, unit)
        return
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("65 GPa", "m", "dimension"),
        ("65 Gpq", "Pa", "quantity in Pa"),
        ("65", "Pa", "no unit"),
        (65e9, "Pa", "bare number"),
        (True, "Pa", "one number and one unit"),
        (["1 m"], "m", "one number and one unit"),
        ({"a": 1}, "m", "one number and one unit"),
        ("nan Pa", "Pa", "finite"),
        ("inf Pa", "Pa", "finite"),
        ("1e400 Pa", "Pa", "finite"),
        ("1e30 m", "m", "at most"),
        ("1e-300 m", "m", "at least"),
        ("3e-400 m", "m", "too small"),
        ("5e-324 nm", "m", "at least"),
        ("9.81 m/s2", "m/s^2", "powers as in"),
        ("9.81 m s^-2", "m/s^2", "between the unit's parts"),
        ("", "Pa", "quantity in Pa"),
        ("two metres", "m", "quantity in m"),
        ("__import__('os')", "m", "quantity in m"),
        # numbers as other countries and programs write them
        ("2,5 MPa", "Pa", "write 2.5 MPa: a decimal point"),
        ("2,500 kPa", "Pa", "write 2.500 kPa or 2500 kPa"),
        ("2 500 kPa", "Pa", "thousands"),
        ("2\u202f500 kPa", "Pa", "thousands"),
        ("2'500 kPa", "Pa", "thousands"),
        ("2_500 kPa", "Pa", "thousands"),
        ("2.500,0 kPa", "Pa", "thousands"),
        ("2.5.1 m", "m", "one number"),
        ("\uff12 m", "m", "one finite number"),
        ("0x10 m", "m", "one finite number"),
        ("1/2 m", "m", "one finite number"),
        ("2 m + 3 m", "m", "one finite number"),
        ("2 * 3 m", "m", "one finite number"),
        ("2 3 m", "m", "one number"),
        ("5 ± 1 m", "m", "one finite number"),
        # units
        ("7**7**7 m", "m", "quantity in m"),
        ("2 m^2^2", "m", "quantity in m"),
        ("2 m^(9^9)", "m", "quantity in m"),
        ("2 m^12", "m", "quantity in m"),
        ("2 kg/m3", "kg/m^3", "powers as in"),
        ("2 N/m*s", "N/m", "parentheses"),
        ("2 M Pa", "Pa", "between the unit's parts"),
        ("2 Mpa", "Pa", "MPa"),
        ("2 Pas", "Pa", "no unit here: Pa"),
        ("2 mms", "m", "no unit here"),
        ("2 ton/m^3", "kg/m^3", "no unit here"),
        ("2 a", "s", "no unit here"),
        ("2 degC", "rad", "no unit here"),
        ("2 dB", "1/s", "no unit here"),
        ("2 grad", "rad", "no unit here"),
        ("2 c", "m/s", "no unit here"),
        ("2 %", "m", "quantity in m"),
        ("2 " + "m*" * 500 + "m", "m", "quantity in m"),
        # the right dimension with the wrong meaning
        ("35", "rad", "an angle names its unit"),
        ("2 m/m", "rad", "an angle names its unit"),
        ("2 1/s", "rad/s", "names its angle"),
        ("2 Hz", "rad/s", "names its angle"),
        ("2 m/s", "rad/s", "names its angle"),
        ("2 rpm", "1/s", "no angle"),
        ("2 rad/s", "1/s", "no angle"),
        ("2 rad*m", "m", "dimension"),
    ],
)
def test_what_is_no_such_quantity_is_refused_with_what_was_expected(text, unit, words):
    begun = time.monotonic()
    with pytest.raises(Refused, match=words):
        to_si(text, unit)
    assert time.monotonic() - begun < 30.0  # a power tower would never end


@pytest.mark.parametrize(
    "text", ["0,5", "1 000", "1_0", "nan", "inf", "1e999", "1e-999", "\uff12", "0x1", "1/2", "9" * 500]
)
def test_plain_numbers_alone_are_numbers(text):
    with pytest.raises(Refused):
        plain_number(text)
    assert plain_number(" -2.5e-3 ") == -2.5e-3


def test_parameters_of_a_fit_may_be_tiny():
    assert to_si("1e-17 Pa", "Pa", tiny=True) == 1e-17


def test_the_table_of_usual_units_has_the_factors_of_pint():
    assert set(quantities._USUAL) == set(quantities.KNOWN)
    for unit, factors in quantities._USUAL.items():
        for text, factor in factors.items():
            assert quantities._factor(text, unit, "") == factor, text
