import numpy as np
import pytest

from riseg_drake.segmentation.observation import bond_evidence, motion_posterior

SHARE = np.array([0.8, 0.2])


def test_standing_still_together_says_little_and_a_rare_motion_shared_says_much():
    # Superpixels 0 and 1 stand still for sure, 2 and 3 move for sure: log 1/0.8 and log 1/0.2.
    q = np.array([[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]])
    evidence = bond_evidence(q, SHARE, np.array([[0, 1], [2, 3]]))
    assert evidence == pytest.approx([np.log(1.25), np.log(5.0)])


def test_moving_apart_is_as_bad_as_outliers_allow():
    # Costs say nothing with a probability of 2 %: q = (0.98 + 0.016, 0.004) and (0.016, 0.98 + 0.004).
    nats = np.array([[0.0, 100.0], [100.0, 0.0]])
    q = motion_posterior(nats, SHARE, outlier=0.02)
    assert q[:, 0] == pytest.approx([0.996, 0.004])
    assert q[:, 1] == pytest.approx([0.016, 0.984])
    expected = np.log(0.996 * 0.016 / 0.8 + 0.004 * 0.984 / 0.2)
    assert bond_evidence(q, SHARE, np.array([[0, 1]])) == pytest.approx([expected])
    assert expected < -3


def test_who_says_nothing_is_no_evidence():
    q = motion_posterior(np.array([[0.0, 0.0], [0.0, 50.0]]), SHARE, outlier=0.02)
    assert q[:, 0] == pytest.approx(SHARE)
    assert bond_evidence(q, SHARE, np.array([[0, 1]])) == pytest.approx([0.0])


def test_costs_and_commonness_weigh_as_bayes_has_it():
    # Two nats for the rare motion: odds 0.2 e^2 to 0.8.
    q = motion_posterior(np.array([[2.0], [0.0]]), SHARE, outlier=0.0)
    assert q[1, 0] == pytest.approx(0.2 * np.e**2 / (0.2 * np.e**2 + 0.8))
