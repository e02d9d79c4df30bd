"""Checkpoints in both spellings: every tensor has its place, and what is wrong is named."""

import pickle

import pytest

torch = pytest.importorskip("torch", reason="RAFT needs torch (pip install 'riseg-drake[raft]')")

from riseg_drake.learned.model_error import ModelError  # noqa: E402
from riseg_drake.learned.raft import RAFT_LARGE, RAFT_SMALL, Raft  # noqa: E402
from riseg_drake.learned.raft_checkpoint import (  # noqa: E402
    load_raft,
    network_of,
    princeton_names,
    torchvision_names,
)

SIZES = {"raft_small": RAFT_SMALL, "raft_large": RAFT_LARGE}
SPELLINGS = {"princeton": princeton_names, "torchvision": torchvision_names}


def spelled(network, spelling, prefix=""):
    """A network's tensors as a checkpoint has them."""
    own = network.state_dict()
    return {prefix + name: own[key] for name, key in SPELLINGS[spelling](network.size).items()}


def names_of_the_authors(large: bool) -> set[str]:
    """What the authors' files contain, written down from how their network is built."""
    norm = ("weight", "bias", "running_mean", "running_var", "num_batches_tracked")
    names = set()

    def conv(name):
        names.update((f"{name}.weight", f"{name}.bias"))

    for net in ("fnet", "cnet"):
        has_norm = large and net == "cnet"  # instance norms have no tensors, and the small cnet has no norm
        conv(f"{net}.conv1")
        conv(f"{net}.conv2")
        norms = [f"{net}.norm1"]
        for layer in (1, 2, 3):
            for block in (0, 1):
                place = f"{net}.layer{layer}.{block}"
                for k in (1, 2) if large else (1, 2, 3):
                    conv(f"{place}.conv{k}")
                    norms.append(f"{place}.norm{k}")
            if layer > 1:
                conv(f"{net}.layer{layer}.0.downsample.0")
                norms += [f"{net}.layer{layer}.0.downsample.1", f"{net}.layer{layer}.0.norm3"]
        if has_norm:
            names.update(f"{place}.{part}" for place in norms for part in norm)
    for part in ("c1", "c2", "f1", "f2", "") if large else ("c1", "f1", "f2", ""):
        conv(f"update_block.encoder.conv{part}")
    for gate in "zrq":
        for number in (1, 2) if large else ("",):
            conv(f"update_block.gru.conv{gate}{number}")
    conv("update_block.flow_head.conv1")
    conv("update_block.flow_head.conv2")
    if large:
        conv("update_block.mask.0")
        conv("update_block.mask.2")
    return names


@pytest.mark.parametrize(("title", "tensors"), [("raft_small", 106), ("raft_large", 179)])
def test_every_tensor_of_the_authors_files_has_its_place(title, tensors):
    names = princeton_names(SIZES[title])
    assert set(names) == names_of_the_authors(large=title == "raft_large")
    assert len(names) == tensors
    assert set(names.values()) == set(Raft(SIZES[title]).state_dict())


@pytest.mark.parametrize(("title", "tensors"), [("raft_small", 106), ("raft_large", 169)])
def test_every_tensor_of_torchvisions_files_has_its_place(reference, title, tensors):
    theirs = getattr(reference, title)(weights=None).state_dict()
    names = torchvision_names(SIZES[title])
    assert set(names) == set(theirs)
    assert len(names) == tensors
    own = Raft(SIZES[title]).state_dict()
    assert set(names.values()) == set(own)
    assert {name: tensor.shape for name, tensor in theirs.items()} == {
        name: own[key].shape for name, key in names.items()
    }


@pytest.mark.parametrize("title", SIZES)
@pytest.mark.parametrize(
    ("spelling", "prefix"), [("princeton", ""), ("princeton", "module."), ("torchvision", "")]
)
def test_a_file_in_any_spelling_gives_the_network_that_was_saved(tmp_path, title, spelling, prefix):
    torch.manual_seed(3)
    network = Raft(SIZES[title])
    torch.save(spelled(network, spelling, prefix), tmp_path / "raft.pth")
    loaded = load_raft(tmp_path / "raft.pth")
    assert loaded.size == network.size
    assert not loaded.training
    for key, tensor in network.state_dict().items():
        torch.testing.assert_close(loaded.state_dict()[key], tensor, rtol=0, atol=0)


def test_what_is_missing_or_too_much_is_named_as_the_file_spells_it():
    tensors = spelled(Raft(RAFT_SMALL), "princeton", "module.")
    del tensors["module.update_block.gru.convz.bias"]
    tensors["module.mystery"] = torch.zeros(1)
    with pytest.raises(ModelError) as error:
        network_of(tensors, "x.pth")
    assert str(error.value) == (
        "x.pth is not raft_small: it lacks update_block.gru.convz.bias and has also mystery"
    )


def test_half_a_checkpoint_says_how_much_more_it_lacks():
    tensors = spelled(Raft(RAFT_LARGE), "torchvision")
    half = {name: tensor for name, tensor in tensors.items() if name.startswith("feature_encoder")}
    with pytest.raises(ModelError, match=r"not raft_large: it lacks context_encoder\..* and \d+ more$"):
        network_of(half, "x.pth")


def test_a_tensor_of_another_shape_is_named():
    tensors = spelled(Raft(RAFT_SMALL), "torchvision")
    tensors["update_block.flow_head.conv2.bias"] = torch.zeros(3)
    with pytest.raises(ModelError, match=r"has update_block.flow_head.conv2.bias \[3\], not \[2\]"):
        network_of(tensors, "x.pth")


def test_another_network_is_refused():
    with pytest.raises(ModelError, match=r"no checkpoint of RAFT: it has no tensor such as"):
        network_of({"layer1.weight": torch.zeros(1)}, "resnet.pth")


class Evil:
    """Makes a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


def test_nothing_in_a_file_is_executed(tmp_path):
    torch.save({"a": Evil(tmp_path / "made")}, tmp_path / "evil.pth")
    with pytest.raises(ModelError, match="no checkpoint that can be loaded as plain tensors") as error:
        load_raft(tmp_path / "evil.pth")
    assert "weights_only" not in str(error.value)  # nobody is told how to run it after all
    assert not (tmp_path / "made").exists()


def test_what_is_no_checkpoint_is_refused_in_one_line(tmp_path):
    (tmp_path / "notes.txt").write_text("not a checkpoint")
    (tmp_path / "list.pkl").write_bytes(pickle.dumps([1, 2]))
    torch.save({"epoch": 3}, tmp_path / "epoch.pth")
    for name in ("notes.txt", "list.pkl", "epoch.pth", "nowhere.pth"):
        with pytest.raises(ModelError) as error:
            load_raft(tmp_path / name)
        assert name in str(error.value)
        assert "\n" not in str(error.value)
