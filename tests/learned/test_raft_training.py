"""Training learns, repeats itself, and writes what the loader reads."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch (pip install 'riseg-drake[raft]')")

from riseg_drake.learned.raft_checkpoint import load_raft  # noqa: E402
from riseg_drake.learned.raft_training import TrainingParameters, end_point_errors, save, train  # noqa: E402
from riseg_drake.learned.rigid_motion_pairs import PairParameters, draw_pair  # noqa: E402

QUICK = TrainingParameters(steps=2, batch=1, iterations=2, pairs=PairParameters(width=128, height=128))


def test_training_repeats_itself_and_its_file_is_loaded_again(tmp_path):
    told = []
    network = train(0, QUICK, lambda step, *_: told.append(step))
    assert told == [1, 2]
    save(network, tmp_path / "weights" / "raft.pth")
    loaded, again = load_raft(tmp_path / "weights" / "raft.pth"), train(0, QUICK)
    for key, tensor in network.state_dict().items():
        torch.testing.assert_close(loaded.state_dict()[key], tensor, rtol=0, atol=0)
        torch.testing.assert_close(again.state_dict()[key], tensor, rtol=0, atol=0)
    assert any(p.abs().sum() > 0 for p in network.parameters())


def test_the_end_point_error_is_the_distance_to_the_true_flow():
    pair = draw_pair(np.random.default_rng(0), QUICK.pairs)
    assert end_point_errors(lambda *_: pair.flow, [pair]) == (0.0, 0.0)
    off = end_point_errors(lambda *_: pair.flow + np.float32([3, 4]), [pair])
    assert off == pytest.approx((5.0, 5.0), abs=1e-4)
