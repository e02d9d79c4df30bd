import numpy as np
import pytest

from riseg_drake.app.bench import driver
from riseg_drake.app.cli import main


@pytest.mark.parametrize("mode", ["position", "velocity"])
def test_the_swing_is_followed_and_every_cycle_of_it_takes_some_time(mode):
    seconds = driver.swing_times(mode, 600)
    assert seconds.shape == (600,)
    assert (seconds > 0).all()


def test_a_driver_that_does_not_follow_is_no_measurement(monkeypatch):
    monkeypatch.setattr(driver, "SWING", 3.0)  # at 4.7 rad/s
    with pytest.raises(RuntimeError, match="did not follow"):
        driver.swing_times("position", 600)


def test_of_cycles_that_do_the_same_the_least_time_is_the_drivers_own(monkeypatch, capsys):
    times = iter(1e-3 * np.array([[0.1, 0.2, 5.0], [0.1, 3.0, 0.2], [0.4, 0.4, 0.4], [0.4, 0.4, 0.4]]))
    monkeypatch.setattr(driver, "REPETITIONS", 2)
    monkeypatch.setattr(driver, "be_prompt", lambda priority: None)
    monkeypatch.setattr(driver, "swing_times", lambda mode, cycles: next(times))
    assert main(["bench", "--driver"]) == 0
    rows = [line.replace("│", " ").split() for line in capsys.readouterr().out.splitlines() if ", " in line]
    figures = {" ".join(row[:-3]): row[-3:] for row in rows if row[0] in ("position,", "velocity,")}
    assert figures["position, the driver's own"] == ["0.20", "0.20", "0.20"]
    assert figures["position, measured"] == ["0.20", "4.99", "5.00"]
    assert figures["velocity, measured"] == ["0.40", "0.40", "0.40"]
