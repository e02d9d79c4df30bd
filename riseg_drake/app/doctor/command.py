"""`riseg doctor`: what this machine and this installation can do, a line each, with the remedy."""

from collections.abc import Iterator
from pathlib import Path

from rich.console import Console

from riseg_drake.app.doctor import machine, network
from riseg_drake.app.doctor.finding import Finding
from riseg_drake.app.package import extras, package_version
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.host.terminal import one_line
from riseg_drake.stations.lcm_channels import LcmConfig

LACKING = 1
"""Exit code: something is missing that simulating and segmenting need."""


def doctor_command(scenario_file: Path | None, console: Console) -> int:
    """Look everything over, and say it as it is found; returns the exit code, 0 where the main job works."""
    config = load_scenario(scenario_file, HARDWARE).hardware.lcm
    console.print(f"riseg {package_version()}", highlight=False)
    missing = []
    for finding in _findings(config):
        color, mark = ("green", "ok") if finding.is_well else ("yellow", "--")
        if not finding.is_well and finding.is_needed:
            color, mark = "red", "no"
            missing.append(finding.about)
        remedy = f"; {finding.remedy}" if finding.remedy else ""
        line = one_line(f"{mark}  {finding.about}: {finding.says}{remedy}")
        console.print(line, style=color, highlight=False, soft_wrap=True)
    if missing:
        console.print(f"`riseg run` and `riseg segment` cannot work: {', '.join(missing)}", highlight=False)
        return LACKING
    console.print("`riseg run` and `riseg segment` work here", highlight=False)
    return 0


def _findings(config: LcmConfig) -> Iterator[Finding]:
    yield machine.rendering()
    yield machine.cores()
    yield machine.kernel_cache()
    yield machine.real_time_priority()
    yield network.receive_buffers(config)
    yield network.loopback(config)
    yield from network.drivers(config)
    for extra, unmet in extras().items():
        remedy = f"optional: pip install 'riseg-drake[{extra}]'" if unmet else ""
        says = f"lacks {', '.join(unmet)}" if unmet else "installed"
        yield Finding(f"extra {extra}", not unmet, says, remedy)
