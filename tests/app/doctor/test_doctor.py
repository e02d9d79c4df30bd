import os
import re

import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.doctor import command, machine, network
from riseg_drake.app.graphics import NoGraphicsError
from riseg_drake.app.package import extras
from riseg_drake.stations.lcm_channels import LcmConfig, open_lcm

NOT_HEARD = "udpm://239.255.76.67:{port}?ttl=0&recv_buf_size=4194304"


@pytest.fixture
def config(unused_port):
    return LcmConfig(url=NOT_HEARD.format(port=unused_port))


@pytest.fixture
def unused_port():
    return 20000 + os.getpid() % 20000


@pytest.fixture
def still(monkeypatch):
    """A doctor that looks at the machine only."""
    monkeypatch.setattr(command.network, "drivers", lambda config: [])


@pytest.mark.usefixtures("still")
def test_where_the_main_job_works_it_ends_with_0_and_has_a_line_for_each_extra(capsys):
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"^ok +images are drawn \(EGL\): a wall at 1 m has a depth of 1\.000 m$", said, re.M)
    for extra in extras():
        assert len(re.findall(rf"^(ok|--) +extra {extra}: ", said, re.M)) == 1
    assert said.endswith("`riseg run` and `riseg segment` work here\n")


@pytest.mark.usefixtures("still")
def test_without_graphics_it_ends_with_1_and_says_what_to_install(monkeypatch, capsys):
    def none():
        raise NoGraphicsError("install the packages libegl1")

    monkeypatch.setattr(machine, "require_graphics", none)
    assert main(["doctor"]) == 1
    said = capsys.readouterr().out
    assert re.search(r"^no +images are drawn \(EGL\): no; install the packages libegl1$", said, re.M)
    assert said.endswith("cannot work: images are drawn (EGL)\n")


@pytest.mark.usefixtures("still")
def test_what_only_a_real_robot_needs_does_not_end_it_with_1(monkeypatch, capsys):
    def refused(*_):
        raise PermissionError

    monkeypatch.setattr(machine.os, "sched_setscheduler", refused)
    monkeypatch.setattr(machine.os, "sched_getaffinity", lambda _: {3})
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"^-- +real-time priority: not granted; .*rtprio", said, re.M)
    assert re.search(r"^-- +cores: 1; ", said, re.M)


def test_the_priority_that_it_tries_is_not_kept():
    before = os.sched_getscheduler(0)
    machine.real_time_priority()
    assert os.sched_getscheduler(0) == before


def test_a_place_for_kernels_that_nobody_can_write_is_named(monkeypatch):
    monkeypatch.setattr(machine.os, "access", lambda *_: False)
    found = machine.kernel_cache()
    assert not found.is_well
    assert not found.is_needed
    assert "NUMBA_CACHE_DIR" in found.remedy


def test_it_hears_itself_on_a_network_that_works_and_says_how_where_it_does_not(config, monkeypatch):
    assert network.loopback(config).is_well
    unknown = network.loopback(LcmConfig(url="pigeon://"))
    assert not unknown.is_well
    assert "multicast on" in unknown.remedy


def test_a_driver_that_speaks_is_heard_with_its_rate_and_a_silent_one_is_told_to_start(config, monkeypatch):
    speaking = open_lcm(config)
    config.status_channel = "ARM"

    class Speaking:
        """The network, on which the arm and a stranger speak once at each look."""

        def __init__(self):
            self.lcm = open_lcm(config)

        def SubscribeAllChannels(self, hear):
            self.lcm.SubscribeAllChannels(hear)

        def HandleSubscriptions(self, milliseconds):
            speaking.Publish("ARM", b"1")
            speaking.Publish("STRANGER", b"1")
            self.lcm.HandleSubscriptions(milliseconds)

    monkeypatch.setattr(network, "open_lcm", lambda config: Speaking())
    arm, camera, others = network.drivers(config)
    assert arm.is_well
    assert re.fullmatch(r"ARM at [1-9]\d* Hz", arm.says)
    assert not camera.is_well
    assert "riseg emulate" in camera.remedy
    assert others.says == "STRANGER"
