"""The scenario chooses the flow."""

import numpy as np
import pytest

from riseg_drake.app.flow_method import OpticalFlowParameters, flow_method
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import ScenarioError, parse_scenario
from riseg_drake.learned.model_error import ModelError
from riseg_drake.segmentation.optical_flow import DisFlow


def chosen(text):
    return parse_scenario(text, Scenario, source="scene.yaml").optical_flow


def test_without_a_word_it_is_dense_inverse_search():
    assert chosen("").kind == "dis"
    assert isinstance(flow_method(OpticalFlowParameters()), DisFlow)
    assert chosen("optical_flow: {dis: {preset: fast}}").dis.preset == "fast"


def test_raft_is_chosen_with_its_weights():
    text = "optical_flow: {kind: raft, raft: {checkpoint: raft-things.pth, iterations: 8, device: cpu}}"
    raft = chosen(text).raft
    assert (raft.checkpoint, raft.iterations, raft.device) == ("raft-things.pth", 8, "cpu")


def test_a_file_that_is_not_there_is_named():
    pytest.importorskip("torch", reason="RAFT needs torch (pip install 'riseg-drake[raft]')")
    with pytest.raises(ModelError, match=r"raft-things\.pth is not there"):
        flow_method(chosen("optical_flow: {kind: raft, raft: {checkpoint: raft-things.pth}}"))


def test_another_kind_is_refused_with_the_choices():
    with pytest.raises(ScenarioError, match=r"optical_flow\.kind must be one of dis, raft, not 'flownet'"):
        chosen("optical_flow: {kind: flownet}")


def test_the_weights_of_a_scenario_give_its_flow(tmp_path):
    torch = pytest.importorskip("torch", reason="RAFT needs torch (pip install 'riseg-drake[raft]')")
    from riseg_drake.learned.raft import RAFT_SMALL, Raft
    from riseg_drake.learned.raft_training import save

    torch.manual_seed(0)
    save(Raft(RAFT_SMALL), tmp_path / "raft.pth")
    raft = f"{{checkpoint: {tmp_path / 'raft.pth'}, iterations: 1, device: cpu}}"
    flow = flow_method(chosen(f"optical_flow: {{kind: raft, raft: {raft}}}"))(
        *np.zeros((2, 96, 128, 3), np.uint8)
    )
    assert flow.shape == (96, 128, 2)
