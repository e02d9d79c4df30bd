import os
from pathlib import Path

import pytest

from riseg_drake.robot.kinematics import PandaKinematics


@pytest.fixture(scope="session")
def official_models() -> str:
    """Folder of an offline copy of drake_models: $RISEG_DRAKE_MODELS, or shared/drake_models near by."""
    repository = Path(__file__).parents[2]
    nearby = [parent / "shared" / "drake_models" for parent in repository.parents]
    named = os.environ.get("RISEG_DRAKE_MODELS")
    for folder in [Path(named)] if named else nearby:
        if (folder / "package.xml").is_file():
            return str(folder)
    pytest.skip("no offline copy of drake_models: set RISEG_DRAKE_MODELS to compare with the official Panda")


@pytest.fixture(scope="module")
def panda() -> PandaKinematics:
    return PandaKinematics()
