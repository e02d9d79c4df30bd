"""RAFT's public checkpoints, in both spellings of their tensors' names.

princeton-vl (the authors; often with `module.` before every name) and torchvision.
"""

import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from zipfile import ZipFile

import torch
from torch import Tensor

from riseg_drake.host.files import is_file
from riseg_drake.learned.model_error import ModelError
from riseg_drake.learned.raft import RAFT_LARGE, RAFT_SMALL, Raft, RaftSize

SIZES = {"raft_small": RAFT_SMALL, "raft_large": RAFT_LARGE}
_PARALLEL = "module."
"""What torch's DataParallel puts before every name."""
MOST_BYTES = 2**28
"""Of a checkpoint, unpacked; the large network has a tenth of that."""
MOST_NAMED = 8
"""Tensors that an error names; it must stay one line that can be read."""
_GATES = {"update": "convz", "reset": "convr", "candidate": "convq"}


def load_raft(path: Path) -> Raft:
    """The network of a checkpoint file, small or large as its tensors say, ready to be used.

    Raises ModelError: no such file, no checkpoint, or one with other tensors, named.
    """
    network = network_of(read_checkpoint(path), str(path))
    return network.eval().requires_grad_(False)


def read_checkpoint(path: Path) -> dict[str, Tensor]:
    """The tensors of a file by name. Nothing in the file is executed (`weights_only`). Raises ModelError."""
    if not is_file(path):
        raise ModelError(f"{path} is not there; give the file of a RAFT checkpoint (see docs/learned.md)")
    _check_size(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # torch wonders aloud about what is damaged
            content = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:
        # pickle, zip and torch each have their own, and torch's words advise to run what is in the file.
        raise ModelError(
            f"{path} is no checkpoint that can be loaded as plain tensors, which is all that is loaded here "
            f"({type(error).__name__})"
        ) from None
    if not isinstance(content, Mapping) or not all(isinstance(t, Tensor) for t in content.values()):
        raise ModelError(f"{path} holds no state dict: it must be names and tensors, nothing else")
    return dict(content)


def _check_size(path: Path) -> None:
    """Raise ModelError for a file that is too large, or would be once it is unpacked."""
    size = path.stat().st_size
    try:
        with ZipFile(path) as archive:
            size = max(size, sum(entry.file_size for entry in archive.infolist()))
    except Exception:  # not packed, or damaged: torch says so
        pass
    if size > MOST_BYTES:
        raise ModelError(f"{path} holds {size / 2**20:.0f} MB; no RAFT has more than {MOST_BYTES / 2**20:g}")


def network_of(tensors: Mapping[str, Tensor], source: str) -> Raft:
    """The network that has these tensors; `source` names them in errors (ModelError)."""
    names = {re.sub(f"^{re.escape(_PARALLEL)}", "", name): name for name in tensors}
    given = {short: tensors[name] for short, name in names.items()}
    # The size and the spelling that fit best: a partial checkpoint is then told what it lacks.
    candidates = [
        (size, spelling, title)
        for title, size in SIZES.items()
        for spelling in (princeton_names, torchvision_names)
    ]
    size, spelling, title = max(candidates, key=lambda c: _fitting(c[0], c[1](c[0]), given))
    own, expected = _own_shapes(size), spelling(size)
    missing = sorted(set(expected) - set(given))
    unknown = sorted(set(given) - set(expected))
    if len(missing) == len(expected):
        raise ModelError(f"{source} is no checkpoint of RAFT: it has no tensor such as {missing[0]}")
    if missing or unknown:
        wrong = [f"lacks {_list(missing)}"] * bool(missing) + [f"has also {_list(unknown)}"] * bool(unknown)
        raise ModelError(f"{source} is not {title}: it {' and '.join(wrong)}")
    shapes = [
        f"{name} {list(given[name].shape)}, not {list(own[key])}"
        for name, key in expected.items()
        if given[name].shape != own[key]
    ]
    if shapes:
        raise ModelError(f"{source} is not {title}: it has {_list(shapes)}")
    network = Raft(size)
    network.load_state_dict({key: given[name] for name, key in expected.items()})
    return network


def princeton_names(size: RaftSize) -> dict[str, str]:
    """What the authors call each tensor -> what it is called here. Some have two names there."""
    # The large network has two recurrent units, and numbers them.
    names = {_princeton(key, numbered=size.is_large): key for key in _own_shapes(size)}
    # The normalisation of a shortcut is also known as the third of its block; the small network has none.
    twice = {
        name.replace("downsample.1", "norm3"): key for name, key in names.items() if "downsample.1" in name
    }
    return {**names, **twice}


def torchvision_names(size: RaftSize) -> dict[str, str]:
    """What torchvision calls each tensor -> what it is called here."""
    return {_torchvision(key): key for key in _own_shapes(size)}


@cache
def _own_shapes(size: RaftSize) -> dict[str, torch.Size]:
    """What each tensor is called here, and its shape."""
    # Not on the device "meta", for which PyTorch imports for seconds; nor shall anyone's random numbers change.
    with torch.random.fork_rng(devices=[]):
        return {key: tensor.shape for key, tensor in Raft(size).state_dict().items()}


def _princeton(key: str, numbered: bool) -> str:
    return _renamed(
        key,
        (
            (r"^features\.", "fnet."),
            (r"^context\.", "cnet."),
            (r"\.stem\.(conv|norm)\.", r".\g<1>1."),
            (r"\.stages\.(\d)\.(\d)\.", lambda m: f".layer{int(m[1]) + 1}.{m[2]}."),
            (r"\.convs\.(\d)\.(conv|norm)\.", lambda m: f".{m[2]}{int(m[1]) + 1}."),
            (r"\.shortcut\.conv\.", ".downsample.0."),
            (r"\.shortcut\.norm\.", ".downsample.1."),
            (r"\.last\.", ".conv2."),
            (r"^motion\.correlation\.(\d)\.", lambda m: f"update_block.encoder.convc{int(m[1]) + 1}."),
            (r"^motion\.flow\.(\d)\.", lambda m: f"update_block.encoder.convf{int(m[1]) + 1}."),
            (r"^motion\.join\.", "update_block.encoder.conv."),
            (
                r"^gru\.(\d)\.(\w+)\.",
                lambda m: f"update_block.gru.{_GATES[m[2]]}{int(m[1]) + 1 if numbered else ''}.",
            ),
            (r"^flow_head\.convs\.(\d)\.", lambda m: f"update_block.flow_head.conv{int(m[1]) // 2 + 1}."),
            (r"^upsampling\.", "update_block.mask."),
        ),
    )


def _torchvision(key: str) -> str:
    return _renamed(
        key,
        (
            (r"^features\.", "feature_encoder."),
            (r"^context\.", "context_encoder."),
            (r"\.stem\.conv\.", ".convnormrelu.0."),
            (r"\.stem\.norm\.", ".convnormrelu.1."),
            (r"\.stages\.(\d)\.(\d)\.", lambda m: f".layer{int(m[1]) + 1}.{m[2]}."),
            (
                r"\.convs\.(\d)\.(conv|norm)\.",
                lambda m: f".convnormrelu{int(m[1]) + 1}.{('conv', 'norm').index(m[2])}.",
            ),
            (r"\.shortcut\.conv\.", ".downsample.0."),
            (r"\.shortcut\.norm\.", ".downsample.1."),
            (r"\.last\.", ".conv."),
            (
                r"^motion\.correlation\.(\d)\.",
                lambda m: f"update_block.motion_encoder.convcorr{int(m[1]) + 1}.0.",
            ),
            (r"^motion\.flow\.(\d)\.", lambda m: f"update_block.motion_encoder.convflow{int(m[1]) + 1}.0."),
            (r"^motion\.join\.", "update_block.motion_encoder.conv.0."),
            (
                r"^gru\.(\d)\.(\w+)\.",
                lambda m: f"update_block.recurrent_block.convgru{int(m[1]) + 1}.{_GATES[m[2]]}.",
            ),
            (r"^flow_head\.convs\.(\d)\.", lambda m: f"update_block.flow_head.conv{int(m[1]) // 2 + 1}."),
            (r"^upsampling\.0\.", "mask_predictor.convrelu.0."),
            (r"^upsampling\.2\.", "mask_predictor.conv."),
        ),
    )


_Rule = tuple[str, str | Callable[[re.Match[str]], str]]


def _renamed(key: str, rules: Sequence[_Rule]) -> str:
    for pattern, replacement in rules:
        key = re.sub(pattern, replacement, key)
    return key


def _fitting(size: RaftSize, names: Mapping[str, str], given: Mapping[str, Tensor]) -> int:
    """How many of the given tensors have a name and a shape that a network of this size knows."""
    own = _own_shapes(size)
    return sum(name in given and given[name].shape == own[key] for name, key in names.items())


def _list(names: Sequence[str]) -> str:
    """All names, so that nobody has to guess; a whole lost room is too long for one line."""
    shown = ", ".join(names[:MOST_NAMED])
    return shown if len(names) <= MOST_NAMED else f"{shown} and {len(names) - MOST_NAMED} more"
