"""MuJoCo, and nothing about models or learning.

    mjcf, compiling      untrusted text in, checked document and compiled model out; every problem a fault
    isolation            run a function in a limited child process (child, worker: its two ends)
    assembly, scaling    a robot placed in an environment
    rollout, structure   many simulations at once; what a compiled robot is made of
    rendering, viewing   pictures, videos, MuJoCo's viewer
    beam                 stiffness and damping of an elastic backbone as MuJoCo joints

Import the module you need: this package loads nothing by itself, so that a caller of `isolation` needs no MuJoCo.
"""
