import sys

import pytest

from riseg_drake.stations.franka_link import FrankaLink, LinkError, told, why_not_connected


@pytest.mark.parametrize(("robot", "package"), [("fr3", "pylibfranka"), ("panda", "panda-python")])
def test_a_library_that_is_missing_is_told_with_the_line_that_installs_it(robot, package, monkeypatch):
    for module in ("pylibfranka", "panda_py", "panda_py.libfranka"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(LinkError) as caught:
        FrankaLink(robot, "127.0.0.1")
    assert str(caught.value) == (
        f"station.panda.robot is {robot}, which needs {package}: pip install 'riseg-drake[{robot}]'"
    )


@pytest.mark.parametrize(
    ("robot", "server", "library", "remedy"),
    [("fr3", 5, 10, "panda"), ("panda", 10, 5, "fr3"), ("fr3", 11, 10, "table")],
)
def test_another_version_is_one_line_with_both_and_what_to_do(robot, server, library, remedy):
    text = (
        f"libfranka: Incompatible library version (server version: {server}, library version: {library}). "
        "Please check https://frankarobotics.github.io for Panda systems."
    )
    line = why_not_connected(robot, "172.16.0.2", text)
    assert "\n" not in line
    assert f"server version {server}" in line
    assert f"version {library}" in line
    assert remedy in line


def test_errors_of_the_robot_are_told_by_their_names_alone():
    text = (
        'libfranka: Move command aborted: motion aborted by reflex! ["joint_reflex", "power_limit_violation"]'
    )
    assert told(text) == "joint_reflex, power_limit_violation"
    assert told("libfranka: UDP receive: Timeout") == "UDP receive: Timeout"
