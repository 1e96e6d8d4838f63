"""Changes that make a good robot bad in one way.

injection    definition of such a change
anatomy      limbs and their tendons
parts        missing or wrong parts, ranges, gaps
wiring       tendons and actuators that cannot have an effect
motion       robots that fall, sag, ring, chatter or diverge
holding      obstacles, weakness and stiffness that keep a robot still
building     cables, motors and parts that cannot be built
routes       cables that pull in the wrong place
constants    unusual units, gravity, friction, keyframes, damping and filters
signs        actuators that act in the wrong direction
document     MJCF that does not load
"""

from __future__ import annotations

from benchmarks.validator.corpus.faults.building import BUILDING
from benchmarks.validator.corpus.faults.constants import CONSTANTS
from benchmarks.validator.corpus.faults.document import DOCUMENT
from benchmarks.validator.corpus.faults.holding import HOLDING
from benchmarks.validator.corpus.faults.injection import Injection, UnsuitableError
from benchmarks.validator.corpus.faults.motion import MOTION
from benchmarks.validator.corpus.faults.parts import PARTS
from benchmarks.validator.corpus.faults.routes import ROUTES
from benchmarks.validator.corpus.faults.signs import SIGNS
from benchmarks.validator.corpus.faults.wiring import WIRING

__all__ = ["DOCUMENT", "INJECTIONS", "Injection", "UnsuitableError"]

INJECTIONS: tuple[Injection, ...] = (*PARTS, *WIRING, *MOTION, *HOLDING, *BUILDING, *ROUTES, *CONSTANTS, *SIGNS)
"""Changes after which a model still loads. After those of `DOCUMENT` it does not."""
