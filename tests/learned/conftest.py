"""torchvision's RAFT as an independent reference, where torchvision is installed."""

from importlib.util import find_spec
from types import ModuleType

import pytest

if find_spec("torch"):
    import torch

    # The tests are too small for more, and threads wait long for each other where something else runs, too.
    torch.set_num_threads(1)

if find_spec("torch") and find_spec("torchvision"):
    # Beside a CPU build of torch its compiled operators are not there; RAFT uses none. Imported before anyone
    # else does: transformers imports torchvision where it is installed, and would stumble over them.
    register = torch.library.register_fake

    def register_what_is_there(op, *arguments, **options):
        if str(op).startswith("torchvision::"):
            return lambda function: function
        return register(op, *arguments, **options)

    torch.library.register_fake = register_what_is_there
    import torchvision.models.optical_flow  # noqa: F401

    torch.library.register_fake = register


@pytest.fixture(scope="session")
def reference() -> ModuleType:
    """torchvision's `optical_flow`."""
    return pytest.importorskip(
        "torchvision.models.optical_flow",
        reason="the reference needs torchvision (pip install --no-deps torchvision==0.28.0)",
    )
