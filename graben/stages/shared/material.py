"""From a scene's material to the packed parameters of a law: the last check, by the law's own bounds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.materials.law import Law
from graben.mechanics.materials.laws import LAWS, find
from graben.schemas.scenes.material import MaterialTable, read_material


def find_law(law: str, file: str | Path = "") -> Law:
    """The record of a law by its name; BadInput, in words of that file, where this process knows none."""
    try:
        return find(law)
    except Refused as error:
        raise BadInput(Fault(str(file), "law", repr(law), str(error))) from error


def names_of(ids: Iterable[int]) -> list[str]:
    """Names of laws by their ids, as kernels take them."""
    names = {law.id: name for name, law in LAWS.items()}
    return [names[number] for number in map(int, ids)]


def pack_values(
    law: str, values: Mapping[str, Any], file: str | Path, prefix: str = "parameters."
) -> tuple[Law, NDArray[np.float64]]:
    """The law's record and its packed parameters; BadInput that names file and key for every fault."""
    record = find_law(law, file)
    faults = [
        Fault(str(file), prefix + name, repr(values[name]) if name in values else "", text)
        for name, text in record.faults(values)
    ]
    if faults:
        raise BadInput(faults)
    return record, record.pack(values)


def pack_material(
    material: MaterialTable | str | Path, file: str | Path
) -> tuple[Law, NDArray[np.float64], dict[str, Any]]:
    """Record, packed parameters and values in SI of a scene's material table, or of a material file.

    file: the scene that holds the table, named in faults.
    """
    if isinstance(material, MaterialTable):
        law, values = material.resolve()
        where: str | Path = material.file or file
        prefix = "parameters." if material.file else "material.parameters."
    else:
        law, values = read_material(material)
        where, prefix = material, "parameters."
    record, par = pack_values(law, values, where, prefix)
    return record, par, values
