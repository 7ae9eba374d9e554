"""The block model that a scene describes: rock, joints, damping, in-situ stress."""

from __future__ import annotations

from graben.errors import BadInput, Fault
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.loading.in_situ import InSitu, put_in
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import Tessellation
from graben.mechanics.blocks.zones.plastic import Strength
from graben.schemas.scenes.blocks import BlocksScene
from graben.stages.blocks.ends import beside, platen_rock, platens_of, with_contacts
from graben.stages.blocks.joints import joints_of_sets


def block_model(scene: BlocksScene, tessellation: Tessellation, steps: int) -> BlockModel:
    """Model of blocks laid out, with in-situ stress and damping; its time step makes `steps` of the loading.

    Refused where the mechanics take no such properties; BadInput where the damping is too strong.
    """
    programme = scene.programme
    dt = (scene.loading.duration if programme is None else programme.end) / steps
    gravity = (0.0, 0.0) if programme is None else (programme.horizontal, programme.vertical)
    platens = platens_of(scene)
    laid_out = tessellation if platens is None else beside(tessellation, platens)
    bodies = build_bodies(laid_out, scene.tessellation.zone_edge)
    joints, between = joints_of_sets(scene.joints, bodies.edge_set)
    edge_set = bodies.edge_set
    if platens is not None:
        joints, edge_set, between = with_contacts(platens, bodies, joints, between)
    model = BlockModel(
        bodies,
        young=scene.rock.young,
        poisson=scene.rock.poisson,
        density=scene.rock.density,
        joint=joints[0],
        more_joints=joints[1:],
        edge_set=edge_set,
        set_between=between,
        rounding=scene.tessellation.rounding,
        dt=dt,
        gravity=gravity,
        damping=_damping(scene, dt),
        threads=scene.numerics.threads,
        strength=Strength(*scene.rock.strength) if scene.rock.zones == "mohr-coulomb" else None,
        rigid=scene.rock.zones == "rigid",
        platen_rock=platen_rock(platens),
    )
    _put_stress_in(scene, model)
    return model


def _put_stress_in(scene: BlocksScene, model: BlockModel) -> None:
    s = scene.in_situ
    if s is None:
        return
    level = float(model.bodies.outline[:, 1].max()) if s.level is None else s.level
    stress, rise = (s.sxx, s.syy, s.sxy), (s.sxx_rise, s.syy_rise, s.sxy_rise)
    if s.k0 is not None and scene.programme is not None:
        weight = -scene.rock.density * scene.programme.vertical
        stress, rise = (s.k0 * s.syy, s.syy, 0.0), (s.k0 * weight, weight, 0.0)
    put_in(model, InSitu(stress, rise, level))


def _damping(scene: BlocksScene, dt: float) -> Damping:
    n = scene.numerics
    if n.damping == "local":
        return Damping(ratio=-1.0, local=n.damping_share or 0.0)
    if n.damping == "viscous":
        coefficient = n.damping_coefficient or 0.0
        if coefficient * dt > 1.0:
            key, value = "numerics.damping_coefficient", f"{coefficient:.4g} 1/s"
            raise BadInput(Fault(str(scene.source.path), key, value, f"at most 1 / time step = {1.0 / dt:.4g} 1/s"))
        return Damping(ratio=-1.0, coefficient=coefficient)
    return Damping(ratio=n.damping_ratio)
