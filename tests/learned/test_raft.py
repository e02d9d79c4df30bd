"""The network against torchvision's, with the same random weights."""

import pytest

torch = pytest.importorskip("torch", reason="RAFT needs torch (pip install 'riseg-drake[raft]')")

from riseg_drake.learned.raft import RAFT_LARGE, RAFT_SMALL, Raft  # noqa: E402
from riseg_drake.learned.raft_checkpoint import network_of  # noqa: E402


def images(height, width, seed=0):
    generator = torch.Generator().manual_seed(seed)
    return torch.rand((2, 2, 3, height, width), generator=generator) * 2 - 1


@pytest.mark.parametrize("title", ["raft_small", "raft_large"])
def test_the_same_weights_give_the_flow_that_torchvision_gives(reference, title):
    torch.manual_seed(1)
    other = getattr(reference, title)(weights=None).eval()
    for module in other.modules():  # statistics as after training, not the neutral ones of the start
        if isinstance(module, torch.nn.BatchNorm2d):
            module.running_mean.normal_(0, 0.1)
            module.running_var.uniform_(0.5, 1.5)
    network = network_of(other.state_dict(), "torchvision").eval()
    image_0, image_1 = images(128, 160)
    with torch.no_grad():
        expected = other(image_0, image_1, num_flow_updates=6)[-1]
        (flow,) = network(image_0, image_1, iterations=6)
    assert expected.abs().max() > 0.1
    torch.testing.assert_close(flow, expected, rtol=0, atol=1e-4)


@pytest.mark.parametrize(("size", "millions"), [(RAFT_SMALL, 1.0), (RAFT_LARGE, 5.3)])
def test_the_network_has_as_many_parameters_as_the_paper_says(size, millions):
    assert sum(p.numel() for p in Raft(size).parameters()) / 1e6 == pytest.approx(millions, abs=0.05)


def test_in_training_every_iteration_has_its_flow_and_every_weight_its_gradient():
    network = Raft(RAFT_SMALL).train()
    flows = network(*images(128, 128), iterations=3)
    assert [tuple(flow.shape) for flow in flows] == [(2, 2, 128, 128)] * 3
    sum(flow.abs().mean() for flow in flows).backward()
    assert all(p.grad is not None for p in network.parameters())
