"""Compilation of MuJoCo models, without what is only for the eye unless it is asked for."""

import ctypes

import mujoco


def compile_spec(spec: mujoco.MjSpec, visual: bool = False) -> mujoco.MjModel:
    """Compile `spec`; without `visual` geoms that touch nothing, their meshes, materials and textures are left out.

    Masses, inertias, sites and the geoms that touch something are the same in both: MuJoCo keeps a geom that others
    refer to, and gives a body the inertia of the geoms that it leaves out. A model with visual meshes is some hundred
    times as large as one without.
    """
    spec.compiler.discardvisual = not visual
    spec.compiler.usethread = False  # each thread would keep a heap of its own
    model = spec.compile()
    give_back_memory()
    return model


def give_back_memory() -> None:
    """Return to the system what MuJoCo keeps of the meshes' files, and the memory that reading them took.

    It is 200 MB for one arm, which glibc keeps otherwise. Memory that is locked already cannot be returned.
    """
    mujoco.mj_clearCache(mujoco.mj_getCache())
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc's own
    if trim is not None:
        trim(0)
