"""Pictures of Meshcat's page as a browser shows it: `python -m tests.app.meshcat_pictures PAGE [FOLDER]`.

PAGE is a replay.html or the address of a run that is going on; a replay is shown half way through, too.
"""

import argparse
from pathlib import Path

from tests.browser import MISSING, NARROW, WIDE, opened

SETTLED = "viewer.scene_tree.find(['riseg', 'panel']).object.children.length > 0"
SHARES = (0.5, 1.0)
"""Where a replay is looked at, as shares of its time."""


def main():
    """Write a PNG for each width, and each moment of a replay."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page")
    parser.add_argument("folder", type=Path, nargs="?", default=Path())
    chosen = parser.parse_args()
    if MISSING:
        parser.error(MISSING)
    is_live = chosen.page.startswith("http")
    url = chosen.page if is_live else Path(chosen.page).resolve().as_uri()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    for size in (WIDE, NARROW):
        with opened(url, size) as page:
            page.wait(SETTLED)
            for share in (None,) if is_live else SHARES:
                name = "live" if share is None else f"replay_{100 * share:.0f}"
                if share is not None:
                    page.wait("viewer.animator.duration > 0")
                    page.ask(
                        "(share => { const s = document.querySelector('#riseg-track input');"
                        f" s.value = s.max * share; s.oninput(); }})({share})"
                    )
                file = chosen.folder / f"{name}_{size[0]}.png"
                page.picture(file)
                print(file, *page.complaints)


if __name__ == "__main__":
    main()
