"""What can be wrong with a learned model, said in one line."""

from importlib import import_module
from types import ModuleType


class ModelError(ValueError):
    """Why a learned model cannot be used, for the person who gave its file or folder."""


def require(module: str, extra: str) -> ModuleType:
    """A module that only a learned part needs; ModelError names the extra that brings it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ModelError(f"{module} cannot be imported ({error}); pip install 'riseg-drake[{extra}]'") from None


def torch_device(name: str) -> str:
    """The device that a scenario means: "auto" is the GPU where there is one, else the CPU.

    Raises ModelError for a device that is not there.
    """
    torch = require("torch", "raft")
    if name == "auto":
        return "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError) as error:
        raise ModelError(f"no device {name!r} here ({str(error).splitlines()[0]}); try auto or cpu") from None
    return name
