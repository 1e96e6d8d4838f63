"""Writers of good robots. Like independent authors, no two of them share conventions.

hinges      hinge joints at the start of segments, degrees, motors: the usual first document of language models
balls       ball joints, default classes, radians, position servos on tendon lengths
tapered     planar limbs of boxes that shrink along their length, in grippers and tentacles
discs       a thin backbone with routing discs, joints in the middle of segments, filtered winches, two sections
ground      free bodies with their own floor: crawlers, worms, snakes, stars
loops       closed rings
hands       palms with fingers, tendons that wrap around joints or couple them (held out)
frames      <frame>, quaternions, ellipsoids and normalised commands (held out)
styles      one body in many dialects: sizes, integrators, actuators, joints, classes inside classes
own         robots of this project's built-in team
"""

from __future__ import annotations

from benchmarks.validator.corpus.writers.balls import write_ball_robot
from benchmarks.validator.corpus.writers.discs import write_disc_robot
from benchmarks.validator.corpus.writers.frames import write_frame_robot
from benchmarks.validator.corpus.writers.ground import write_ground_robot
from benchmarks.validator.corpus.writers.hands import write_hand
from benchmarks.validator.corpus.writers.hinges import write_hinge_robot
from benchmarks.validator.corpus.writers.loops import write_loop
from benchmarks.validator.corpus.writers.own import write_own_robot
from benchmarks.validator.corpus.writers.styles import write_dialect
from benchmarks.validator.corpus.writers.tapered import write_tapered_robot
from benchmarks.validator.corpus.writers.written import Writer, Written

__all__ = ["ALL_WRITERS", "TUNING_WRITERS", "Writer", "Written"]

TUNING_WRITERS: dict[str, Writer] = {
    "hinges": write_hinge_robot,
    "balls": write_ball_robot,
    "tapered": write_tapered_robot,
    "discs": write_disc_robot,
    "ground": write_ground_robot,
    "loops": write_loop,
    "styles": write_dialect,
    "own": write_own_robot,
}
ALL_WRITERS: dict[str, Writer] = TUNING_WRITERS | {"hands": write_hand, "frames": write_frame_robot}
"""Writers of held-out robots: all tuning writers, with other seeds, and two writers whose robots nobody looked at."""
