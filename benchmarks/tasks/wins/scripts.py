"""The scripts by the task that they win."""

from __future__ import annotations

from benchmarks.tasks.wins.drawer_opening import DrawerOpening
from benchmarks.tasks.wins.force_controlled_brushing import ForceControlledBrushing
from benchmarks.tasks.wins.out_of_sample import AroundCorners, BallFromBowl, CrankTurning, Incline
from benchmarks.tasks.wins.script import Script
from benchmarks.tasks.wins.surface_adapting import SurfaceAdapting

SCRIPTS: dict[str, type[Script]] = {
    "reaching/surface_adapting": SurfaceAdapting,
    "manipulation/drawer_opening": DrawerOpening,
    "manipulation/force_controlled_brushing": ForceControlledBrushing,
    "reaching/around_corners": AroundCorners,
    "grasping/ball_from_bowl": BallFromBowl,
    "locomotion/incline": Incline,
    "manipulation/crank_turning": CrankTurning,
}
