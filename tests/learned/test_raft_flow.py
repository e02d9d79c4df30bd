"""RAFT as a flow method: images of any size, and one line for what cannot be."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="RAFT needs torch (pip install 'riseg-drake[raft]')")

from riseg_drake.learned.model_error import ModelError  # noqa: E402
from riseg_drake.learned.raft import RAFT_SMALL, Raft  # noqa: E402
from riseg_drake.learned.raft_checkpoint import torchvision_names  # noqa: E402
from riseg_drake.learned.raft_flow import (  # noqa: E402
    RaftFlow,
    RaftFlowParameters,
    load_raft_flow,
    to_image_tensor,
)


class Differences(torch.nn.Module):
    """Stands in for a network: the flow is the red and green of image 1 less those of image 0."""

    def forward(self, image_0, image_1, iterations):
        assert image_0.shape[-1] % 8 == image_0.shape[-2] % 8 == 0
        assert min(image_0.shape[-2:]) >= 128
        return [(image_1 - image_0)[:, :2] * 127.5]


def images(height, width):
    rng = np.random.default_rng(0)
    return rng.integers(0, 256, (2, height, width, 3)).astype(np.uint8)


@pytest.mark.parametrize("size", [(128, 160), (131, 165), (37, 200), (1, 1)])
def test_the_flow_of_any_size_lies_on_the_pixels_that_it_belongs_to(size):
    color_0, color_1 = images(*size)
    flow = RaftFlow(Differences(), device="cpu")(color_0, color_1)
    assert flow.dtype == np.float32
    expected = color_1[..., :2].astype(float) - color_0[..., :2]
    np.testing.assert_allclose(flow, expected, rtol=0, atol=1e-3)


def test_the_method_gives_what_the_network_gives():
    torch.manual_seed(0)
    network = Raft(RAFT_SMALL).requires_grad_(False).eval()
    color_0, color_1 = images(128, 136)
    flow = RaftFlow(network, device="cpu", iterations=3)(color_0, color_1)
    (expected,) = network(to_image_tensor(color_0), to_image_tensor(color_1), 3)
    np.testing.assert_allclose(flow, expected[0].permute(1, 2, 0).numpy(), rtol=0, atol=1e-5)
    np.testing.assert_array_equal(RaftFlow(network, "cpu", 3)(color_0, color_1), flow)


def test_a_scenarios_file_is_loaded(tmp_path):
    network = Raft(RAFT_SMALL)
    names = torchvision_names(RAFT_SMALL)
    torch.save({name: network.state_dict()[key] for name, key in names.items()}, tmp_path / "raft.pth")
    parameters = RaftFlowParameters(checkpoint=str(tmp_path / "raft.pth"), iterations=1, device="cpu")
    assert load_raft_flow(parameters)(*images(128, 128)).shape == (128, 128, 2)


@pytest.mark.parametrize(
    ("parameters", "says"),
    [
        (RaftFlowParameters(), "name their file in optical_flow.raft.checkpoint"),
        (RaftFlowParameters(checkpoint="nowhere.pth"), "nowhere.pth is not there"),
    ],
)
def test_a_scenario_without_weights_is_told_so(parameters, says):
    with pytest.raises(ModelError, match=says):
        load_raft_flow(parameters)


@pytest.mark.parametrize(
    ("device", "iterations", "says"), [("quantum", 1, "no device"), ("cpu", 0, "at least 1")]
)
def test_what_cannot_be_is_refused(device, iterations, says):
    with pytest.raises(ModelError, match=says):
        RaftFlow(Differences(), device, iterations)
