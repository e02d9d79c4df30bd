"""The project without its learned parts: nothing heavy is imported, and what is missing is said."""

import subprocess
import sys

import pytest

from riseg_drake.learned.model_error import ModelError, require


def test_the_whole_program_is_imported_without_torch():
    program = (
        "import sys\n"
        "import riseg_drake.app.bench, riseg_drake.app.cli, riseg_drake.app.diagram\n"
        "import riseg_drake.app.evaluate, riseg_drake.app.run, riseg_drake.learned.sam\n"
        "import riseg_drake.learned.raft_flow, riseg_drake.systems.mask_refiner\n"
        "print([m for m in ('torch', 'transformers', 'torchvision') if m in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_what_is_not_installed_is_named_with_the_extra_that_brings_it():
    with pytest.raises(ModelError, match=r"no_such_module cannot be imported .*riseg-drake\[raft\]"):
        require("no_such_module", extra="raft")
