"""The programs around RAFT: timing it, and training it."""

import pytest
from rich.console import Console

from riseg_drake.app import train_raft
from riseg_drake.app.bench import raft as raft_bench
from riseg_drake.app.cli import main
from riseg_drake.learned.rigid_motion_pairs import PairParameters

pytest.importorskip("torch", reason="RAFT needs torch (pip install 'riseg-drake[raft]')")


def test_the_bench_times_both_networks_and_says_where(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(raft_bench, "REPETITIONS", 1)
    path = tmp_path / "scene.yaml"
    path.write_text(
        "station: {camera: {width: 128, height: 128, cx: 63.5, cy: 63.5}}\n"
        "optical_flow: {raft: {iterations: 1, device: cpu}}\n"
    )
    assert main(["bench", "--raft", str(path)]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "128x128 pair, 1 iterations" in printed
    assert "CPU thread" in printed
    assert "raft_small" in printed
    assert "raft_large" in printed


@pytest.mark.renders
def test_training_leaves_a_checkpoint_and_reports_beside_dense_inverse_search_and_zero_flow(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(train_raft, "UNSEEN", {"small": (1, PairParameters(width=128, height=128))})
    monkeypatch.setattr(train_raft, "Console", lambda: Console(width=200))
    file = tmp_path / "raft.pth"
    assert train_raft.main([str(file), "--steps", "1", "--seed", "3"]) == 0
    assert file.stat().st_size > 3e6
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert {"RAFT", "DIS", "zero"} <= {word for row in rows for word in row}
