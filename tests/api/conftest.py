"""A law from outside that is known in the tests of this room only."""

import pytest

import graben
from graben.declared.laws import PARAMETERS
from graben.mechanics.materials.laws import LAWS
from tests.api.laws import VOCE, voce


@pytest.fixture(scope="session")
def voce_law():
    """The record of "voce test" and its parameters: compiled once."""
    graben.law("voce test", VOCE, ["equivalent_plastic_strain"])(voce)
    for known in (LAWS, PARAMETERS):
        del known["tests.api.laws:voce test"]
    return LAWS.pop("voce test"), PARAMETERS.pop("voce test")


@pytest.fixture
def foreign_laws(voce_law, laws_as_before):
    """The law "voce test" is known, and what a test defines is forgotten after it."""
    LAWS["voce test"], PARAMETERS["voce test"] = voce_law
