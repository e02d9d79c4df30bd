"""The project without its learned parts: nothing heavy is imported, and what is missing is said."""

import subprocess
import sys

import pytest

from riseg_drake.learned.model_error import ModelError, require

THE_NETWORK_ITSELF = {f"riseg_drake.learned.{name}" for name in ("raft", "raft_checkpoint", "raft_training")}
"""What is imported only once somebody wants RAFT."""


@pytest.mark.renders
def test_the_whole_program_is_imported_without_torch():
    program = (
        "import importlib, pkgutil, sys\n"
        "import riseg_drake\n"
        "names = [m.name for m in pkgutil.walk_packages(riseg_drake.__path__, 'riseg_drake.')]\n"
        f"for name in set(names) - {THE_NETWORK_ITSELF} - {{'riseg_drake.__main__'}}:\n"
        "    importlib.import_module(name)\n"
        "print(len(names) > 100, [m for m in ('torch', 'transformers', 'torchvision') if m in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True []"


def test_what_is_not_installed_is_named_with_the_extra_that_brings_it():
    with pytest.raises(ModelError, match=r"no_such_module cannot be imported .*riseg-drake\[raft\]"):
        require("no_such_module", extra="raft")
