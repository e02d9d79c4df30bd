"""`report.html` of a suite: the worst scene of every kind, and all figures."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from riseg_drake.app.evaluate.page import end_of, last_view, worst_first
from riseg_drake.app.report_page import Moment, Report, Table, View, report_html, told_facts
from riseg_drake.evaluation.ablation_report import TITLE, ablation_failures, ablation_table
from riseg_drake.evaluation.suite_report import KindResult, kinds_table, moved_table, of_all_kinds, scenes_table


def suite_page(kinds: Sequence[KindResult], folder: Path, about: Mapping[str, object]) -> str:
    """The page, as HTML, of the suite in a folder; `about` are its settings, by name.

    A kind none of whose pictures can be read is shown without.
    """
    views: list[View] = []
    moments: list[Moment] = []
    for kind in kinds:
        for scene in worst_first(kind.scenes):
            seen = last_view(scene, folder / kind.folder / scene.name)
            if seen is not None:
                moments.append(Moment(f"{kind.name}: seed {scene.seed}", [end_of(scene)], [len(views)]))
                views.append(seen)
                break
    settings = [(name, str(value)) for name, value in about.items()]
    scenes, last_step = of_all_kinds(kinds)
    tables = {
        "After the last interaction, in percent, and what one picture alone gives": kinds_table(kinds),
        "In motion, in percent, and what was moved": moved_table(kinds),
        "The scenes, in percent": scenes_table(kinds),
    }
    ablation = ablation_table(scenes, last_step)
    if ablation:
        tables[f"{TITLE}, over all kinds, in percent"] = ablation
    return report_html(
        Report(
            title=f"A suite of {len(scenes)} scenes of {len(kinds)} kinds",
            facts=[*told_facts(), *settings],
            ending="Of each kind the scene with the lowest Overlap F; the folder of each has a page with more.",
            views=views,
            moments=moments,
            objects=None,
            doubts=[
                f"{kind.name}, {scene.name} (seed {scene.seed}) failed: {scene.failure}"
                for kind in kinds
                for scene in kind.scenes
                if scene.failure
            ]
            + ablation_failures(scenes),
            tables=[Table(title, table.head, table.rows) for title, table in tables.items()],
        )
    )
