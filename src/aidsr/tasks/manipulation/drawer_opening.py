"""Open and shut three drawers in a given order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import approach, excess, share
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Edits, Feature, Task, TaskState
from aidsr.tasks.variation import Change, Variation

DRAWERS = ("drawer_1", "drawer_2", "drawer_3")
STAGES = 4
"""Number of stages of each drawer: approach, hold, pull, push back."""
ALL_STAGES = STAGES * len(DRAWERS)
OPEN_M = 0.06
SHUT_M = 0.01
BAR_RADIUS_M = 0.006
FULLY_OPEN_M = 0.10
"""Opening at which the range of the drawers' joints ends [m]."""
NEAR_SHARE = 0.3
"""Share of the progress of pulling and pushing for being near the handle. Our choice."""
BEHIND_M = np.array([0.012, 0.0, 0.0])
"""Vector from the middle of a handle's bar to the point from which it is pulled, towards the cabinet [m]. Our choice:
policies that pulled had their functional part 7 to 10 mm behind the bar's middle."""
NEAR_M = 0.03
"""Distance at which a handle counts as approached [m]."""
FRICTION_FACTOR = (0.5, 2.0)
MAX_FORCE_N = 40.0
AMONG = "A part of the robot is level with the bars of the handles, or behind them, at the start."
OUT_OF_TURN = f"A drawer whose turn it is not is opened by {1000 * OPEN_M:g} mm."
"""Sentences of the two rules that lose an episode."""


@dataclass(frozen=True)
class DrawerOpening(Task):
    """Twelve stages: each drawer in its turn is approached, held, pulled open and pushed shut.

    Source: our choice, after Meta-World's drawer-open (Yu et al. 2019) and ManiSkill's cabinet drawers (75 % open).
    """

    name: ClassVar = "manipulation/drawer_opening"
    unchanged_since: ClassVar = 5
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 60.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((1 / 12, "at a handle"), (3 / 12, "one drawer open"), (7 / 12, "two open"), (1.0, "all done"))
    decisive: ClassVar = "one drawer open"
    required_names: ClassVar = ("mount", "cabinet", *DRAWERS, *(f"{drawer}_handle" for drawer in DRAWERS))
    policy_actuators: ClassVar = ("base_x", "base_z")
    needs_outline: ClassVar = True
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        *(TaskSensor(name=f"{d}_force", quantity="contact_force", target=f"{d}_handle") for d in DRAWERS),
    )
    features: ClassVar = (
        Feature(
            "functional part to the wanted drawer's handle", "m", (-0.8, 0.8), "drawer_*_position, tip_position", size=3
        ),
        Feature(f"opening of the wanted drawer, 1 = {1000 * OPEN_M:g} mm", "", (0, 1.7), "drawer_*_opening"),
        Feature(f"force on its handle, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "drawer_*_force"),
        Feature("1: to be opened, -1: to be shut, or kept so", "", (-1, 1), "(state)"),
        Feature("base forwards", "m", (0, 0.04), "base_x_position"),
        Feature("base up and down", "m", (-0.05, 0.05), "base_z_position"),
        Feature(f"openings of drawers 1 to 3, 1 = {1000 * OPEN_M:g} mm", "", (0, 1.7), "drawer_*_opening", size=3),
    )
    hard: ClassVar = {"friction_n": 1.5}

    friction_n: float = 0.4
    """Sliding friction of a drawer [N]; see `FRICTION_FACTOR`."""

    @property
    def objective(self) -> str:
        return (
            "Open three drawers by their bar handles (12 mm thick, 60 mm wide, 25 mm in front), 0.10, 0.20 and 0.30 "
            "m above the floor, one after the other in a given order, none out of turn: at least "
            f"{1000 * OPEN_M:g} mm out while the two others are shut, then back to {1000 * SHUT_M:g} mm or less, "
            f"against {self.friction_n:g} N of friction. The mount, 0.25 m before them and 0.20 m above the floor, "
            "moves 0.04 m towards them and 0.05 m up and down."
        )

    @property
    def edits(self) -> Edits:
        return {f"joint/{drawer}": {"frictionloss": self.friction_n} for drawer in DRAWERS}

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation="Order of the drawers, friction of each from half to twice the nominal one.",
            progress=(
                "Stages done, and the share of the present one; after the last one its share is that of all being "
                "shut. A part of pulling and pushing is to be near the handle, in pulling behind its bar, so that a "
                "robot that has lost it gains by going back. While another drawer is open, pulling is worth nothing."
            ),
            success=(
                "All twelve stages are done, each drawer in its turn approached, touched, pulled open and pushed shut, "
                "and all drawers are shut. A drawer counts as open in its turn only, and only while the two others are "
                f"open by {1000 * SHUT_M:g} mm or less."
            ),
            violation=f"More than {MAX_FORCE_N:g} N on a handle.",
            failure=f"{AMONG} {OUT_OF_TURN}",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return tuple(Mark(element="joint", name=drawer, by=OPEN_M) for drawer in DRAWERS)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        friction_n = self.friction_n * rng.uniform(*FRICTION_FACTOR, size=3)
        changes = tuple(Change("dof_frictionloss", d, (f,)) for d, f in zip(DRAWERS, friction_n, strict=True))
        order = rng.permutation(3)
        turns = ", ".join(str(drawer + 1) for drawer in order)
        words = f"drawers in the order {turns}; friction of 1 to 3: {', '.join(f'{f:.2f}' for f in friction_n)} N"
        return Variation(changes, {"order": tuple(float(drawer) for drawer in order)}, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        to_handle, opening_m, force_n = wanted(readings, state)
        turn = [opening_m / OPEN_M, force_n / FORCE_SCALE_N, np.where(to_be_shut(state), -1.0, 1.0)]
        base_m = [readings["base_x_position"], readings["base_z_position"]]
        return np.column_stack([to_handle, *turn, *base_m, openings_m(readings) / OPEN_M])

    def reset_state(self, readings: Readings) -> TaskState:
        outline, bars_m = readings.body, np.min([readings[f"{drawer}_position"][:, 0] for drawer in DRAWERS], axis=0)
        front_m = outline.foremost_m(outline.center_m[:, :, 0])
        return {"stage": np.zeros(readings.n), "among": np.asarray(front_m > bars_m - BAR_RADIUS_M, dtype=np.float64)}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        # advance in order through every stage of the wanted drawer whose goal is reached
        to_handle, opening_m, force_n = wanted(readings, state)
        arrived, touched = np.linalg.norm(to_handle, axis=1) < NEAR_M, force_n > TOUCH_N
        stage, first = state["stage"], state["stage"] // STAGES * STAGES
        opened = (opening_m >= OPEN_M) & alone(readings, opening_m)
        for done, reached in enumerate((arrived | touched, touched, opened, opening_m <= SHUT_M)):
            stage = np.where((stage == first + done) & reached & (stage < ALL_STAGES), stage + 1, stage)
        return {"stage": stage, "among": state["among"]}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        to_handle, opening_m, _ = wanted(readings, state)
        counted_m = np.where(to_be_shut(state) | alone(readings, opening_m), opening_m, 0.0)
        return staged(state, nearness(state, to_handle), counted_m, openings_m(readings).max(axis=1))

    def violation(self, readings: Readings) -> FloatArray:
        return excess(np.max([readings.peak_force_n(f"{drawer}_force") for drawer in DRAWERS], axis=0), MAX_FORCE_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        return (state["stage"] >= ALL_STAGES) & (openings_m(readings) <= SHUT_M).all(axis=1)

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        return {AMONG: state["among"] > 0.0, OUT_OF_TURN: out_of_turn(readings, state)}


def openings_m(readings: Readings) -> FloatArray:
    """Return the openings of the drawers, (n, 3) [m]."""
    return np.column_stack([readings[f"{drawer}_opening"] for drawer in DRAWERS])


def alone(readings: Readings, opening_m: FloatArray) -> BoolArray:
    """Return whether all drawers except one are shut, (n,).

    Args:
        readings: Current readings.
        opening_m: Opening of the excepted drawer, (n,) [m].
    """
    return np.asarray((openings_m(readings) > SHUT_M).sum(axis=1) <= (opening_m > SHUT_M))


def wanted(readings: Readings, state: TaskState) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return values of the wanted drawer, which is the drawer in turn.

    After the last stage it is the drawer that is farthest open, because all have to be shut.

    Returns:
        Vector from the functional part to the handle, (n, 3) [m], opening, (n,) [m], and force on the handle, (n,) [N].
    """
    row, opened_m = np.arange(readings.n), openings_m(readings)
    drawer = np.where(state["stage"] >= ALL_STAGES, opened_m.argmax(axis=1), in_turn(readings, state))
    handles_m = np.stack([readings[f"{name}_position"] for name in DRAWERS], axis=1)
    forces_n = np.column_stack([readings.force_n(f"{name}_force") for name in DRAWERS])
    return handles_m[row, drawer] - readings["tip_position"], opened_m[row, drawer], forces_n[row, drawer]


def in_turn(readings: Readings, state: TaskState) -> NDArray[np.intp]:
    """Return the index of the drawer whose turn it is, (n,); after the last stage that of the last drawer in order."""
    turn = np.minimum(state["stage"] // STAGES, len(DRAWERS) - 1).astype(np.intp)
    return np.asarray(readings.parameters["order"][np.arange(readings.n), turn].astype(np.intp))


def out_of_turn(readings: Readings, state: TaskState) -> BoolArray:
    """Return whether a drawer is open out of turn, (n,); always False after the last stage."""
    others = np.arange(len(DRAWERS)) != in_turn(readings, state)[:, None]
    opened = ((openings_m(readings) >= OPEN_M) & others).any(axis=1)
    return np.asarray(opened & (state["stage"] < ALL_STAGES))


def to_be_shut(state: TaskState) -> BoolArray:
    """Return whether the wanted drawer has to be shut or kept shut, (n,)."""
    return np.asarray((state["stage"] % STAGES == STAGES - 1) | (state["stage"] >= ALL_STAGES))


def nearness(state: TaskState, to_handle: FloatArray) -> FloatArray:
    """Return the nearness of the functional part to the handle, or for pulling to a point behind it, 0 to 1, (n,).

    Args:
        state: Task state with the stage.
        to_handle: Vector from the functional part to the wanted handle, (n, 3) [m].
    """
    to_be_pulled = (state["stage"] % STAGES == STAGES - 2) & (state["stage"] < ALL_STAGES)
    return approach(np.linalg.norm(to_handle + to_be_pulled[:, None] * BEHIND_M, axis=1))


def staged(state: TaskState, near: FloatArray, opening_m: FloatArray, widest_m: FloatArray) -> FloatArray:
    """Return the completed share of all stages, including a part of the present one, 0 to 1, (n,).

    Args:
        state: Task state with the stage.
        near: Nearness of the functional part, see `nearness`, (n,).
        opening_m: Opening of the wanted drawer, (n,) [m].
        widest_m: Opening of the drawer that is farthest open, (n,) [m].
    """
    stage, last = state["stage"], ALL_STAGES - 1
    shares = (near, near, _moved(near, share(opening_m, OPEN_M)), _moved(near, _shut(opening_m)))
    present = np.choose((stage % STAGES).astype(np.intp), shares)
    return np.asarray(np.where(stage > last, last + _shut(widest_m), stage + present) / ALL_STAGES)


def _moved(near: FloatArray, way: FloatArray) -> FloatArray:
    """Return the progress of moving a drawer, 0 to 1.

    `NEAR_SHARE` of it is for nearness to the handle, or for the motion where that is larger; the rest is for motion.
    """
    return np.asarray(NEAR_SHARE * np.maximum(near, way) + (1.0 - NEAR_SHARE) * way)


def _shut(opening_m: FloatArray) -> FloatArray:
    """Return how far drawers are shut, 0 to 1.

    It is measured from fully open, so that pushing a drawer that was pulled too far counts from the first millimetre.
    """
    return 1.0 - share(opening_m - SHUT_M, FULLY_OPEN_M - SHUT_M)
