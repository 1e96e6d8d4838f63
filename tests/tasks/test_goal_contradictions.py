"""Goals whose limits, or whose joints, leave no way to meet them are refused before anything is paid."""

import pytest

from aidsr.core.errors import UserError
from aidsr.tasks import goal_task, parse_goal

ROOM = """<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
<site name="mount" pos="0 0 0.4" euler="180 0 0"/>
<body name="post" pos="0 0.2 0.1"><geom name="post" type="cylinder" size="0.02 0.1"/></body>
<body name="cart" pos="-0.15 0 0.05"><joint name="rail" type="slide" axis="1 0 0" range="0 0.1" limited="true"/>
<geom name="cart" type="box" size="0.03 0.03 0.02"/><site name="knob"/></body>
<site name="hook" pos="0.1 0.1 0.25"/></worldbody></mujoco>"""
REACH = 'kind = "reach"\ntarget = "hook"\n'
TOUCH = 'kind = "touch"\ntarget = "post"\nforce_n = 2\n'
OVER_HOOK = '[[limits]]\nkind = "keep_out"\ncenter_m = [0.1, 0.1, 0.25]\nradius_m = 0.05\n'
OVER_MOUNT = '[[limits]]\nkind = "keep_out"\ncenter_m = [0, 0, 0.4]\nradius_m = 0.05\n'
LIGHTLY = 'kind = "touch"\ntarget = "post"\nforce_n = 0.5\nat_most_n = 1\n'
GENTLY = '[[limits]]\nkind = "force"\non = "post"\nat_most_n = 1\n'
BRING = 'kind = "bring"\ntargets = ["cart"]\nregion = {{center_m = [{x}, 0, 0.05], size_m = [0.05, 0.05, 0.05]}}\n'
FOLLOW = 'kind = "follow"\nwithin_m = 0.01\npath_m = [[-0.1, 0.1, 0.2], [0.1, 0.1, 0.2]]\n'
DRAG = FOLLOW.replace("-0.1, 0.1, 0.2", "-0.15, 0, 0.05").replace("0.1, 0.1, 0.2", "-0.05, 0, 0.05")
KEEP_OUT = '[[limits]]\nkind = "keep_out"\n'
ON_THE_WAY = KEEP_OUT + "center_m = [0, 0.1, 0.2]\nsize_m = [0.16, 0.1, 0.1]\n"
AT_THE_END = KEEP_OUT + "center_m = [0.1, 0.1, 0.2]\nradius_m = 0.03\n"
NO_CART = KEEP_OUT + 'what = "cart"\ncenter_m = [-0.07, 0, 0.05]\nsize_m = [0.1, 0.1, 0.1]\n'


@pytest.mark.parametrize(
    ("goal", "said"),
    [
        (REACH + OVER_HOOK, r"hook cannot be reached: it and all within 0.02 m of it lie in the ball of radius 0.05 m"),
        (REACH + 'base = "fixed"\n' + OVER_MOUNT, r'every mount lies in it, and base is "fixed"'),
        (TOUCH + GENTLY, r"post has to be touched with 2 N, and the limit on it is 1 N"),
        (
            'kind = "stages"\n[[stages]]\n' + LIGHTLY + "[[stages]]\n" + TOUCH,
            r"post has to be touched with 2 N, and another stage loses the episode beyond 1 N on it at any moment",
        ),
        (BRING.format(x=0.3), r'"cart" cannot get 0.425 m along 1 0 0: its joints \(rail\)'),
        (
            'kind = "stages"\n' + OVER_HOOK + "[[stages]]\n" + BRING.format(x=-0.07) + "[[stages]]\n" + REACH,
            "hook cannot be reached",
        ),
        (FOLLOW + ON_THE_WAY, r"path cannot be followed: .* in the box of 0.16 x 0.1 x 0.1 m .*, which the robot has"),
        (
            FOLLOW + AT_THE_END + 'what = "functional_part"\n',
            "the path cannot be held at its end: .* which the functional part",
        ),
        (
            'kind = "stages"\n' + ON_THE_WAY + "[[stages]]\n" + FOLLOW + "[[stages]]\n" + REACH,
            "the path cannot be followed",
        ),
        (DRAG + 'target = "cart"\n' + NO_CART, "the path cannot be held at its end: .* which cart has to keep out of"),
        (BRING.format(x=-0.07) + NO_CART, "cart cannot be brought into the box of 0.05 x 0.05 x 0.05 m .*: it lies in"),
    ],
)
def test_what_cannot_be_met_is_refused(goal: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        goal_task(parse_goal(goal), ROOM)


@pytest.mark.parametrize(
    "goal",
    [
        REACH + OVER_HOOK.replace("0.05", "0.015"),  # the rim of what is near enough is outside
        REACH + "vary_m = [0.05, 0, 0]\n" + OVER_HOOK,  # some variations can be met
        "hold_s = 0.1\n" + REACH + OVER_HOOK,  # had within the time that is tolerated
        REACH.replace("hook", "knob")
        + OVER_HOOK.replace("[0.1, 0.1, 0.25]", "[-0.15, 0, 0.05]"),  # it can be moved out
        REACH + OVER_MOUNT,  # a free robot begins elsewhere
        REACH + 'base = "fixed"\n' + OVER_MOUNT + 'what = "functional_part"\n',
        TOUCH + GENTLY.replace("1", "3"),
        'kind = "stages"\n[[stages]]\n' + LIGHTLY + "[[stages]]\n" + TOUCH + 'part = "robot"\n',  # by other parts
        'kind = "stages"\n[[stages]]\n' + LIGHTLY.replace("at_most_n = 1", "at_most_n = 3") + "[[stages]]\n" + TOUCH,
        BRING.format(x=-0.07),
        FOLLOW + ON_THE_WAY.replace("0.16, 0.1, 0.1", "0.16, 0.02, 0.02"),  # a way beside it is near enough
        FOLLOW + ON_THE_WAY.replace("0.16, 0.1, 0.1", "0.05, 0.1, 0.1"),  # through it within the time that is tolerated
        "hold_s = 0.1\n" + FOLLOW + AT_THE_END,
        FOLLOW + ON_THE_WAY + 'what = "cart"\n',  # another must keep out
        DRAG + 'target = "cart"\n' + NO_CART.replace('what = "cart"\n', ""),
        BRING.format(x=-0.07) + NO_CART.replace('what = "cart"\n', ""),
        BRING.format(x=-0.07) + NO_CART.replace("[0.1,", "[0.04,"),  # a part of the region is free
        BRING.format(x=-0.07) + "vary_m = [0.01, 0, 0]\n" + NO_CART.replace('"cart"', '"post"'),
    ],
)
def test_what_can_be_met_is_not(goal: str) -> None:
    task = goal_task(parse_goal(goal), ROOM)
    assert task.goal.hold_s > 0
