"""`python -OO` strips docstrings and assertions: every task still tells designers its terms and runs."""

import subprocess
import sys

from aidsr.tasks import TASKS

PROGRAM = """
import numpy as np

import aidsr
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.tasks import TASKS
from aidsr.teams.rules import team

if aidsr.__doc__ is not None:
    raise SystemExit("docstrings are still there")
rules, rng = team(1), np.random.default_rng(0)
for name in TASKS:
    for level in ("standard", "hard"):
        task = aidsr.load_task(name, level)
        brief = task.brief()
        if not all(brief.judging.values()):
            raise SystemExit(f"{name}: a sentence is missing")
    concept = rules.designer.propose(brief, 1)[0]
    robot = rules.coder.write(brief, concept)
    placed = assemble(robot, brief.environment, rules.integrator.place(brief, concept, robot), task.sensors)
    scene = TaskScene.of(placed.mjcf, task, groups=robot.actuator_groups)
    episodes = Episodes(scene.model, task, scene.actions, [task.variation("development", 0)], threads=1)
    for _ in range(3):
        result = episodes.step(rng.uniform(-1.0, 1.0, (1, scene.actions.size)))
    if not (np.isfinite(result.observation).all() and np.isfinite(result.reward).all()):
        raise SystemExit(f"{name}: observation or reward is not finite")
    print(name)
"""


def test_every_task_loads_and_runs_without_docstrings():
    done = subprocess.run([sys.executable, "-OO", "-c", PROGRAM], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.split()) == len(TASKS)
