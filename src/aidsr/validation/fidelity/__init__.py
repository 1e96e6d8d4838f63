"""How far the simulation of a robot can be trusted: each limb against elastic rods, finer segments, a finer step.

limb, material, cables   a chain of a compiled robot read as a rod with cables
statics, compare         where it comes to rest and how it swings, simulated and exact
rewrite, refine          the same limb with twice the segments, the same robot with half the time step
report                   what comes out
"""

from aidsr.validation.fidelity.check import check_fidelity
from aidsr.validation.fidelity.report import Comparison, FidelityReport, LimbFidelity

__all__ = ["Comparison", "FidelityReport", "LimbFidelity", "check_fidelity"]
