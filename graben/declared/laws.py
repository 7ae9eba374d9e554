"""Parameters of every constitutive law: unit, bounds, default, meaning.

Scenes, files, calibrations, Python and the compiled laws all read them here. The order within a law is that of the
slots of its packed array, and the order of choices is that of the numbers by which compiled code knows them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib import import_module

from graben.declared.parameter import Parameter
from graben.errors import Refused

_YOUNG = Parameter(
    "young_modulus", "Pa", 1e-3, 1e16, None, "Young's modulus", "1 to 100 GPa for rock, less when jointed"
)
# nu = 0.5 has no bulk modulus; negative values are computed but say so little about rock that they need intent
_POISSON = Parameter("poisson_ratio", "1", -0.99, 0.49999, None, "Poisson's ratio", "0.1 to 0.4")

_ROWS = "table of (equivalent plastic strain, yield stress in Pa), linear between, constant beyond"
_LINEAR, _EXPONENTIAL, _BARCELONA, _TABLE = (
    ("hardening", word) for word in ("linear", "exponential", "barcelona", "table")
)
# a strength of zero would leave the direction of flow without meaning
_METAL = (
    Parameter(
        "hardening", "1", default="table", choices=("table", "linear", "exponential"),
        description="form of the hardening curve",
    ),
    Parameter(
        "initial_yield", "Pa", 1e-9, 1e15, None, "s0, yield stress of the virgin material", "50 to 1000 MPa",
        when=("hardening", "linear|exponential"),
    ),
    Parameter("hardening_modulus", "Pa", 0.0, 1e15, None, "H, slope", "0 to 0.05 E", when=_LINEAR),
    Parameter("hardening_gain", "Pa", 0.0, 1e15, None, "Q", "0 to 2 s0", when=_EXPONENTIAL),
    Parameter("hardening_rate", "1", 0.0, 1e9, None, "b", "1 to 100", when=_EXPONENTIAL),
    Parameter("hardening_table", "Pa", description=_ROWS, table=True, when=_TABLE),
)  # fmt: skip

_DUCTILE = ("damage", "ductile")

PARAMETERS: dict[str, tuple[Parameter, ...]] = {
    "elastic": (_YOUNG, _POISSON),
    "transverse-elastic": (
        Parameter(
            "young_modulus", "Pa", 1e-3, 1e16, None, "E, in the plane of isotropy (along the layers)", "1 to 100 GPa"
        ),
        Parameter("young_modulus_across", "Pa", 1e-3, 1e16, None, "E', along the axis of symmetry", "0.3 to 1 of E"),
        Parameter("poisson_ratio", "1", -0.99, 0.99, None, "nu, within the plane of isotropy", "0.1 to 0.4"),
        Parameter(
            "poisson_ratio_across", "1", -2.0, 2.0, None,
            "nu', contraction along the layers per extension across them", "0.05 to 0.3",
        ),
        Parameter(
            "shear_modulus_across", "Pa", 1e-3, 1e16, None, "G', in planes that hold the axis", "0.2 to 0.5 of E'"
        ),
        Parameter("axis_angle", "rad", -7.0, 7.0, 0.0, "angle from x to the axis of symmetry, counter-clockwise"),
    ),
    "j2": (_YOUNG, _POISSON, *_METAL),
    "mohr-coulomb": (
        _YOUNG,
        _POISSON,
        Parameter("friction_angle", "rad", 0.0, math.radians(80.0), None, "phi", "25 to 55 deg"),
        Parameter("dilation_angle", "rad", 0.0, math.radians(80.0), 0.0, "psi, at most phi", "0 to 15 deg"),
        Parameter("cohesion", "Pa", 0.0, 1e16, None, "c", "0 to 60 MPa"),
        Parameter(
            "tensile_strength", "Pa", 0.0, 1e16, 0.0, "T of the cut-off; the apex of the cone limits it",
            "0 to 12 MPa",
        ),
    ),
    "drucker-prager": (  # Y table 2.1
        _YOUNG,
        _POISSON,
        Parameter(
            "friction_angle", "rad", 0.0, math.radians(71.0), None,
            "slope of the yield surface in the p-t plane (not Mohr-Coulomb's angle)",
            "45 to 60 deg for jointed rock",
        ),
        Parameter(
            "dilation_angle", "rad", 0.0, math.radians(71.0), 0.0,
            "slope of the flow potential in the p-t plane, at most the friction angle", "5 to 40 deg",
        ),
        Parameter(
            "flow_stress_ratio", "1", 7.0 / 9.0, 1.0, 1.0,
            "K, strength in triaxial extension over compression; convex from 7/9", "0.78 to 1",
        ),
        Parameter(
            "hardening", "1", default="exponential", choices=("exponential", "barcelona", "linear", "table"),
            description="form of the hardening curve",
        ),
        Parameter(
            "initial_yield", "Pa", 0.0, 1e16, 0.0, "uniaxial compressive yield stress at no plastic strain",
            "1 kPa to 10 MPa",
        ),
        Parameter(
            "hardening_gain", "Pa", 0.0, 1e16, None, "Q: how far the yield stress rises in all", "0.5 to 10 MPa",
            when=_EXPONENTIAL,
        ),
        Parameter(
            "hardening_rate", "1", 0.0, 1e9, None, "b: rate of the rise per plastic strain", "10 to 1000",
            when=_EXPONENTIAL,
        ),
        Parameter(
            "peak_yield", "Pa", 0.0, 1e16, None, "yield stress at the peak of the Barcelona curve", "0.5 to 5 MPa",
            when=_BARCELONA,
        ),
        Parameter(
            "strain_at_peak", "1", 1e-9, 1e3, None, "plastic strain at that peak", "0.5 to 5 %", when=_BARCELONA
        ),
        Parameter("hardening_modulus", "Pa", -1e16, 1e16, 0.0, "slope of the linear hardening curve", when=_LINEAR),
        Parameter("damage", "1", default="none", choices=("none", "ductile"), description="ductile damage off or on"),
        Parameter(
            "initiation_strain_050", "1", 1e-12, 1e6, None, "plastic strain at damage initiation, triaxiality -0.5",
            "0.01 to 5 %", when=_DUCTILE,
        ),
        Parameter(
            "initiation_strain_060", "1", 1e-12, 1e6, None, "plastic strain at damage initiation, triaxiality -0.6",
            "0.1 to 20 %", when=_DUCTILE,
        ),
        Parameter(
            "failure_displacement", "m", 1e-12, 1e9, None, "plastic displacement from initiation to D = 1",
            "0.01 to 5 m", when=_DUCTILE,
        ),
        Parameter(
            "max_damage", "1", 0.0, 0.999999, 0.99, "damage stops here, so that a stiffness remains", when=_DUCTILE
        ),
        Parameter(
            "hardening_table", "Pa", table=True, description="rows (plastic strain, yield stress)", when=_TABLE
        ),
    ),
    "lubliner": (
        _YOUNG,
        _POISSON,
        Parameter("dilation_angle", "rad", 1e-3, 1.3, None, "psi in the p-q plane", "5 to 40 deg"),
        Parameter("flow_eccentricity", "1", 1e-4, 10.0, 0.1, "how fast G nears its asymptote", "0.05 to 0.5"),
        Parameter("stress_invariant_ratio", "1", 0.501, 1.0, 2.0 / 3.0, "Kc", "0.51 to 1"),
        Parameter("biaxial_ratio", "1", 1.0, 3.0, 1.16, "f0, biaxial over uniaxial compressive yield", "1.05 to 1.3"),
        Parameter("initial_yield", "Pa", 1e-9, 1e16, None, "compressive yield stress at no inelastic strain"),
        Parameter("peak_yield", "Pa", 1e-9, 1e16, None, "compressive strength"),
        Parameter("strain_at_peak", "1", 1e-9, 10.0, None, "inelastic strain there", "0.1 to 5 %"),
        Parameter("compressive_damage", "1", 0.0, 0.99, 0.5, "d_c: damage rate over its limit", "0.4 to 0.95"),
        Parameter("tensile_yield", "Pa", 1e-9, 1e16, None, "tensile strength"),
        Parameter("tensile_decay", "1", 0.0, 1e9, 1000.0, "lambda: decay of the tensile stress per cracking strain"),
        Parameter("tensile_damage", "1", 0.0, 0.99, 0.5, "d_t: damage rate over its limit", "0.4 to 0.95"),
        Parameter("tension_recovery", "1", 0.0, 1.0, 0.0, "w_t: stiffness regained in tension after crushing"),
        Parameter("compression_recovery", "1", 0.0, 1.0, 1.0, "w_c: stiffness regained as cracks close"),
        Parameter("largest_inelastic_strain", "1", 1e-6, 10.0, 0.1, "compressive strains up to here are met"),
        Parameter("largest_cracking_strain", "1", 1e-6, 10.0, 0.1, "cracking strains up to here are met"),
        Parameter("max_damage", "1", 0.0, 0.999999, 0.99, "damage stops here, so that a stiffness remains"),
        Parameter(
            "crack_strain", "1", default="current", choices=("current", "printed"),
            description="stress by which crack strain becomes plastic strain: of the moment, or the first yield (Y)",
        ),
    ),
    "erve": (
        _YOUNG,
        _POISSON,
        Parameter(
            "damage_threshold", "Pa", 0.0, 1e12, None,
            "r_d of H (6.83): damage starts where twice the driving energy density exceeds it",
            "H prints 0.1 MPa, which starts damage at 145 MPa uniaxial in steel, far below yield",
        ),
        Parameter("subdomains", "1", 1, 1000, 20, "number n of subdomains of equal volume"),
        Parameter(
            "max_damage_step", "1", 0.0, 1.0, 0.001,
            "largest growth of a subdomain's damage in one increment; a stage that limits damage by external "
            "work, H (6.98), writes it before each increment",
        ),
        Parameter(
            "split", "1", default="none", choices=("none", "volumetric", "positive-principal"),
            description="part of the elastic energy that drives damage, and of the stress that it takes away",
        ),
        Parameter("hardening", "Pa", description=_ROWS, table=True),
    ),
    "energy-damage": (
        _YOUNG,
        _POISSON,
        Parameter(
            "damage_threshold", "Pa", 0.0, 1e15, None,
            "r_d: damage starts where the driving energy density exceeds it", "0.01 to 10 MPa",
        ),
        Parameter(
            "split", "1", default="tension", choices=("none", "tension"),
            description="what drives damage: all elastic energy, or that of the positive principal strains",
        ),
        Parameter("max_damage", "1", 0.0, 0.9999, 0.999, "a stiffness remains", "0.9 to 0.999"),
        *_METAL,
    ),
}  # fmt: skip
"""law -> its parameters; `declare` adds laws from outside."""

_OURS = frozenset(PARAMETERS)


def declare(law: str, parameters: Sequence[Parameter]) -> None:
    """Add the parameters of a law from outside, in this process; Refused for the name of a law of the package."""
    if law in _OURS:
        raise Refused(f"another name: {law!r} is a law of the package")
    PARAMETERS[law] = tuple(parameters)


def parameters_of(law: str) -> tuple[Parameter, ...]:
    """The parameters of the law of that name; Refused says which there are.

    For "module:law" that module is imported first, whose `graben.law` declares it: so every process finds it.
    """
    if law not in PARAMETERS and ":" in law:
        try:
            import_module(law.partition(":")[0])
        except Exception as error:  # whatever a user's module raises
            raise Refused(f"a law of a module that can be imported ({error})") from error
    if law not in PARAMETERS:
        raise Refused(f"one of {', '.join(PARAMETERS)}, or module:law for a law of one's own")
    return PARAMETERS[law]


def parameter(law: str, name: str) -> Parameter | None:
    """The parameter of that name; None where the law, or the parameter, is unknown."""
    return next((p for p in PARAMETERS.get(law, ()) if p.name == name), None)
