"""Cost of the default probe: processor seconds on built-in bodies (quoted in docs/learning.md).

python benchmarks/tasks/probe_seconds.py [TASK:DESIGN ...]
"""

from __future__ import annotations

import sys
import time

import mujoco

from aidsr import load_task, probe
from aidsr.sim.assembly import assemble
from aidsr.teams.rules import team

BODIES = "button_pushing:1 button_pushing:2 surface_adapting:2 simple_grasping:1 drawer_opening:2 flat_ground:1"


def main() -> None:
    """Print a row for each body, which is a design of the built-in team with seed 1, as first written."""
    for name, _, number in (body.partition(":") for body in sys.argv[1:] or BODIES.split()):
        task, rules = load_task(name), team(1)
        brief = task.brief()
        concept = rules.designer.propose(brief, 3)[int(number) - 1]
        robot = rules.coder.write(brief, concept)
        placement = rules.integrator.place(brief, concept, robot)
        mjcf = assemble(robot, brief.environment, placement, task.sensors).mjcf
        began = time.process_time()
        found = probe(mjcf, task, groups=robot.actuator_groups, threads=1)
        spent_s = time.process_time() - began
        dofs = mujoco.MjModel.from_xml_string(mjcf).nv
        row = f"| {name}: {concept.name} | {dofs} | {found.played_steps:,} | {spent_s:.0f} s | {found.ended_by} | "
        sys.stdout.write(f"{row}{found.progress:.2f} |\n")


if __name__ == "__main__":
    main()
