"""Readings: named arrays, forces over time, contacts, the outline; and soft thresholds."""

import mujoco
import numpy as np
import pytest
from sights import slots
from stick import Episode

from aidsr.core.artifacts import Placement, Robot
from aidsr.sim.assembly import assemble
from aidsr.tasks import Reader, Readings, goal_task, load_task, parse_goal
from aidsr.tasks.shaping import closeness, excess, share


def readings(**sensors: np.ndarray) -> Readings:
    return Readings(sensors=sensors, time_s=np.zeros(1), length_m=0.3, sample_dt_s=0.002)


def test_an_unknown_sensor_is_named_with_those_there_are():
    with pytest.raises(KeyError, match=r'unknown sensor "tip".*tip_force, tip_position'):
        readings(tip_position=np.zeros((1, 1, 3)), tip_force=np.zeros((1, 1, 3)))["tip"]


def test_the_newest_sample_comes_last():
    samples = np.arange(6.0).reshape(1, 3, 2)
    assert readings(pair=samples)["pair"].tolist() == [[4.0, 5.0]]
    assert readings(pair=samples).scalar("pair").tolist() == [4.0]


def test_a_spike_of_one_step_is_averaged_and_a_push_is_not():
    force = np.zeros((1, 20, 3))
    force[0, 12, 2] = 10.0
    assert readings(force=force).peak_force_n("force") == pytest.approx([2.0])
    force[0, 10:15, 2] = 10.0
    assert readings(force=force).peak_force_n("force") == pytest.approx([10.0])
    # what pushes in turn from two sides does not press
    force[0, 10:15, 2] = (10.0, -10.0, 10.0, -10.0, 0.0)
    assert readings(force=force).peak_force_n("force") == pytest.approx([0.0])


def test_the_newest_mean_is_that_of_the_last_10_ms():
    force = np.zeros((1, 20, 3))
    force[0, :15, 2] = 10.0
    force[0, 17, 2] = 5.0
    assert readings(force=force).mean_force_n("force") == pytest.approx([1.0])
    assert readings(force=force).mean_force_n("force", mean_over_s=0.02) == pytest.approx([5.5])


def test_averaging_works_with_other_time_steps():
    short = Readings({"force": np.ones((1, 1, 3))}, np.zeros(1), 0.3, 0.002)
    assert short.peak_force_n("force") == pytest.approx([np.sqrt(3)])
    # ten samples of 1 ms to a block; the odd ones are the oldest
    force = np.zeros((1, 23, 1))
    force[0, :3] = 100.0
    force[0, 3:13] = 4.0
    assert Readings({"force": force}, np.zeros(1), 0.3, 0.001).peak_force_n("force") == pytest.approx([4.0])


def test_contacts_are_taken_apart():
    held = readings(grip=slots((2.0, (1, 0, 0)), (0.5, (0, 1, 0))))
    contacts = held.contacts("grip")
    assert contacts.found.tolist() == [[True, True, False, False]]
    assert contacts.force_n.tolist() == [[2.0, 0.5, 0.0, 0.0]]
    assert held.peak_contact_n("grip") == pytest.approx([2.0])
    assert held.peak_contact_n("grip", together=True) == pytest.approx([2.5])


@pytest.mark.parametrize(
    ("contacts", "opposition"),
    [
        ([], 0.0),
        ([(1.0, (1, 0, 0))], 0.0),
        ([(1.0, (1, 0, 0)), (1.0, (1, 0, 0))], 0.0),
        ([(1.0, (1, 0, 0)), (1.0, (0, 1, 0))], 0.5),
        ([(1.0, (1, 0, 0)), (1.0, (-0.5, np.sqrt(0.75), 0)), (1.0, (-0.5, -np.sqrt(0.75), 0))], 0.75),
        ([(1.0, (1, 0, 0)), (1.0, (-1, 0, 0))], 1.0),
    ],
)
def test_opposition_tells_how_far_contacts_face_each_other(contacts, opposition):
    assert readings(grip=slots(*contacts)).contacts("grip").opposition() == pytest.approx([opposition])


def test_a_real_contact_is_read_with_its_force_and_side():
    """The layout of MuJoCo's contact sensor is the one that is read."""
    episode = Episode(load_task("force_controlled_brushing"), base="free")
    back = episode.sensor("wall_back")
    episode.place(episode.sensor("wall_position") - 0.001 * back, back)
    goal = episode.sensor("wall_position") + 0.0008 * back
    for _ in range(25):
        episode.step(lambda e: e.hold("robot/stick", e.tip_m, goal, along=back))
    contacts = episode.look().contacts("brush_contacts")
    assert contacts.found[0, 0]
    assert contacts.force_n[0].sum() == pytest.approx(0.8, rel=0.1)
    assert contacts.normal[0, 0] == pytest.approx(back, abs=1e-6)
    assert contacts.position_m[0, 0] == pytest.approx(episode.tip_m, abs=2e-3)


BLOCKS = """
<mujoco model="brush">
  <worldbody>
    <body name="stick" gravcomp="1">
      <geom name="bar" type="box" pos="0 0 0.05" size="0.03 0.03 0.05" mass="0.05"/>
      <geom type="box" pos="0.02 0.02 0.11" size="0.008 0.008 0.01" mass="0.001"/>
      <geom type="box" pos="-0.02 0.02 0.11" size="0.008 0.008 0.01" mass="0.001"/>
      <geom type="box" pos="0.02 -0.02 0.11" size="0.008 0.008 0.01" mass="0.001"/>
      <geom type="box" pos="-0.02 -0.02 0.11" size="0.008 0.008 0.01" mass="0.001"/>
      <site name="tip" pos="0 0 0.12"/>
    </body>
  </worldbody>
</mujoco>
"""


def test_all_contacts_of_a_brush_of_four_blocks_count(monkeypatch):
    """Each flat block has four contacts with the wall."""
    task = load_task("force_controlled_brushing")
    brush, placement = Robot(mjcf=BLOCKS, functional_part="tip"), Placement(mount="mount", base="free")
    monkeypatch.setattr("stick.scene", lambda *_: assemble(brush, task.environment, placement, task.sensors).mjcf)
    episode = Episode(task, base="free")
    back = episode.sensor("wall_back")
    episode.place(episode.sensor("wall_position") - 0.001 * back, back)
    goal = episode.sensor("wall_position") + 0.0039 * back
    for _ in range(25):
        episode.step(lambda e: e.hold("robot/stick", e.tip_m, goal, along=back))
    seen = episode.look()
    for sensor in ("brush_contacts", "robot_contacts"):
        assert seen.all_contacts_n(sensor) == pytest.approx([3.9], rel=0.1)
    assert task.violation(seen)[0] > 0.0
    in_band = 7  # number of the feature
    assert task.observe(seen, task.reset_state(seen))[0, in_band] == 0.0


def test_contacts_beyond_the_slots_count_as_much_as_the_weakest_in_a_slot():
    full = slots(*[(2.0, (1, 0, 0))] * 3, (0.5, (0, 1, 0)))
    assert readings(grip=full).all_contacts_n("grip") == pytest.approx([6.5])
    full[..., ::10] = 7  # of seven contacts, four have a slot
    assert readings(grip=full).all_contacts_n("grip") == pytest.approx([6.5 + 3 * 0.5])
    full[..., 32:34] = (0.3, 0.4)  # friction in the last slot: a contact without one may press with all of that force
    assert readings(grip=full).all_contacts_n("grip") == pytest.approx([6.5 + 3 * np.sqrt(0.5)])
    assert readings(grip=np.zeros((1, 1, 40))).all_contacts_n("grip") == pytest.approx([0.0])


def test_the_outline_is_strung_along_the_robot():
    episode = Episode(load_task("gap"))
    episode.place(np.array([0.1, 0.0, 0.05]), (1.0, 0.0, 0.0))
    outline = episode.look().body
    assert outline.radius_m == pytest.approx(0.008)
    assert outline.length_share.sum() == pytest.approx(1.0, abs=0.02)
    reach = outline.center_m[0, :, 0]
    assert reach.min() - 0.008 == pytest.approx(0.1 - 0.12, abs=1e-6)
    assert reach.max() + 0.008 == pytest.approx(0.1, abs=1e-6)
    assert outline.center_m[0, :, 2] == pytest.approx(0.05)


SLAB = """
<mujoco model="slab">
  <worldbody>
    <body name="slab">
      <geom name="slab" type="box" size="0.1 0.06 0.005"/>
      <geom name="rod" type="capsule" fromto="0 0 0.05 0 0 0.25" size="0.005"/>
      <geom name="disk" type="cylinder" pos="0 0 0.3" size="0.05 0.01"/>
      <site name="tip" pos="0 0 0.3"/>
    </body>
  </worldbody>
</mujoco>
"""


def test_the_robot_must_keep_out_with_its_whole_surface():
    """Points all over the surface of three geoms, none of which may lie in a region unseen."""
    goal = 'kind = "reach"\ntarget = "spot"\n[[limits]]\nkind = "keep_out"\ncenter_m = [0, 0, 0]\nsize_m = [1, 1, 1]'
    room = '<mujoco><worldbody><site name="mount" pos="0 0 1"/><site name="spot" pos="0 0 1.2"/></worldbody></mujoco>'
    task = goal_task(parse_goal(goal), room)
    robot, placement = Robot(mjcf=SLAB, functional_part="tip"), Placement(mount="mount", base="fixed")
    model = mujoco.MjModel.from_xml_string(assemble(robot, room, placement, task.sensors).mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    outline = Reader.of(task, model)._outline(data.geom_xpos[None], data.geom_xmat[None])
    slab = [
        (x, y, z) for x in np.linspace(-0.1, 0.1, 21) for y in np.linspace(-0.06, 0.06, 13) for z in (-0.005, 0.005)
    ]
    around = np.linspace(0, 2 * np.pi, 24)
    rod = [(0.005 * np.cos(a), 0.005 * np.sin(a), z) for a in around for z in np.linspace(0.05, 0.25, 50)]
    disk = [(r * np.cos(a), r * np.sin(a), z) for a in around for r in np.linspace(0, 0.05, 6) for z in (0.29, 0.31)]
    for points, most_m in ((slab, 0.008), (rod, 0.001), (disk, 0.008)):
        beyond_m = np.linalg.norm(np.array(points)[:, None] + [0, 0, 1] - outline.center_m[0], axis=2)
        assert (beyond_m - outline.radius_m).min(axis=1).max() < most_m
    assert len(outline.radius_m) < 350


GHOST = """
<mujoco model="ghost">
  <worldbody>
    <body name="arm">
      <joint name="bend" type="hinge" axis="1 0 0"/>
      <geom name="arm" type="capsule" fromto="0 0 0 0 0 0.2" size="0.01" contype="0" conaffinity="0"/>
      <body name="hand" pos="0 0 0.2">
        <joint name="wrist" type="hinge" axis="1 0 0"/>
        <geom name="hand" type="capsule" fromto="0 0 0 0 0 0.04" size="0.01"/>
        <site name="tip" pos="0 0 0.05"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def test_what_cannot_touch_is_of_the_body_but_not_of_its_outline():
    task = load_task("surface_adapting")
    robot, placement = Robot(mjcf=GHOST, functional_part="tip"), Placement(mount="mount", base="fixed")
    model = mujoco.MjModel.from_xml_string(assemble(robot, task.environment, placement, task.sensors).mjcf)
    assert Reader.of(task, model).length_share.sum() == pytest.approx(0.06 / 0.25, abs=0.03)


def test_the_outline_is_asked_for_only_where_a_task_needs_it():
    episode = Episode(load_task("button_pushing"))
    with pytest.raises(ValueError, match="needs_outline"):
        _ = episode.look().body
    episode = Episode(load_task("gap"))
    with pytest.raises(ValueError, match="geom_xpos"):
        episode.reader.read(np.zeros((1, 1, episode.model.nsensordata)), np.zeros(1), [episode.variation])


def test_soft_thresholds():
    assert closeness(np.array([0.0, 0.1, 0.3, 10.0]), within=0.1, margin=0.2) == pytest.approx(
        [1, 1, 0.1, 4.5e-5], abs=1e-5
    )
    assert (np.diff(closeness(np.linspace(0.2, 5.0, 50), margin=0.2)) < 0).all()
    assert share(np.array([-1.0, 0.5, 3.0]), 2.0) == pytest.approx([0.0, 0.25, 1.0])
    assert excess(np.array([0.0, 20.0, 30.0, 99.0]), 20.0) == pytest.approx([0.0, 0.0, 0.5, 1.0])
    assert excess(np.array([0.3, 0.35, 0.5]), 0.3, full=0.4) == pytest.approx([0.0, 0.5, 1.0])
