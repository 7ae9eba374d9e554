"""Trade-off: error of a number against the cost of the run that gave it, over a grid of knobs."""

from __future__ import annotations

from graben.schemas.artifact import Layout, Variable

_BOTH = ("point", "repeat")

LAYOUT = Layout(
    kind="tradeoff",
    version=1,
    title="Error of a number against what it costs",
    filled=("point", "repeat", "knob"),
    dims={"point": "a setting of the knobs", "repeat": "a seed", "knob": "a key of the scene"},
    own_attributes={"quantity": str, "reference_from": str, "command": str},
    variables={
        "knob_key": Variable(("knob",), "1", "key of the scene, or option of homogenize", dtype="U"),
        "knob_value": Variable(("point", "knob"), "1", "its value, as text", dtype="U"),
        "seed": Variable(("repeat",), "1", "seed of the runs; -1 where the scene's own is kept", dtype="i8"),
        "exit_code": Variable(_BOTH, "1", "how the run ended; 0: with a result", dtype="i4"),
        "value": Variable(_BOTH, "1", "the quantity, in the unit that its name ends with", may_be_all_nan=True),
        "cpu_time": Variable(_BOTH, "s", "CPU time of the run in a process of its own, its workers included"),
        "wall_time": Variable(_BOTH, "s", "its wall time"),
        "peak_memory": Variable(_BOTH, "byte", "its largest resident memory"),
        "error": Variable(("point",), "1", "value over the reference, minus 1", may_be_all_nan=True),
        "error_low": Variable(("point",), "1", "lower end of its 95 % interval", may_be_all_nan=True),
        "error_high": Variable(("point",), "1", "upper end of its 95 % interval", may_be_all_nan=True),
        "on_front": Variable(("point",), "1", "1: no point is both cheaper and closer", dtype="i1"),
        "reference": Variable((), "1", "what errors count from, in the unit of the quantity"),
        "reference_low": Variable((), "1", "lower end of its interval", may_be_all_nan=True),
        "reference_high": Variable((), "1", "upper end of its interval", may_be_all_nan=True),
        "order": Variable((), "1", "order of convergence, where one was found", may_be_all_nan=True),
        "recommended": Variable((), "1", "cheapest point within the error", dtype="i4", index_of="point or -1"),
        "wanted_error": Variable((), "1", "the error wanted, where one was", may_be_all_nan=True),
    },
)  # fmt: skip
