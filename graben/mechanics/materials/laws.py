"""The registry of constitutive laws and the one compiled entry point that drivers and elements call.

    par = pack("drucker-prager", {"young_modulus": 1.8e9, ...})
    state = LAWS["drucker-prager"].initial_state(par)
    code = update(LAWS["drucker-prager"].id, deps, sig, state, par, length, tangent)

Contract of `update` and of every law's own `update_<name>(deps, sig, state, par, length, tangent)`:

- deps (n,) strain increment with engineering shears; n is 4 (plane strain, axisymmetric: xx, yy, zz, xy) or 6
  (xx, yy, zz, xy, yz, zx); sig (n,) nominal stress in Pa, tension positive; state (m,); both changed in place.
- par (k,) from `pack`; length: the element's characteristic length in m.
- tangent (n, n) gets d sig / d deps of this very increment; with shape (0, 0) it is not computed.
- returns 0, or a code of `law.py` above 0; then sig and state are as they were.

To add a law: declare its parameters in `declared/laws.py`, write `<name>.py` with `update_<name>` and a `Law` record
with a free id (below), import both here, add the record to `_RECORDS` and a branch to `update` (and to `prepare`, if
the law has derived values). State index 0 is the equivalent plastic strain, index 1 the damage, where they exist.

ids: 0 elastic, 1 j2, 2 mohr-coulomb, 3 drucker-prager, 4 lubliner, 5 erve, 6 transverse-elastic,
7 energy-damage. Laws that `register` adds at run time have ids from 256 on, or below -255; see `foreign.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.declared.laws import declare, parameters_of
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.drucker_prager import (
    DRUCKER_PRAGER,
    prepare_drucker_prager,
    update_drucker_prager,
)
from graben.mechanics.materials.elastic import ELASTIC, update_elastic
from graben.mechanics.materials.energy_damage import ENERGY_DAMAGE, update_energy_damage
from graben.mechanics.materials.erve import ERVE, update_erve
from graben.mechanics.materials.foreign import FIRST, update_foreign
from graben.mechanics.materials.j2 import J2, update_j2
from graben.mechanics.materials.law import UNKNOWN_LAW, Law
from graben.mechanics.materials.lubliner import LUBLINER, prepare_lubliner, update_lubliner
from graben.mechanics.materials.mohr_coulomb import MOHR_COULOMB, prepare_mohr_coulomb, update_mohr_coulomb
from graben.mechanics.materials.transverse import TRANSVERSE, prepare_transverse, update_transverse

_RECORDS: tuple[Law, ...] = (
    ELASTIC,
    TRANSVERSE,
    J2,
    MOHR_COULOMB,
    DRUCKER_PRAGER,
    LUBLINER,
    ERVE,
    ENERGY_DAMAGE,
)

LAWS: dict[str, Law] = {record.name: record for record in _RECORDS}


@kernel(error_model="numpy")
def update(law_id, deps, sig, state, par, length, tangent):
    """Advance one material point by a strain increment under the law of that id; see the module's contract."""
    if law_id == 3:
        return update_drucker_prager(deps, sig, state, par, length, tangent)
    if law_id == 1:
        return update_j2(deps, sig, state, par, length, tangent)
    if law_id == 2:
        return update_mohr_coulomb(deps, sig, state, par, length, tangent)
    if law_id == 4:
        return update_lubliner(deps, sig, state, par, length, tangent)
    if law_id == 5:
        return update_erve(deps, sig, state, par, length, tangent)
    if law_id == 0:
        return update_elastic(deps, sig, state, par, length, tangent)
    if law_id == 6:
        return update_transverse(deps, sig, state, par, length, tangent)
    if law_id == 7:
        return update_energy_damage(deps, sig, state, par, length, tangent)
    if abs(law_id) >= FIRST:
        return update_foreign(abs(law_id), deps, sig, state, par, length, tangent)
    return UNKNOWN_LAW


@kernel(error_model="numpy")
def prepare(law_id, par):
    """Fill the derived slots of par after its parameters changed (a search changes them in compiled code)."""
    if law_id == 3:
        prepare_drucker_prager(par)
    elif law_id == 2:
        prepare_mohr_coulomb(par)
    elif law_id == 4:
        prepare_lubliner(par)
    elif law_id == 6:
        prepare_transverse(par)


@kernel(error_model="numpy")
def isotropic(law_id):
    """Whether the law of that id knows no direction; one that does is named here."""
    return law_id >= 0 and law_id != 6


def register(record: Law, module: str) -> None:
    """Make a law from outside known in this process, by its name and as "module:name"; an earlier one is replaced.

    Refused for the name of a law of the package.
    """
    for name in (record.name, f"{module}:{record.name}"):
        declare(name, record.parameters)
        LAWS[name] = record


def find(name: str) -> Law:
    """The law of that name, or of "module:law"; Refused lists the known ones."""
    parameters_of(name)
    return LAWS[name]


def pack(name: str, values: Mapping[str, Any]) -> NDArray[np.float64]:
    """Named parameters in SI -> par of the law of that name; Refused lists every fault."""
    return find(name).pack(values)
