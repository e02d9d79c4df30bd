import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

pytestmark = pytest.mark.renders

CHECKOUT = Path(__file__).parents[1]
NOWHERE = "http://127.0.0.1:9"
"""A proxy that answers nothing. (With DRAKE_ALLOW_NETWORK=none Drake's Parser cannot even be made.)"""


def run(*command, cwd, **environment):
    """The standard output of a command that sees neither the checkout nor the network."""
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env={**clean, "https_proxy": NOWHERE, "http_proxy": NOWHERE, "PIP_NO_INDEX": "1", **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The bin folder of a new environment, in which the wheel of this checkout is installed."""
    folder = tmp_path_factory.mktemp("installed")
    # A wheel is built from a copy: setuptools writes build/ beside the sources.
    source = folder / "source"
    source.mkdir()
    files = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "-z"],
        cwd=CHECKOUT,
        capture_output=True,
        text=True,
    )
    if files.returncode != 0:
        pytest.skip("this is no git checkout, so which files belong to the project is unknown")
    for name in filter(None, files.stdout.split("\0")):
        if (CHECKOUT / name).is_file() and not name.startswith("tests/"):
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(CHECKOUT / name, source / name)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    run(*pip, "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", folder, source, cwd=folder)
    (wheel,) = folder.glob("*.whl")

    environment = folder / "environment"
    venv.create(environment, with_pip=False)
    scheme = {"base": str(environment), "platbase": str(environment)}
    site_packages = Path(sysconfig.get_path("purelib", "venv", vars=scheme))
    # The dependencies are those of the running interpreter, but without its own (editable) riseg_drake:
    # in a folder that is added by a .pth file no further .pth files are read.
    dependencies = [path for path in sys.path if path.endswith("-packages")]
    (site_packages / "dependencies.pth").write_text("\n".join(dependencies) + "\n")
    run(*pip, "--python", environment, "install", "-q", "--no-deps", wheel, cwd=folder)
    return environment / "bin"


def test_an_installed_copy_is_used_and_not_the_checkout(installed, tmp_path):
    where = run(
        installed / "python", "-c", "import riseg_drake; print(riseg_drake.__file__)", cwd=tmp_path
    ).strip()
    assert Path(where).is_relative_to(installed.parent)


def test_an_installed_command_explains_itself(installed, tmp_path):
    assert "COMMAND" in run(installed / "riseg", "--help", cwd=tmp_path)
    assert "COMMAND" in run(installed / "python", "-m", "riseg_drake", "--help", cwd=tmp_path)


def there_and_tracked(installed, cwd, prefix, patterns):
    """Files of the installed package that match patterns, and those that git has, as paths in the checkout.

    There the package's folder is `prefix`.
    """
    program = (
        "from importlib.resources import files\n"
        "from pathlib import Path\n"
        "package = Path(str(files('riseg_drake')))\n"
        f"for pattern in {patterns!r}:\n"
        "    for path in package.glob(pattern):\n"
        "        if path.is_file() and '__pycache__' not in path.parts:\n"
        "            print(path.relative_to(package).as_posix())\n"
    )
    there = set(run(installed / "python", "-c", program, cwd=cwd).split("\n")) - {""}
    wanted = subprocess.run(
        ["git", "ls-files", *(f":(glob){prefix}{pattern}" for pattern in patterns)],
        cwd=CHECKOUT,
        capture_output=True,
        text=True,
        check=True,
    )
    return {prefix + path for path in there}, set(wanted.stdout.split("\n")) - {""}


def test_models_and_scenarios_are_installed_to_the_last_file(installed, tmp_path):
    there, wanted = there_and_tracked(installed, tmp_path, "", ["models/**/*", "diagrams/**/*"])
    assert there >= wanted
    assert there


def test_the_sample_and_the_templates_of_pages_are_installed_to_the_last_file(installed, tmp_path):
    patterns = ["recording/sample/**/*", "app/*.jinja", "app/*.html"]
    there, wanted = there_and_tracked(installed, tmp_path, "riseg_drake/", patterns)
    assert there == wanted
