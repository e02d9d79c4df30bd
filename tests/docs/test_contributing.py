"""What CONTRIBUTING promises: pre-commit runs what .ci/run checks of style and types."""

import re

import yaml

from tests.docs.pages import CHECKOUT


def test_pre_commit_has_the_checks_of_ci_and_fetches_nothing():
    content = yaml.safe_load((CHECKOUT / ".pre-commit-config.yaml").read_text())
    (local,) = content["repos"]
    assert local["repo"] == "local"
    assert {hook["language"] for hook in local["hooks"]} == {"system"}
    checks = {hook["entry"].replace(" --force-exclude", "") for hook in local["hooks"]}
    in_ci = re.findall(r"^ *((?:ruff|mypy)\b.*)$", (CHECKOUT / ".ci" / "run").read_text(), re.M)
    assert checks == {line.removesuffix(" .") for line in in_ci}
