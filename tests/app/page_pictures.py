"""Pictures of pages as a browser shows them, on a desk and on a telephone:

python -m tests.app.page_pictures out/simulation_seed_0/replay.html out/simulation_seed_0/report.html site
python -m tests.app.page_pictures http://localhost:7000 --folder pictures

A PAGE is a file, the folder of a site, or the address at which a run that goes on is seen; a replay is shown
half way through, too. With `--readme` the replay's only picture is `live.jpg`, without buttons and slider: the
one that README shows.
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
    """Write a PNG for each page and width, and each moment of a replay; or README's picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="+", metavar="PAGE")
    parser.add_argument("--folder", type=Path, default=Path(), help="where the pictures go (here)")
    parser.add_argument("--readme", action="store_true")
    chosen = parser.parse_args()
    if MISSING:
        parser.error(MISSING)
    chosen.folder.mkdir(parents=True, exist_ok=True)
    for given in chosen.pages:
        if chosen.readme:
            picture_of_readme(address(given), chosen.folder / "live.jpg")
            continue
        for size in (WIDE, NARROW):
            take_pictures(given, size, chosen.folder)


def address(given):
    """Of a page that is a file, a site's folder, or an address already."""
    if given.startswith("http"):
        return given
    path = Path(given).resolve()
    return (path / "index.html" if path.is_dir() else path).as_uri()


def take_pictures(given, size, folder):
    """A PNG of a page at a size, pixels, or of each moment of a replay, and what the browser complained of."""
    with opened(address(given), size) as page:
        name = "live" if given.startswith("http") else Path(given).stem
        shares = [None]
        if name in ("live", "replay"):
            page.wait(SETTLED)
            shares = SHARES if name == "replay" else [None]
        for share in shares:
            file = folder / f"{name}{'' if share is None else f'_{100 * share:.0f}'}_{size[0]}.png"
            if share is not None:
                turn_to(page, share)
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
