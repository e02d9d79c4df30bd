"""Pictures of Meshcat's page as a browser shows it: `python -m tests.app.meshcat_pictures PAGE [FOLDER]`.

PAGE is a replay.html or the address of a run that is going on; a replay is shown half way through, too. With
`--readme` the replay's only picture is `live.jpg`, without buttons and slider: the one that README shows.
"""

import argparse
from pathlib import Path

from PIL import Image

from tests.browser import MISSING, NARROW, WIDE, opened

SETTLED = "viewer.scene_tree.find(['riseg', 'panel']).object.children.length > 0"
SHARES = (0.5, 1.0)
"""Where a replay is looked at, as shares of its time."""
README_SIZE, README_SHARE = (640, 604), 0.5
"""As high as the film beside it, at 30 and 68 % of the page's width."""
HIDDEN = "<style>#riseg-time, .lil-gui, .dg { display: none !important }</style>"


def main():
    """Write a PNG for each width, and each moment of a replay; or README's picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page")
    parser.add_argument("folder", type=Path, nargs="?", default=Path())
    parser.add_argument("--readme", action="store_true")
    chosen = parser.parse_args()
    if MISSING:
        parser.error(MISSING)
    is_live = chosen.page.startswith("http")
    url = chosen.page if is_live else Path(chosen.page).resolve().as_uri()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    if chosen.readme:
        picture_of_readme(url, chosen.folder / "live.jpg")
        return
    for size in (WIDE, NARROW):
        with opened(url, size) as page:
            page.wait(SETTLED)
            for share in (None,) if is_live else SHARES:
                name = "live" if share is None else f"replay_{100 * share:.0f}"
                if share is not None:
                    turn_to(page, share)
                file = chosen.folder / f"{name}_{size[0]}.png"
                page.picture(file)
                print(file, *page.complaints)


def turn_to(page, share):
    """Show a replay's moment, as a share of its time."""
    page.wait("viewer.animator.duration > 0")
    page.ask(
        "(share => { const s = document.querySelector('#riseg-track input');"
        f" s.value = s.max * share; s.oninput(); }})({share})"
    )


def picture_of_readme(url, file):
    """The replay's view alone, as a JPEG."""
    with opened(url, README_SIZE) as page:
        page.wait(SETTLED)
        turn_to(page, README_SHARE)
        page.ask(f"document.head.insertAdjacentHTML('beforeend', '{HIDDEN}')")
        # At this width the list would be cut.
        page.ask("viewer.scene_tree.find(['riseg', 'board']).object.visible = false")
        page.picture(file.with_suffix(".png"))
    with Image.open(file.with_suffix(".png")) as picture:
        picture.convert("RGB").save(file, quality=86)
    file.with_suffix(".png").unlink()
    print(f"{file}: {file.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
