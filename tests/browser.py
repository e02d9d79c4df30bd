"""A headless Chromium with software graphics, for the pages that people look at."""

import shutil
import subprocess
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec

WIDE, NARROW = (1400, 900), (400, 800)
"""Views, pixels: a desk's and a telephone's."""
PATIENCE = 120_000
"""ms; software graphics on a busy machine are slow."""
_PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
_GRAPHICS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")

PROGRAM = next(filter(None, map(shutil.which, _PROGRAMS)), None)
NO_PROGRAM = "" if PROGRAM else "there is no Chromium: apt-get install chromium"
"""Why no page can be opened; empty where it can."""
MISSING = (
    NO_PROGRAM
    if PROGRAM is None
    else ""
    if find_spec("playwright")
    else "there is no playwright: pip install -e '.[browser]'"
)
"""Why no page can be looked at; empty where it can."""


def dumped(file, *options):
    """What a page has become once its scripts have run, and all that the browser said; needs no playwright."""
    given = ("--headless", "--no-sandbox", "--disable-gpu", *options, "--dump-dom")
    done = subprocess.run([PROGRAM, *given, file.as_uri()], capture_output=True, text=True, check=True)
    return done.stdout, done.stderr


class Page:
    """One page that is open, with what it complained of."""

    def __init__(self, page):
        self._page = page
        self.complaints = []
        page.on("console", self._hear)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))

    def _hear(self, message):
        if message.type == "error":
            self.complaints.append(f"{message.text} ({message.location.get('url', '')})")

    def ask(self, expression):
        """The value of a JavaScript expression."""
        return self._page.evaluate(expression)

    def wait(self, expression):
        """Wait until a JavaScript expression is true."""
        self._page.wait_for_function(expression, timeout=PATIENCE)

    def picture(self, file):
        """A PNG of what is seen."""
        self._page.screenshot(path=file, timeout=PATIENCE)


@contextmanager
def opened(url, size=WIDE):
    """A page in a browser of its own."""
    with import_module("playwright.sync_api").sync_playwright() as playwright:
        # Without a sandbox: where tests run as root Chromium has none.
        browser = playwright.chromium.launch(
            executable_path=PROGRAM, args=["--no-sandbox", "--ignore-gpu-blocklist", *_GRAPHICS]
        )
        try:
            page = Page(browser.new_page(viewport=dict(zip(("width", "height"), size, strict=True))))
            page._page.goto(url, timeout=PATIENCE)
            yield page
        finally:
            browser.close()
