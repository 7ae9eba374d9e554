"""fem: states of a plane-strain body of 4-node quads (UGRID), its load history and its surface."""

from __future__ import annotations

from graben.schemas.artifact import Layout, Variable

_NODE = {"mesh": "mesh", "location": "node"}
_FACE = {"mesh": "mesh", "location": "face"}


def _field(units: str, long_name: str, tensor: bool = False) -> Variable:
    """A field of the elements; absent where output.fields leaves it out."""
    dims = ("time", "face", "component") if tensor else ("time", "face")
    return Variable(dims, units, long_name, optional=True, attributes=_FACE)


LAYOUT = Layout(
    kind="fem",
    version=1,
    title="Plane-strain finite elements: states, load history, surface",
    filled=("time", "node"),
    dims={
        "time": "saved states; the first is the equilibrium under gravity",
        "node": "mesh nodes",
        "face": "quadrilateral elements",
        "corner": "corners of an element, counter-clockwise",
        "axis": "x, y",
        "component": "xx, yy, zz, xy of a symmetric tensor (tensor shear strain)",
        "load": "pressures of the scene",
        "surface": "nodes along the longest free part of the outline, in order",
        "step": "accepted load steps after gravity, the gravity state first",
    },
    variables={
        "mesh": Variable(
            (),
            "1",
            "topology of the mesh",
            dtype="i4",
            attributes={
                "cf_role": "mesh_topology",
                "topology_dimension": 2,
                "node_coordinates": "node_x node_y",
                "face_node_connectivity": "face_node",
            },
        ),
        "node_x": Variable(("node",), "m", "x of the nodes, undeformed", attributes=_NODE),
        "node_y": Variable(("node",), "m", "y of the nodes, undeformed", attributes=_NODE),
        "face_node": Variable(
            ("face", "corner"),
            "1",
            "nodes of each element",
            dtype="i4",
            index_of="node",
            attributes={"cf_role": "face_node_connectivity", "start_index": 0},
        ),
        "time": Variable(("time",), "s", "load time after gravity"),
        "displacement": Variable(
            ("time", "node", "axis"), "m", "displacement since the gravity state", attributes=_NODE
        ),
        "gravity_displacement": Variable(("node", "axis"), "m", "displacement by gravity", attributes=_NODE),
        "stress": _field("Pa", "mean Cauchy stress of the element, tension positive", tensor=True),
        "strain": _field("1", "mean strain of the element since the unloaded state, extension positive", tensor=True),
        "plastic_strain": _field("1", "mean equivalent plastic strain of the element"),
        "damage": _field("1", "largest damage of the element's Gauss points"),
        "pressure": Variable(("time", "load"), "Pa", "pressure of each load, pushing positive"),
        "load_name": Variable(("load",), "1", "names of the loads", dtype="U"),
        "reaction": Variable(("time", "axis"), "N m-1", "sum of the support forces on the body"),
        "surface_node": Variable(
            ("surface",), "1", "node numbers along the free surface", dtype="i4", index_of="node"
        ),
        "surface_distance": Variable(("surface",), "m", "distance along the free surface"),
        "surface_displacement": Variable(
            ("time", "surface", "axis"), "m", "displacement of the free surface since the gravity state"
        ),
        "step_time": Variable(("step",), "s", "load time of each accepted step"),
        "step_pressure": Variable(("step",), "Pa", "pressure of the first rising load"),
        "step_carried_pressure": Variable(
            ("step",), "Pa", "pressure without the part that viscous stabilisation carries"
        ),
        "step_settlement": Variable(("step",), "m", "mean movement of its loaded segment into the body"),
        "step_iterations": Variable(("step",), "1", "factorisations of the step", dtype="i4"),
    },
    own_attributes={"failed": int, "failure_load_pa": float},
)
