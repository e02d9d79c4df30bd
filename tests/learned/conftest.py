"""torchvision's RAFT as an independent reference."""

from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def reference() -> ModuleType:
    """torchvision's `optical_flow`; its compiled operators, which RAFT does not use, may be missing."""
    torch = pytest.importorskip("torch")
    register = torch.library.register_fake

    def register_what_is_there(op, *arguments, **options):
        if str(op).startswith("torchvision::"):
            return lambda function: function
        return register(op, *arguments, **options)

    torch.library.register_fake = register_what_is_there
    try:
        return pytest.importorskip("torchvision.models.optical_flow")
    finally:
        torch.library.register_fake = register
