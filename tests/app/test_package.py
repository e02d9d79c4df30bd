import tomllib
from importlib.metadata import Distribution, PackageNotFoundError
from pathlib import Path

import pytest

from riseg_drake.app import package

ABOUT = """Metadata-Version: 2.4
Name: riseg-drake
Version: 3.2.1
Requires-Dist: numpy>=2.0
Requires-Dist: riseg-drake[small]; extra == "all"
Requires-Dist: there>=1.9; extra == "small"
Requires-Dist: nowhere>=4; extra == "large"
Requires-Dist: there>=1.11; extra == "large"
Requires-Dist: nowhere; extra == "elsewhere" and python_version < "3"
Provides-Extra: all
Provides-Extra: small
Provides-Extra: large
Provides-Extra: elsewhere
"""


@pytest.fixture
def installed(monkeypatch):
    """The package as above, and one other distribution."""

    class Made(Distribution):
        def read_text(self, filename):
            return ABOUT if filename == "METADATA" else None

        def locate_file(self, path):
            return Path(path)

    def version(name):
        if name not in (there := {"riseg-drake": "3.2.1", "there": "1.10.0+cpu"}):
            raise PackageNotFoundError(name)
        return there[name]

    monkeypatch.setattr(package, "metadata", lambda name: Made().metadata)
    monkeypatch.setattr(package, "version", version)


@pytest.mark.usefixtures("installed")
def test_an_extra_lacks_what_is_missing_or_too_old_and_nothing_of_the_package_itself():
    assert package.extras() == {
        "all": [],
        "elsewhere": [],
        "large": ["nowhere>=4", "there>=1.11"],  # 1.10 is older than 1.11, and newer than 1.9
        "small": [],
    }
    assert package.package_version() == "3.2.1"


def test_the_extras_are_those_of_the_project():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert set(package.extras()) == set(project["optional-dependencies"])


def test_a_package_that_is_not_installed_has_no_version_and_no_extras(monkeypatch):
    monkeypatch.setattr(package, "NAME", "riseg-drake-of-nobody")
    assert package.package_version() == "not installed"
    assert package.extras() == {}
