"""Compilation of MuJoCo models, by default without visual geometry."""

import ctypes

import mujoco


def compile_spec(spec: mujoco.MjSpec, visual: bool = False) -> mujoco.MjModel:
    """Compile `spec`. Without `visual`, drop geoms that cannot collide, and their meshes, materials and textures.

    Masses, inertias, sites and colliding geoms are the same in both cases: MuJoCo keeps a geom that others refer to,
    and gives a body the inertia of the dropped geoms. A model with visual meshes is about a hundred times larger.
    """
    spec.compiler.discardvisual = not visual
    spec.compiler.usethread = False  # each thread would keep its own heap
    model = spec.compile()
    give_back_memory()
    return model


def give_back_memory() -> None:
    """Return the memory of MuJoCo's cache of mesh files, and that used for reading them, to the system.

    Otherwise glibc keeps it: 200 MB for one arm. Memory that is already locked cannot be returned.
    """
    mujoco.mj_clearCache(mujoco.mj_getCache())
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc's own
    if trim is not None:
        trim(0)
