"""Which known name a misspelt one stands for."""

import pytest

from aidsr.core.suggestions import close_names, closest_name, one_slip_away, only_close_name

KNOWN = ["range", "ctrlrange", "forcerange", "stiffness", "class", "mass"]


def test_the_closest_name_is_found_and_nothing_where_none_is_close() -> None:
    assert closest_name("stifness", KNOWN) == "stiffness"
    assert closest_name("colour", KNOWN) == ""
    assert close_names("rangee", KNOWN, most=2, cutoff=0.5) == ["range", "ctrlrange"]


def test_of_two_equally_close_names_neither_is_the_only_one() -> None:
    assert closest_name("bend_3", ["bend_1", "bend_2"])
    assert only_close_name("bend_3", ["bend_1", "bend_2"]) == ""
    assert only_close_name("stifness", KNOWN) == "stiffness"
    assert only_close_name("colour", KNOWN) == ""


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("stifness", "stiffness"),
        ("stifffness", "stiffness"),
        ("stiffnesd", "stiffness"),
        ("stiffnses", "stiffness"),
        ("ctrl_Range", "ctrlrange"),
        ("stffnes", ""),
        ("mss", "mass"),
        ("lass", ""),
    ],
)
def test_one_slip_is_forgiven_where_it_can_mean_one_name_only(name: str, meant: str) -> None:
    assert one_slip_away(name, [*KNOWN, "last"]) == meant
