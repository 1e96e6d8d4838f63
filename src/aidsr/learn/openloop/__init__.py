"""How far a robot gets on its task without learning: many open-loop motions, played in parallel.

motion         one motion: each group ramps from one value to another, with a sinusoid on top
motion_search  random motions first, then the cross-entropy method around the best
report         the result, kept as probe.json
script         the notation of motions written by hand
"""

from aidsr.learn.openloop.isolated_probe import probe
from aidsr.learn.openloop.motion import Motion
from aidsr.learn.openloop.probe_scene import probe_scene
from aidsr.learn.openloop.report import ProbeReport

__all__ = ["Motion", "ProbeReport", "probe", "probe_scene"]
