"""Parameters of the extended Drucker-Prager law with ductile damage, Y table 2.1, in the order of its
`par`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from graben.mechanics.materials.elastic import POISSON, YOUNG
from graben.mechanics.materials.hardening import CHOICES
from graben.mechanics.materials.law import Parameter

# slots of par, in the order of PARAMETERS; then the derived values; then the table
E, NU, BETA, PSI, K, KIND, SIGMA0, GAIN, RATE, PEAK, EPEAK, SLOPE, DAMAGE, E50, E60, UF, DMAX = range(17)
TAN_BETA, TAN_PSI, HARD_A, HARD_B, LOG_D2, D3, TABLE = range(17, 24)


def check(values: Mapping[str, Any]) -> list[str]:
    found = []
    if values.get("dilation_angle", 0.0) > values["friction_angle"]:
        found.append("dilation_angle at most friction_angle, otherwise flow under pressure yields work")
    barcelona = values.get("hardening", "exponential") == "barcelona"
    if barcelona and values["peak_yield"] < values.get("initial_yield", 0.0):
        found.append("peak_yield at least initial_yield")
    if values.get("hardening") == "table" and np.any(np.asarray(values["hardening_table"])[:, 1] < 0.0):
        found.append("hardening_table without negative stresses")
    return found


PARAMETERS = (
    YOUNG,
    Parameter("poisson_ratio", "1", -0.99, POISSON.upper, None, POISSON.description, POISSON.usual),
    Parameter(
        "friction_angle",
        "rad",
        0.0,
        math.radians(71.0),
        None,
        "slope of the yield surface in the p-t plane (not Mohr-Coulomb's angle)",
        "45 to 60 deg for jointed rock",
    ),
    Parameter(
        "dilation_angle",
        "rad",
        0.0,
        math.radians(71.0),
        0.0,
        "slope of the flow potential in the p-t plane, at most the friction angle",
        "5 to 40 deg",
    ),
    Parameter(
        "flow_stress_ratio",
        "1",
        7.0 / 9.0,
        1.0,
        1.0,
        "K, strength in triaxial extension over compression; convex from 7/9",
        "0.78 to 1",
    ),
    Parameter("hardening", "1", default="exponential", choices=CHOICES, description="form of the hardening curve"),
    Parameter(
        "initial_yield",
        "Pa",
        0.0,
        1e16,
        0.0,
        "uniaxial compressive yield stress at no plastic strain",
        "1 kPa to 10 MPa",
    ),
    Parameter(
        "hardening_gain",
        "Pa",
        0.0,
        1e16,
        None,
        "Q: how far the yield stress rises in all",
        "0.5 to 10 MPa",
        when=("hardening", "exponential"),
    ),
    Parameter(
        "hardening_rate",
        "1",
        0.0,
        1e9,
        None,
        "b: rate of the rise per plastic strain",
        "10 to 1000",
        when=("hardening", "exponential"),
    ),
    Parameter(
        "peak_yield",
        "Pa",
        0.0,
        1e16,
        None,
        "yield stress at the peak of the Barcelona curve",
        "0.5 to 5 MPa",
        when=("hardening", "barcelona"),
    ),
    Parameter(
        "strain_at_peak",
        "1",
        1e-9,
        1e3,
        None,
        "plastic strain at that peak",
        "0.5 to 5 %",
        when=("hardening", "barcelona"),
    ),
    Parameter(
        "hardening_modulus",
        "Pa",
        -1e16,
        1e16,
        0.0,
        "slope of the linear hardening curve",
        when=("hardening", "linear"),
    ),
    Parameter("damage", "1", default="none", choices=("none", "ductile"), description="ductile damage off or on"),
    Parameter(
        "initiation_strain_050",
        "1",
        1e-12,
        1e6,
        None,
        "plastic strain at damage initiation, triaxiality -0.5",
        "0.01 to 5 %",
        when=("damage", "ductile"),
    ),
    Parameter(
        "initiation_strain_060",
        "1",
        1e-12,
        1e6,
        None,
        "plastic strain at damage initiation, triaxiality -0.6",
        "0.1 to 20 %",
        when=("damage", "ductile"),
    ),
    Parameter(
        "failure_displacement",
        "m",
        1e-12,
        1e9,
        None,
        "plastic displacement from initiation to D = 1",
        "0.01 to 5 m",
        when=("damage", "ductile"),
    ),
    Parameter(
        "max_damage",
        "1",
        0.0,
        0.999999,
        0.99,
        "damage stops here, so that a stiffness remains",
        when=("damage", "ductile"),
    ),
    Parameter(
        "hardening_table",
        "1, Pa",
        default=None,
        table=True,
        description="rows (plastic strain, yield stress)",
        when=("hardening", "table"),
    ),
)
