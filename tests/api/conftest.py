"""Laws from outside are known in the tests of this room only."""

import pytest

import graben
from graben.mechanics.materials.laws import LAWS
from graben.schemas.scenes.material import UNITS
from tests.api.laws import VOCE, voce


@pytest.fixture(scope="session")
def voce_law():
    """The record of "voce test" and its units: compiled once."""
    graben.law("voce test", VOCE, ["equivalent_plastic_strain"])(voce)
    return LAWS.pop("voce test"), UNITS.pop("voce test")


@pytest.fixture
def foreign_laws(voce_law):
    """ "voce test" is known, and what a test defines is forgotten after it."""
    before, units = dict(LAWS), dict(UNITS)
    LAWS["voce test"], UNITS["voce test"] = voce_law
    yield
    for known, former in ((LAWS, before), (UNITS, units)):
        known.clear()
        known.update(former)
