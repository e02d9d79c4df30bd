import pytest
from drake import lcmt_drake_signal, lcmt_panda_command

from riseg_drake.stations.driver_reasons import reasons_message, told_reasons


def test_state_and_names_come_out_as_they_went_in_stamped_in_milliseconds():
    message = reasons_message("takes no commands", ["joint_reflex", "power_limit_violation"], 12.3456)
    heard = lcmt_drake_signal.decode(message.encode())
    assert (heard.timestamp, heard.dim) == (12345, 3)
    assert told_reasons(message.encode()) == "takes no commands: joint_reflex, power_limit_violation"


def test_a_state_without_reasons_stands_alone():
    assert told_reasons(reasons_message("holds", [], 1.0).encode()) == "holds"
    assert told_reasons(reasons_message("holds", [""], 1.0).encode()) == "holds"


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff" * 40,
        lcmt_panda_command().encode(),
        lcmt_drake_signal().encode(),
        reasons_message("holds \x1b[2J", [], 1.0).encode(),
    ],
)
def test_what_is_no_such_message_says_nothing(data):
    assert told_reasons(data) == ""
