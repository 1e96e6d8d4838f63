"""A model from an untrusted text, prepared for display and simulation. Used only inside the player's process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self, get_args

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.apps.web.view3d.bodies import body_facts
from aidsr.apps.web.view3d.controls import control_facts, group_facts
from aidsr.apps.web.view3d.names import locate_elements
from aidsr.apps.web.view3d.parts import Parts, list_parts
from aidsr.apps.web.view3d.target import Target, TargetSpec, target_facts
from aidsr.apps.web.view3d.tendons import TendonLines, tendon_facts
from aidsr.core.artifacts import ActuatorGroup
from aidsr.mjcf.compile import compile_mjcf, load_mjcf
from aidsr.render.camera import frame_robot
from aidsr.render.stage import compile_for_display
from aidsr.render.view import View
from aidsr.sim.drive import Drive, neutral_ctrl, read_drives
from aidsr.sim.structure import Structure, read_structure
from aidsr.validation.mount import mount_model
from aidsr.validation.validator import Mount


@dataclass(frozen=True, eq=False)
class DisplayModel:
    """A robot as the validator would test it, or a scene, with the data that a viewer needs.

    Attributes:
        model: The simulated model.
        structure: Elements of the model that belong to the robot.
        drives: Commands of the robot's actuators.
        neutral: For each control, the command with which its actuator gives no force in the initial state, (nu,).
        parts: Shapes of the model.
        lines: Tendons of the model.
        facts: All data that a viewer is sent once.
    """

    model: mujoco.MjModel
    structure: Structure
    drives: tuple[Drive, ...]
    neutral: NDArray[np.float64]
    parts: Parts
    lines: TendonLines
    facts: dict[str, Any]

    @classmethod
    def of(
        cls,
        text: str,
        *,
        mount: Mount = "auto",
        environment: str = "",
        groups: Sequence[ActuatorGroup] = (),
        target: TargetSpec = "",
    ) -> Self:
        """Return an MJCF text prepared for display.

        Args:
            text: MJCF of a robot or a scene.
            mount: Mount of a robot shown alone; see `aidsr.validation.validate`.
            environment: MJCF of the environment whose physics options apply to a robot shown alone; empty for the
                robot's own options.
            groups: Actuators that act together, as the robot's author defines them.
            target: TOML of the goal, or marks of the task, whose target is shown; empty for none.

        Raises:
            MjcfError: The text cannot be loaded.
            UserError: The target is not a valid goal.
            ValueError: There is no such mount.
        """
        if mount not in get_args(Mount):
            raise ValueError(f"expected mount to be one of {get_args(Mount)}, found {mount!r}")
        standing = mount_model(load_mjcf(text), mount, compile_mjcf(environment) if environment else None)
        model, looks = standing.model, compile_for_display(standing.spec.copy())
        model.tendon_width[:] = looks.tendon_width
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        structure, neutral = read_structure(model), neutral_ctrl(model, data)
        drives = read_drives(model, data, structure)
        parts = list_parts(looks, data)
        facts = {
            "length_m": structure.characteristic_length_m,
            "is_scene": structure.is_scene,
            "is_free": bool(structure.free_roots),
            "parts": parts.facts,
            "surfaces": parts.surfaces,
            "bodies": body_facts(model, parts),
            "tendons": tendon_facts(model, looks, drives),
            "controls": control_facts(model, data, drives, neutral),
            "groups": group_facts(model, structure, groups),
            "places": locate_elements(model),
            "camera": _camera(looks, data),
            "notes": standing.notes,
        }
        if target and structure.is_scene:
            finder = Target(model, data, parts, structure.characteristic_length_m)
            facts["target"] = target_facts(finder, target, facts)
        return cls(model, structure, drives, neutral, parts, TendonLines(model), facts)


def _camera(looks: mujoco.MjModel, data: mujoco.MjData) -> dict[str, Any]:
    camera = frame_robot(looks, [data], View())
    return {
        "lookat": [round(float(number), 5) for number in camera.lookat],
        "distance": round(float(camera.distance), 5),
        "azimuth_deg": float(camera.azimuth),
        "elevation_deg": float(camera.elevation),
        "fovy_deg": float(looks.vis.global_.fovy),
    }
