import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from riseg_drake.robot.target_playout import PlayoutParameters, TargetPlayout

PERIOD = 0.005


def swing(time):
    """A smooth motion of 2 s and its velocity; at rest before and after."""
    phase = np.clip(time, 0, 2) * np.pi
    return np.full(7, 0.2 * (1 - np.cos(phase))), np.full(7, 0.2 * np.pi * np.sin(phase))


def play(playout, seconds, feed=lambda now: (), start=0.0):
    """Targets of `feed(now)` go in as time goes on; what comes out, and when."""
    out = []
    for k in range(round(seconds / PERIOD)):
        for time, position in feed(start + k * PERIOD):
            playout.add(time, position)
        out.append(playout.advance(PERIOD))
    return out


def steadily(now):
    """A target every 10 ms for the time it is sent at."""
    tick = round(now / PERIOD)
    return [(now, swing(now)[0])] if tick % 2 == 0 else []


def test_nothing_is_played_out_before_the_first_target():
    assert TargetPlayout().advance(PERIOD) is None


def test_an_even_flow_comes_out_late_and_otherwise_unchanged():
    playout = TargetPlayout(PlayoutParameters(delay=0.5))
    out = play(playout, 3.5, steadily, start=-1.0)
    for k, target in enumerate(out):
        time = -1.0 + k * PERIOD - 0.5
        if time > -0.4:
            # The clock may be off by the age of the newest target.
            candidates = [swing(time + late) for late in np.arange(-0.015, 0.016, 0.0005)]
            assert min(np.abs(q - target.position).max() for q, _ in candidates) < 2e-4


def test_where_targets_run_out_the_motion_slows_down_smoothly_and_goes_on_later():
    playout = TargetPlayout()

    def halting(now):
        if 0.6 < now < 2.6:
            return []
        if abs(now - 2.6) < 1e-9:  # all that was missed, at once
            return [(t, swing(t)[0]) for t in np.arange(0.61, 2.6, 0.01)]
        return steadily(now)

    out = play(playout, 7, halting)
    positions = np.array([target.position[0] for target in out])
    accelerations = np.diff(positions, 2) / PERIOD**2
    # The clock slows at 2 /s, so that speeds of up to 0.63 rad/s change by 1.3 rad/s^2, on top of the
    # motion's own 2 rad/s^2.
    assert np.abs(accelerations).max() < 4
    assert positions[-1] == pytest.approx(swing(2)[0][0], abs=1e-6)
    standing = positions[round(2.2 / PERIOD) : round(2.5 / PERIOD)]
    assert np.ptp(standing) < 1e-4


def test_the_velocity_of_a_target_is_the_rate_at_which_positions_come_out():
    playout = TargetPlayout()
    out = play(playout, 3.5, steadily)
    positions = np.array([target.position for target in out])
    velocities = np.array([target.velocity for target in out])
    measured = (positions[2:] - positions[:-2]) / (2 * PERIOD)
    moving = np.abs(velocities[1:-1]).max(axis=1) > 0.3
    assert moving.sum() > 50
    np.testing.assert_allclose(measured[moving], velocities[1:-1][moving], atol=0.06)


def test_delay_that_has_grown_is_made_up_for_at_rest():
    playout = TargetPlayout(PlayoutParameters(delay=0.5))
    play(playout, 1, steadily, start=-1)
    play(playout, 0.3)  # silence at rest
    play(playout, 1, lambda now: steadily(now), start=0.0)
    assert playout.remaining >= 0.5 - 0.02
    play(playout, 4, steadily, start=1.0)
    assert playout.remaining == pytest.approx(0.5, abs=0.02)
    assert not playout.in_motion


def test_after_a_stop_it_goes_on_at_the_nearest_point_of_the_path():
    playout = TargetPlayout()
    for t in np.arange(0, 2, 0.01):
        playout.add(t, swing(t)[0])
    for _ in range(200):
        playout.advance(PERIOD)
    playout.halt()
    ahead = swing(playout.time + 0.1)[0]
    playout.resume_near(ahead)
    after = playout.advance(PERIOD)
    assert np.abs(after.position - ahead).max() < 0.01
    assert np.abs(after.velocity).max() < 0.05


@pytest.mark.parametrize("rate", [1.0, 0.5])
def test_between_uneven_targets_lies_the_cubic_whose_velocities_are_means_of_the_chords_beside_it(rate):
    times = np.cumsum([0.0, 0.01, 0.02, 0.01, 0.04, 0.02, 0.01])
    slope, bend = np.linspace(-0.3, 0.3, 7), np.linspace(0.5, -0.2, 7)
    playout = TargetPlayout()
    for t in times:
        playout.add(t, slope * t + bend * t**2)
    playout.rate = rate
    gaps = np.diff(times)
    # Of a parabola the chord over a gap is its velocity in the middle of it; at both ends it stands still.
    unlike = (gaps[1:] - gaps[:-1]) / 2
    v = np.zeros((7, 7))
    v[1:-1] = slope + bend * (2 * times[1:-1] + unlike)[:, None]
    a = np.zeros((7, 7))
    a[1:-1] = 2 * bend
    q = slope * times[:, None] + bend * times[:, None] ** 2
    cubic = CubicHermiteSpline(times, q, v)
    for k, start in enumerate(times[:-1]):
        for share in (0.0, 0.3, 0.999):
            target = playout._at(start + share * gaps[k])
            np.testing.assert_allclose(target.position, cubic(start + share * gaps[k]), atol=1e-12)
            expected = rate * cubic(start + share * gaps[k], 1)
            np.testing.assert_allclose(target.velocity, expected, atol=1e-9)
            blend = (1 - share) * a[k] + share * a[k + 1]
            np.testing.assert_allclose(target.acceleration, rate**2 * blend, atol=1e-9)


def test_the_first_target_is_played_out_late_by_the_delay_even_where_the_second_moves():
    playout = TargetPlayout(PlayoutParameters(delay=0.5))
    playout.add(1.0, np.zeros(7))
    assert playout.time == pytest.approx(0.5)
    playout.add(1.01, np.full(7, 1e-4))
    assert playout.time == pytest.approx(0.5)
    assert playout.in_motion


def test_targets_out_of_order_are_refused():
    playout = TargetPlayout()
    playout.add(1.0, np.zeros(7))
    with pytest.raises(ValueError, match="comes after"):
        playout.add(1.0, np.zeros(7))


def test_a_posture_may_be_held_as_long_as_it_likes_and_the_motion_after_it_begins_there():
    playout = TargetPlayout()
    held = swing(0.5)[0]
    for now in np.arange(0, 160, 0.02):
        playout.add(now, swing(min(now, 0.5) + max(now - 150.0, 0.0))[0])
        assert len(playout._times) < 200
        if 10 < now < 140:  # an operator thinks it over
            continue
        target = playout.advance(0.02)
        if 2 < now < 150:
            np.testing.assert_allclose(target.position, held, atol=1e-4)
    np.testing.assert_allclose(target.position, 0.0, atol=1e-6)


def test_an_arm_that_stopped_before_its_clock_did_goes_on_from_where_it_is():
    playout = TargetPlayout()
    for t in np.arange(0, 3, 0.01):
        playout.add(t, swing(t)[0])
    for _ in range(250):
        playout.advance(PERIOD)
    earlier = playout.time - 0.3
    assert playout.distance(swing(earlier)[0]) < 1e-3
    playout.resume_near(swing(earlier)[0])
    assert playout.time == pytest.approx(earlier, abs=0.01)
