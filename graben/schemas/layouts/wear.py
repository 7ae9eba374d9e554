"""Wear: contacts, forces, grooves and wear rates of mixtures."""

from __future__ import annotations

from graben.schemas.artifact import Layout, Variable

_BOTH = ("mixture", "class")

LAYOUT = Layout(
    kind="wear",
    version=1,
    title="Wear rate of a tool by mixtures of grains",
    filled=("mixture",),
    dims={"mixture": "a mixture of grain classes", "class": "a size of grain"},
    variables={
        "mixture_name": Variable(("mixture",), "1", "name of the mixture", dtype="U"),
        "class_name": Variable(("class",), "1", "name of the grain class", dtype="U"),
        "class_diameter": Variable(("class",), "m", "diameter of the grains"),
        "share": Variable(_BOTH, "1", "volume share of the class"),
        "contacts_per_area": Variable(_BOTH, "m-2", "grains of the class that touch the tool, per area"),
        "contact_force": Variable(_BOTH, "N", "normal force per contact (0 where the class is absent)"),
        "groove_area": Variable(_BOTH, "m2", "cross-section of the groove of one grain (0 where absent)"),
        "degree_of_wear": Variable(_BOTH, "1", "part of the groove that is removed (0 where absent)"),
        "class_wear_rate": Variable(_BOTH, "m3 s-1", "volume worn per second by the class"),
        "wear_rate": Variable(("mixture",), "m3 s-1", "volume worn per second"),
        "carried_load": Variable(("mixture",), "N", "contacts times force per contact"),
        "applied_load": Variable((), "N", "load applied to the machine"),
        "sliding_speed": Variable((), "m s-1", "speed of the grains along the tool"),
        "contact_area": Variable((), "m2", "area of the tool in contact with grains"),
    },
)
