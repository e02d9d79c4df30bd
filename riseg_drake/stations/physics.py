"""Drake's simulator, and what is said where it finds no solution to what bodies do to each other."""

from pydrake.systems.analysis import Simulator


class PhysicsError(RuntimeError):
    """A simulation that cannot go on; says in one line when, why, and what would help."""


def advance(simulator: Simulator, time: float) -> None:
    """Simulate up to a time, s, or until a monitor stops it. Raises PhysicsError where Drake itself fails.

    What a system written in Python raises is not touched.
    """
    try:
        simulator.AdvanceTo(time)
    except (RuntimeError, SystemExit) as error:  # SystemExit: Drake's assertions
        if error.__traceback__ is not None and error.__traceback__.tb_next is not None:  # some Python's own
            raise
        raise physics_error(str(error), simulator.get_context().get_time()) from error


def physics_error(message: str, time: float) -> PhysicsError:
    """What to say of a message of Drake's from a time, s: its first sentence."""
    why = " ".join(message.split()).split(". ")[0].rstrip(".")
    return PhysicsError(
        f"the simulation failed after {time:.3f} s: {why}; another seed or a shorter station.time_step may help"
    )
