"""Damage to texts, bytes and maps: small changes of what was sound, as people, disks and programs make them."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path
from typing import Any

import numpy as np

NUMBERS = ["0", "-1", "1e-300", "-1e-300", "5e-324", "1e300", "1e400", "inf", "-inf", "nan", "2147483648", "9" * 400,
           "1", "3", "0.5", "true", "-0.0", "18446744073709551616", "1e-12", "1e12", "100000000"]  # fmt: skip
SPELLINGS = [
    "1,5",
    "1 500",
    "1.500,0",
    "1'000",
    "9**9**9",
    "1/0",
    "0x10",
    "१",
    "1_0",
    "−3",
    "1e",
    "--1",
    "1+1",
    "(1",
    "1 1",
]
UNITS = [
    "m", "mm", "MPa", "GPa", "Pa/m", "deg", "rad", "kg/m^3", "s", "N", "m/s", "1/s", "Hz", "rpm", "degC", "m m",
    "m^9^9", "", "quux", "dB", "%", "N m", "J", "Pa/m^2", "m²", "µm", "m; import os", "__class__",
]  # fmt: skip
VALUES = [
    '""', "[]", "{}", '"x"', "[[]]", "[1, 2]", "[[1, 2], [3]]", "{ a = 1 }", "1979-05-27", '"\\u0000"', '"/dev/zero"',
    '"."', '"../../etc/passwd"', "[" * 40 + "]" * 40, '"' + "y" * 3000 + '"',
]  # fmt: skip


_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def another_value(rng: random.Random, old: str) -> str:
    chance, number = rng.random(), _NUMBER.search(old)
    if number and chance < 0.4:  # of the same kind, another size
        times = 10 ** rng.uniform(-1, 1) if rng.random() < 0.7 else 10 ** rng.uniform(-4, 4)
        size = float(number[0]) * times
        whole = number[0].isdigit() and rng.random() < 0.8
        return old[: number.start()] + (str(round(size)) if whole else f"{size:.4g}") + old[number.end() :]
    if chance < 0.55:
        return rng.choice(NUMBERS)
    if chance < 0.85:
        number = rng.choice([*NUMBERS, *SPELLINGS, f"{rng.uniform(-5, 50):.3g}", f"{10 ** rng.uniform(-12, 12):.3g}"])
        unit = rng.choice(UNITS) if rng.random() < 0.4 or '"' not in old else old.strip('"').partition(" ")[2]
        return json.dumps(f"{number} {unit}", ensure_ascii=False)
    return rng.choice(VALUES)


def damaged_text(rng: random.Random, text: str) -> str:
    """One to three changes of a TOML text: a value, a line dropped, doubled or moved, a character."""
    lines = text.splitlines()
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        k = rng.randrange(len(lines))
        keys = [i for i, line in enumerate(lines) if "=" in line and not line.lstrip().startswith("#")]
        chance = rng.random()
        if chance < 0.7 and keys:
            k = rng.choice(keys)
            name, _, old = lines[k].partition("=")
            lines[k] = f"{name}= {another_value(rng, old.strip())}"
        elif chance < 0.8:
            del lines[k]
        elif chance < 0.87:
            lines.insert(rng.randrange(len(lines)), lines[k])
        elif chance < 0.93 and lines[k]:
            at = rng.randrange(len(lines[k]))
            lines[k] = (
                lines[k][:at]
                + chr(rng.choice([0, 9, 34, 91, 92, 123, 233, 0x4E00, rng.randrange(32, 127)]))
                + lines[k][at:]
            )
        else:
            name = rng.choice(["seed", "extra", "loads", "[domain", "[[supports]]", "a.b.c"])
            lines.insert(k, f"{name} = {rng.choice(NUMBERS)}")
        if not lines:
            return ""
    return "\n".join(lines) + "\n"


def damaged_bytes(rng: random.Random, data: bytes) -> bytes:
    """Cut short, a few bytes changed, a piece overwritten, dropped or repeated."""
    chance, size = rng.random(), len(data)
    if chance < 0.2:
        return data[: rng.randrange(size)]
    out = bytearray(data)
    if chance < 0.7:
        for _ in range(rng.choice([1, 1, 2, 8])):
            out[rng.randrange(size)] = rng.randrange(256)
    else:
        at, long = rng.randrange(size), rng.choice([1, 8, 64, 1000])
        if chance < 0.8:
            out[at : at + long] = bytes(len(out[at : at + long]))
        elif chance < 0.9:
            del out[at : at + long]
        else:
            out[at:at] = out[at : at + long]
    return bytes(out)


def damaged_array(rng: random.Random, array: np.ndarray) -> np.ndarray:
    """One number changed, another length, other dims or another kind of number."""
    chance, out = rng.random(), np.array(array)
    if chance < 0.55 and out.size and out.dtype.kind in "fiu":
        odd = [0, -1, 1, 3, 127] + ([np.nan, np.inf, 1e300, -1e-300] if out.dtype.kind == "f" else [])
        at = rng.randrange(out.size) if rng.random() < 0.7 else slice(None)
        out.reshape(-1)[at] = np.asarray(rng.choice(odd)).astype(out.dtype)
        return out
    if chance < 0.8 and out.ndim and len(out):
        return rng.choice([out[:-1], np.concatenate([out, out[-1:]]), out[:0], out[::-1]])
    others = [out.reshape(-1), out[None], out.astype("U8"), np.array(0.0)]
    return rng.choice([*others, out.astype("f4")] if out.dtype.kind in "fiu" else others)


def damage_dataset(rng: random.Random, source: Path, target: Path) -> None:
    """An artifact that another program edited: a variable or attribute is changed, and there is no digest."""
    import xarray

    with xarray.open_dataset(source, engine="netcdf4", decode_times=False) as opened:
        data = opened.load()
    del data.attrs["content_sha256"]
    for _ in range(rng.choice([1, 1, 2])):
        chance, name = rng.random(), rng.choice(sorted(data.variables))
        old = data[name]
        if chance < 0.5:
            values = damaged_array(rng, old.values)
            dims = old.dims if values.shape == old.shape else [f"{name}_{k}" for k in range(values.ndim)]
            if not (values.ndim == 0 and name in data.dims):  # which NetCDF can hold, but xarray cannot
                data = data.drop_vars(name).assign({name: (dims, values, old.attrs)})
        elif chance < 0.6:
            data = data.drop_vars(name)
        elif chance < 0.7 and old.ndim:
            data = data.isel({old.dims[0]: slice(0, rng.choice([0, 1, len(old) - 1]))})
        elif chance < 0.75:
            data[name].attrs["units"] = rng.choice(["m", "", 3.0, "furlong"])
        else:
            name = rng.choice(sorted(data.attrs))
            odd = ["", "x", "{}", "[1]", "kind = ", -1, 3.5, 2**40, np.array([1, 2]), "y" * 5000, "null"]
            data.attrs[name] = rng.choice(odd)
            if rng.random() < 0.2:
                del data.attrs[name]
    for variable in data.variables.values():
        variable.encoding = {}
    data.to_netcdf(target, engine="netcdf4")


def damage_saved(rng: random.Random, path: Path) -> None:
    """A checkpoint or state whose digest is that of its damaged arrays."""
    from graben.schemas.saved import write_saved

    with np.load(path) as data:
        arrays = {name: data[name] for name in data.files if name != "sha256"}
    for _ in range(rng.choice([1, 1, 2])):
        name = rng.choice(sorted(arrays))
        if rng.random() < 0.1:
            del arrays[name]
        else:
            arrays[name] = damaged_array(rng, arrays[name])
    write_saved(path, {}, arrays)


def damage_map(rng: random.Random, tree: Any) -> None:
    feature = rng.choice(tree["features"])
    geometry = feature.get("geometry")
    rings = geometry.get("coordinates") if isinstance(geometry, dict) else None
    ring = rings[0] if isinstance(rings, list) and rings else []
    other = rng.choice([None, [], {}, "x", 1e300, [[]], [["a", "b"]], True, [1e9, 1e9], [None, 0.0]])
    chance = rng.random()
    if chance < 0.5 and isinstance(ring, list) and len(ring) > 1:
        k, by = rng.randrange(len(ring)), rng.choice([1e-9, 1e-4, 1e-2, 0.3, 5.0])
        match rng.randrange(5):
            case 0 if isinstance(ring[k], list) and len(ring[k]) == 2 and all(isinstance(v, float) for v in ring[k]):
                ring[k] = [ring[k][0] + rng.uniform(-by, by), ring[k][1] + rng.uniform(-by, by)]
            case 1:
                ring.insert(k, ring[k])
            case 2:
                del ring[k]
            case 3:
                ring.reverse()
            case _:
                ring[k] = other
    elif chance < 0.6:
        tree["features"].append(json.loads(json.dumps(feature)))
    elif chance < 0.7:
        tree["features"].remove(feature) if len(tree["features"]) > 1 else None
    elif chance < 0.85:
        feature["geometry"] = other
    else:
        (geometry if isinstance(geometry, dict) else feature)[rng.choice(["type", "coordinates", "properties"])] = (
            other
        )
