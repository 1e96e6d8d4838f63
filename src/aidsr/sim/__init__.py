"""Simulation with MuJoCo. Nothing here depends on language models or on learning.

    structure, extent    parts of a compiled robot, and its characteristic length
    scope, soft_body     whether it is a tendon-driven continuum robot, and which bodies its cables bend
    assembly, scaling    placing a robot in an environment, and changing its size
    rollout              many simulations in parallel
    beam                 stiffness and damping of an elastic backbone as MuJoCo joints

Import the module you need: this package imports none of them itself.
"""
