"""Many scenes at once: in processes of this machine, or on a Dask cluster. The scene is the unit of work."""

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol

from joblib import Parallel, cpu_count, delayed, parallel_config
from joblib.externals.loky.backend import resource_tracker as loky_resource_tracker
from joblib.externals.loky.process_executor import TerminatedWorkerError

from riseg_drake.app.evaluate.scene_folder import SceneTask, note_death
from riseg_drake.app.evaluate.scene_work import SceneOutcome, work_on
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output import RECORDING
from riseg_drake.host.processes import deaf_children, end_with_parent, undisturbed
from riseg_drake.recording.whole_file import write_bytes

Work = Callable[[SceneTask], SceneOutcome]


class PoolError(ValueError):
    """Why processes, or a Dask cluster, cannot be used, in one line."""


class Pool(Protocol):
    """Does the work on scenes, in any order, and gives the outcome of each as soon as it is there."""

    def __call__(self, tasks: Sequence[SceneTask]) -> Iterator[SceneOutcome]:
        """Work on all of them."""


def pool_for(jobs: int, dask: str | None) -> Pool:
    """Processes of this machine, which must be able to draw, or the Dask cluster at an address.

    Raises NoGraphicsError, PoolError.
    """
    if dask is not None:
        return cluster_pool(dask)
    pool = local_pool(jobs)
    require_graphics()
    return pool


def local_pool(jobs: int, work: Work = work_on) -> Pool:
    """A pool of `jobs` processes, each with its share of the threads; with one job, this very process.

    Raises PoolError where the system has no room for what they share.
    """
    if jobs == 1:
        return lambda tasks: map(work, [replace(task, threads=cpu_count()) for task in tasks])
    with _refusals():
        get_context().Lock()  # joblib would go on with threads instead

    def outcomes(tasks: Sequence[SceneTask]) -> Iterator[SceneOutcome]:
        threads = max(1, cpu_count() // jobs)
        left = {task.folder: replace(task, threads=threads) for task in tasks}
        while left:
            try:
                for outcome in _parallel(work, list(left.values()), jobs):
                    del left[outcome.task.folder]
                    yield outcome
            except TerminatedWorkerError:
                # One process died (of the graphics driver, or for want of memory) and took its fellows
                # with it. Scenes are handed out in their order, so it was at one of the first; at which, is
                # found by trying them again, one at a time.
                for task in list(left.values())[:jobs]:
                    del left[task.folder]
                    yield _alone(task, work)

    return outcomes


def cluster_pool(address: str, work: Work = work_on) -> Pool:
    """A running Dask cluster. Its workers need riseg_drake installed, but none of our folders.

    Raises PoolError if Dask is not installed or nobody answers at the address.
    """
    try:
        from distributed import Client
    except ImportError:
        raise PoolError("--dask needs Dask: pip install 'riseg-drake[dask]'") from None
    try:
        client = Client(address, timeout=5)
    except (OSError, ValueError) as error:
        raise PoolError(f"no Dask scheduler answers at {address} ({type(error).__name__})") from None

    def outcomes(tasks: Sequence[SceneTask]) -> Iterator[SceneOutcome]:
        with client, parallel_config(backend="dask"):
            scenes = Parallel(return_as="generator_unordered", batch_size=1)(
                delayed(_work_away)(task, work) for task in tasks
            )
            folders = {task.folder: task for task in tasks}
            with closing(scenes):
                for folder, outcome, files in scenes:
                    for name, content in files.items():
                        (folder / name).parent.mkdir(parents=True, exist_ok=True)
                        write_bytes(folder / name, content)
                    yield replace(outcome, task=folders[folder])

    return outcomes


def _parallel(work: Work, tasks: Sequence[SceneTask], jobs: int) -> Iterator[SceneOutcome]:
    with (
        parallel_config(backend="loky", n_jobs=jobs, inner_max_num_threads=tasks[0].threads),
        warnings.catch_warnings(),
        ExitStack() as stack,
    ):
        # joblib replaces a process that has grown between two scenes, and ends those that nobody waits for; it
        # wonders aloud about both.
        warnings.filterwarnings("ignore", message="A worker stopped", category=UserWarning)
        warnings.filterwarnings("ignore", message=".* tasks which were still being", category=UserWarning)
        with _refusals():
            loky_resource_tracker.ensure_running()  # which may unblock signals, as Python's does
            # Ctrl-C is the parent's to hear, and the processes' end is the parent's to bring.
            with undisturbed(), deaf_children():
                outcomes = Parallel(return_as="generator_unordered", batch_size=1)(
                    delayed(_work_below)(task, work, os.getpid()) for task in tasks
                )
                stack.enter_context(closing(outcomes))
        yield from outcomes


@contextmanager
def _refusals() -> Iterator[None]:
    """What the system refuses in a `with` raises PoolError."""
    try:
        yield
    except OSError as error:
        raise PoolError(
            f"no processes for several jobs can be started ({error.strerror}; is /dev/shm usable?); "
            "--jobs 1 needs none"
        ) from None


def _work_below(task: SceneTask, work: Work, parent: int) -> SceneOutcome:
    """The work, in a process that ends with its parent."""
    end_with_parent(parent)
    return work(task)


def _alone(task: SceneTask, work: Work) -> SceneOutcome:
    try:
        (outcome,) = _parallel(work, [task], jobs=2)  # with one job it would not be a process apart
    except TerminatedWorkerError:
        failure = "its process died; it was out of memory, or the renderer broke"
        note_death(task, failure)
        return SceneOutcome(task, failure, seconds=0.0)
    return outcome


def _work_away(task: SceneTask, work: Work) -> tuple[Path, SceneOutcome, dict[str, bytes]]:
    """Work on another machine: in a folder of its own, of which all but the recording comes back."""
    with TemporaryDirectory() as place:
        folder = Path(place) / task.folder.name
        outcome = work(replace(task, folder=folder))
        files = {
            str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob("*"))
            if path.is_file() and RECORDING not in path.relative_to(folder).parts
        }
    return task.folder, outcome, files
