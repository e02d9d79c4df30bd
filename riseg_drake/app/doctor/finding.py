"""One line of what `riseg doctor` says."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """What was found out about one thing."""

    about: str
    """The thing, in a few words."""
    is_well: bool
    says: str
    """What was found, in words and figures."""
    remedy: str = ""
    """What would be right, or what lacks without it; only where it is not well."""
    is_needed: bool = False
    """Whether simulating and segmenting need it; the rest is for a real robot, or optional."""
