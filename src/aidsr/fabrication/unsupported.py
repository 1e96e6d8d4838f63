"""Check for what cannot be built: a cable with several actuators, coupled joints, gravity compensation, open loops."""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.fabrication.anatomy import Anatomy


def unsupported_faults(anatomy: Anatomy) -> Iterator[Fault]:
    """Yield a fault for each kind of model element that has no counterpart in the built robot."""
    for code, names, message, cure in (
        (
            "cable_shared",
            anatomy.shared_cables,
            "is pulled by several actuators, and one winch is built for a cable",
            "Keep one actuator for each tendon, with the force of all of them.",
        ),
        (
            "joints_coupled",
            anatomy.couplings,
            "makes joints or tendons move as one in simulation, and no gear or linkage is built for it",
            "Leave the equality out, or lead one tendon across all these joints.",
        ),
        (
            "weight_lifted",
            anatomy.weightless,
            "is relieved of its weight in simulation (gravcomp), and nothing holds the built part up",
            "Remove gravcomp, and stiffen the joints until the limb carries itself.",
        ),
        (
            "loop_open",
            anatomy.open_loops,
            "ties parts together by a constraint that no rigid part stands for",
            "Close the loop by a weld of two bodies.",
        ),
        (
            "loop_open",
            anatomy.displaced_welds,
            "pulls two bodies out of their initial relative pose, in which they would be printed as one part",
            "Place the bodies as the weld holds them, and remove relpose from the weld.",
        ),
    ):
        if names:
            yield Fault(code=code, layer="realizability", severity="error", names=names, message=message, cure=cure)
