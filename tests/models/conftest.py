import pytest

from riseg_drake.stations.object_models import ObjectModel, find_models


@pytest.fixture(scope="module")
def models(request) -> dict[str, ObjectModel]:
    """By name, those of the test file's MODELS."""
    return {model.name: model for model in find_models(request.module.MODELS)}


@pytest.fixture
def model(models, request) -> ObjectModel:
    return models[request.param]
