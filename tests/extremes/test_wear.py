"""Wear rates at the edges: one class and a thousand, forces next to nothing, loads that would bury the grains."""

import json

import pytest

from tests.conftest import command

GROOVE = '[{force = "2 N", area = "88.4 um^2", degree_of_wear = 0.37}]'


def rated(folder, text):
    (folder / "wear.toml").write_text('kind = "wear"\n' + text)
    return command("wear-estimate", folder / "wear.toml", "-o", folder / "wear.nc", "--overwrite", "--json", "-q")


def rate(folder, text):
    result = rated(folder, text)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)["mixtures"][0]


def one(load="130 N", diameter="100 um", groove=GROOVE, mode="balanced"):
    return (
        f'[machine]\napplied_load = "{load}"\n[load]\nmode = "{mode}"\n[[grains]]\nname = "a"\n'
        f'diameter = "{diameter}"\ngrooves = {groove}\n[[mixtures]]\nname = "m"\nshares = {{a = 1.0}}\n'
    )


def test_one_class_by_hand(tmp_path):
    """0.98 / D2 contacts per m2, each with A p / N; the groove by the 3/2 power; N A f Ag v."""
    found = rate(tmp_path, one())
    area, speed = 114.3e-6, 200 * 2 * 3.141592653589793 / 60 * 0.5 * 0.2285
    contacts = 0.98 / 1e-4**2 * area
    groove = 88.4e-12 * (130.0 / contacts / 2.0) ** 1.5
    assert found["wear_rate_m3_per_s"] == pytest.approx(contacts * 0.37 * groove * speed, rel=1e-9)


@pytest.mark.parametrize("load", ["1e-15 N", "1 N"])
def test_a_load_next_to_nothing_wears_by_its_3_2_power(tmp_path, load):
    one_newton = rate(tmp_path, one("1 N"))["wear_rate_m3_per_s"]
    expected = one_newton * float(load.split()[0]) ** 1.5
    assert rate(tmp_path, one(load))["wear_rate_m3_per_s"] == pytest.approx(expected, rel=1e-9)


def test_a_force_of_zero_is_refused_with_one_fault(tmp_path):
    result = rated(tmp_path, one(groove=GROOVE.replace("2 N", "0 N")))
    assert result.exit_code == 2
    assert result.stderr.count("expected") == 1 and "force = 0.0: expected greater than 0" in result.stderr


@pytest.mark.parametrize("text", [
    one("1e15 N"), one(groove=GROOVE.replace("88.4 um^2", "88.4 mm^2"), mode="given"),
    one(groove=GROOVE.replace("2 N", "1e-12 N")),
], ids=["load", "groove", "force"])  # fmt: skip
def test_grooves_that_would_bury_their_grain_are_refused(tmp_path, text):
    """A ball that is half sunk leaves half of its section; a rate beyond says nothing."""
    result = rated(tmp_path, text)
    assert result.exit_code == 2 and "would bury it" in result.stderr


def test_a_thousand_classes_of_which_two_have_a_share(tmp_path):
    """The others count for nothing, and more than two have no law of contacts."""
    grains = "".join(
        f'[[grains]]\nname = "g{k}"\ndiameter = "{100 + 0.1 * k} um"\ngrooves = {GROOVE}\n' for k in range(1000)
    )
    found = rate(tmp_path, grains + '[[mixtures]]\nname = "m"\nshares = {g0 = 0.5, g999 = 0.5}\n')
    rates = found["class_wear_rate_m3_per_s"]
    assert len(rates) == 1000 and sum(v > 0.0 for v in rates.values()) == 2
    assert found["carried_load_n"] == pytest.approx(130.0)
    shares = ", ".join(f"g{k} = 0.001" for k in range(1000))
    result = rated(tmp_path, grains + f'[[mixtures]]\nname = "m"\nshares = {{{shares}}}\n')
    assert result.exit_code == 2 and "found 1000 classes" in result.stderr


@pytest.mark.parametrize("scale", [1e-6, 1e3])
def test_lengths_scale(tmp_path, scale):
    """All lengths by s at one stress (forces by s2): contacts stay, grooves and speed give s3."""

    def scene(s):
        return (
            f'[machine]\nwheel_diameter = "{0.2285 * s!r} m"\ncontact_area = "{114.3e-6 * s * s!r} m^2"\n'
            f'applied_load = "{130 * s * s!r} N"\n[[grains]]\nname = "a"\ndiameter = "{1e-4 * s!r} m"\n'
            f'grooves = [{{force = "{2 * s * s!r} N", area = "{88.4e-12 * s * s!r} m^2", degree_of_wear = 0.37}}]\n'
            '[[mixtures]]\nname = "m"\nshares = {a = 1.0}\n'
        )

    once, scaled = (rate(tmp_path, scene(s))["wear_rate_m3_per_s"] for s in (1.0, scale))
    assert scaled == pytest.approx(scale**3 * once, rel=1e-9)
