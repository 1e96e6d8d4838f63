"""Limits that several rules share, each with the reason for its value; every other limit stands with its rule.

Lengths are shares of L, the characteristic length, and times shares of sqrt(L / g), so that no limit depends on how
large a robot is. Motor and material limits are absolute on purpose: real motors and matter do not scale. All limits are
our choice, placed between robots known to be good and robots known to be bad.
"""

JOINT_SPEED_RAD_S = 200.0
BODY_SPEED_M_S = 50.0
"""Speeds that no cable and motor of this size reach: the integration has failed or is about to."""
CHATTER_ERROR_G = 4.0
"""Root mean square acceleration while commands are constant, in standard gravity."""
MAX_MASS_RATIO = 100.0
"""Heaviest body / median segment; beyond it contacts and joints of the light parts lose precision."""
FEW_CABLES = 0.05
"""Cables with a fault / all driven cables, up to which it is a warning: a hand of forty muscles works without one."""
