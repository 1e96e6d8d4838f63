"""The fidelity check: compare each limb with an exact elastic rod, with finer segments and with a finer time step.

limb, material, cables   a chain of a compiled robot as an elastic rod with cables
statics, compare         rest pose under load and first frequency, simulated and exact
rewrite, refine          the same limb with twice the segments, the same robot with half the time step
measure                  the check of a whole robot, in the isolated process
check                    the public function
report                   the results
"""

from aidsr.validation.fidelity.check import check_fidelity
from aidsr.validation.fidelity.report import Comparison, FidelityReport, LimbFidelity

__all__ = ["Comparison", "FidelityReport", "LimbFidelity", "check_fidelity"]
