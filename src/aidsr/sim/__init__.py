"""Simulation with MuJoCo, and nothing about models or learning.

    structure, extent    what a compiled robot is made of, and how long it is
    scope, soft_body     whether that is a tendon-driven continuum robot, and what its cables bend
    assembly, scaling    a robot placed in an environment
    rollout              many simulations at once
    beam                 stiffness and damping of an elastic backbone as MuJoCo joints

Import the module you need: the package itself imports none.
"""
