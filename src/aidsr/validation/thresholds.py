"""Limits that several rules share, each with the reason for its value; every other limit is in the file of its rule.

Lengths are shares of L, the characteristic length, and times are shares of sqrt(L / g), so that no limit depends on the
size of a robot. Limits of motors and materials are absolute on purpose: real motors and materials do not scale. All
limits are our choice, placed between robots known to be good and robots known to be bad.
"""

JOINT_SPEED_RAD_S = 200.0
"""Speed of a joint that no cable and motor of this size reach: beyond it the integration has failed or is about to
fail. The limit for bodies is `aidsr.sim.divergence.MAX_BODY_SPEED_M_S`."""
CHATTER_ERROR_G = 4.0
"""Root mean square acceleration under constant commands, in standard gravity, above which shaking is an error."""
MAX_MASS_RATIO = 100.0
"""Mass of the heaviest body / median mass; beyond it the contacts and joints of light parts lose precision."""
FEW_CABLES = 0.05
"""Cables with a fault / all driven cables, up to which the fault is a warning: a hand of forty muscles works without
one of them."""
