"""Keys that scenes once had, and what to write now: a scene that still has one is refused with that advice.

When a key goes or gets another name, its old name goes here.
"""

from __future__ import annotations

from collections.abc import Sequence

OLD_KEYS: dict[str, dict[str, str]] = {
    "blocks": {
        "programme.calm": "no longer a key: loads rise as if a stiff frame held them, see programme.frame and "
        "programme.bracket; slower loads take more numerics.steps",
        "programme.patience": "no longer a key: a rise ends at failure, in rest, or after eight times numerics.steps",
    },
}
"""By kind of scene and by dotted key, without the numbers of entries in lists."""


def advice_on(kind: str, where: Sequence[str | int]) -> str:
    """What a key that does not exist should be; where : names of tables and the key, numbers of entries between."""
    name = ".".join(str(part) for part in where if not isinstance(part, int))
    return OLD_KEYS.get(kind, {}).get(name, "no such key (see `graben scene KIND` for those that exist)")
