"""The film of a run, without one: which pictures it shows."""

from types import SimpleNamespace

import numpy as np

from riseg_drake.app.show import film as module


def test_every_eighth_picture_is_shown_and_what_was_decided_last(monkeypatch):
    """Twenty frames that carry their number as the colour, and a last step of the colour 200."""
    shown = []

    def interactions(wired, clock, progress, longest, listeners):
        for number in range(20):
            for listener in listeners:
                listener(SimpleNamespace(sequence=number, color=np.full((4, 6, 3), number, np.uint8)), number)
        yield SimpleNamespace(color=np.full((4, 6, 3), 200, np.uint8), mask="last")

    wired = SimpleNamespace(
        diagram=SimpleNamespace(GetSubsystemByName=str),
        intrinsics=SimpleNamespace(width=6, height=4),
        mask=lambda context: f"mask {context}",
    )
    monkeypatch.setattr(module, "make_diagram", lambda *_: wired)
    monkeypatch.setattr(module, "Onlooker", lambda *_: SimpleNamespace(look=lambda context: context))
    monkeypatch.setattr(module, "interactions", interactions)
    monkeypatch.setattr(module, "draw_masks", lambda color, mask: (int(color[0, 0, 0]), mask))
    monkeypatch.setattr(module, "side_by_side", lambda seen, arm, *_: shown.append((*seen, arm)) or len(shown))
    pictures, steps = module.film_run(SimpleNamespace(longest=1.0), 0, lambda progress: None)
    assert shown == [(0, "mask 0", 0), (8, "mask 8", 8), (16, "mask 16", 16), (200, "last", 19)]
    assert pictures == [1, 2, 3, 4]
    assert [step.mask for step in steps] == ["last"]
