"""What the model of a scene holds and what it leaves out, in words; by kind of scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Feature(NamedTuple):
    """on : what is modelled where `when` holds of the scene; off : what is left out where it does not"""

    when: Callable[[Any], Any]
    on: str
    off: str = ""


def _always(text: str) -> Feature:
    return Feature(lambda scene: True, text)


def _never(text: str) -> Feature:
    return Feature(lambda scene: False, "", text)


def _of_joints(scene: Any, *keys: str) -> bool:
    """Whether joints, of any set, have one of these above nothing."""
    return any(getattr(j, key) for key in keys for j in (scene.joints, *scene.joints.sets))


def _broken(scene: Any) -> bool:
    keys = ("residual_friction", "residual_cohesion")
    return any(getattr(j, key) is not None for key in keys for j in (scene.joints, *scene.joints.sets))


def _table(scene: Any, key: str) -> Any:
    """A parameter of the scene's law; None where the law lies in a file, or has none of that name."""
    return (getattr(scene.material, "parameters", None) or {}).get(key)


FEATURES: dict[str, tuple[Feature, ...]] = {
    "blocks": (
        Feature(lambda s: s.rock.zones == "elastic", "blocks deform elastically"),
        Feature(lambda s: s.rock.zones == "mohr-coulomb", "blocks yield, in shear and in tension",
                "yield of the rock between joints"),
        Feature(lambda s: s.rock.zones != "rigid", "", "deformation of the blocks: they are rigid"),
        _always("joints slip by Coulomb's law, open and close, with moments over their length"),
        Feature(lambda s: _of_joints(s, "dilation"), "joints dilate as they slip",
                "dilation of joints"),
        Feature(lambda s: _of_joints(s, "tension"), "joints bear tension until they break",
                "tensile strength of joints"),
        Feature(_broken, "joints keep a residual strength once broken", "loss of strength of joints that slip"),
        Feature(lambda s: _of_joints(s, "closure"), "joints stiffen as they close",
                "stiffening of joints as they close"),
        Feature(lambda s: s.in_situ, "stress in situ, in balance from the start", "stress in situ"),
        Feature(lambda s: s.programme, "weight, pressures that rise until the body fails or rests",
                "weight"),
        Feature(lambda s: s.programme and s.programme.excavations, "excavation", ""),
        Feature(lambda s: s.programme is None, "compression by moving walls under a confinement", ""),
        _never("water and pore pressure"),
        _never("new cracks: blocks do not split"),
        _never("the third dimension: plane strain"),
        _never("true time: masses are scaled, loads are slow"),
    ),
    "particles": (
        _always("spheres with linear contacts and viscous damping"),
        Feature(lambda s: s.contact.friction > 0.0, "friction and rotation of grains", "friction between grains"),
        Feature(lambda s: s.contact.wall_friction > 0.0, "friction on floor and walls", "friction on floor"),
        Feature(lambda s: s.box.sides == "walls", "hard side walls", "side walls: the bed repeats"),
        Feature(lambda s: s.shaking, "shaking of the floor", "shaking"),
        _never("the shape of grains: they are spheres"),
        _never("breakage of grains"),
        _never("cohesion and liquid between grains"),
    ),
    "rev-study": (
        _always("averages of stress and strain over circles of several radii and places"),
        Feature(lambda s: s.calibration, "a law fitted to every sample", "fits of a law to the samples"),
        _never("regions of other shapes than circles"),
    ),
    "calibrate": (
        _always("a law at one point follows each curve; parameters by a global search and refinements"),
        Feature(lambda s: s.cross_validation, "cross-validation over the curves", "cross-validation"),
        Feature(lambda s: s.weights.noise, "noise of the curves in the errors of parameters", ""),
        _never("bands of localized strain: a curve is taken as that of a uniform body"),
    ),
    "fem": (
        _always("a plane-strain body of quads, small strain, weight, then rising pressures"),
        Feature(lambda s: (_table(s, "damage") or "none") != "none" or s.softening_width,
                "softening, with a length from the element or softening_width", ""),
        Feature(lambda s: s.softening_width, "zones that soften together have a width of their own",
                "a width of softening zones: they are as wide as an element, and loads depend on the mesh"),
        Feature(lambda s: s.stepping.relaxation, "viscous stabilisation", "viscosity and inertia"),
        _never("large rotations and strains"),
        _never("water and pore pressure"),
        _never("single joints: the law stands for them"),
    ),
    "scratch": (
        _always("a rigid sphere indents, slides and lifts; large strains, contact by penalty, inertia"),
        Feature(lambda s: s.tip.friction > 0.0, "Coulomb friction of the tip", "friction of the tip"),
        Feature(lambda s: s.tip.path > 0.0, "", "sliding: the tip only indents"),
        Feature(lambda s: s.damage, "damage by the work of the tip, and removal of elements",
                "damage and removal of material"),
        _never("the half of the specimen beyond the plane of symmetry"),
        _never("heat, and rate dependence of the metal"),
        _never("the shape of real grains"),
    ),
    "wear": (
        _always("contacts per area, force per contact and a groove per class of grain"),
        Feature(lambda s: s.load.mode == "balanced", "contacts that carry the applied load",
                "balance: contacts times force need not be the applied load"),
        _never("grooves that meet: each grain finds a fresh surface"),
        _never("grains that roll, break or stick"),
    ),
}  # fmt: skip


def features_of(scene: Any) -> tuple[list[str], list[str]]:
    """What the model of a scene holds, and what it leaves out."""
    held: list[str] = []
    left: list[str] = []
    for feature in FEATURES[scene.kind]:
        words, said = (held, feature.on) if feature.when(scene) else (left, feature.off)
        if said:
            words.append(said)
    return held, left
