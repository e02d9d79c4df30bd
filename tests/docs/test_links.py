"""Links between pages and into the checkout lead somewhere, on a code host as on the site."""

import re

import pytest
from markdown_it import MarkdownIt

from tests.docs.pages import CHECKOUT, PAGES, name


def links(page):
    for token in MarkdownIt().enable("table").parse(page.read_text()):
        for child in token.children or ():
            target = child.attrs.get("href") or child.attrs.get("src")
            if target and "://" not in str(target):
                yield str(target)
            if child.type == "html_inline":  # pictures of a given width
                yield from re.findall(r'src="([^"]*)"', child.content)


def anchors(page):
    """Of all headings, as code hosts make them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", [*PAGES, CHECKOUT / "CHANGELOG.md"], ids=name)
def test_links_lead_somewhere(page):
    for link in links(page):
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_every_page_is_in_the_list_of_pages_and_in_the_contents_of_the_site():
    pages = {page.stem for page in (CHECKOUT / "docs").glob("*.md")} - {"README"}
    assert pages <= {link.removesuffix(".md") for link in links(CHECKOUT / "docs" / "README.md")}
    assert pages <= set(re.findall(r"^   ([\w/]+)$", (CHECKOUT / "docs" / "index.rst").read_text(), re.M))


def test_the_readme_fits_on_two_screens_and_its_pictures_stand_in_one_line():
    text = (CHECKOUT / "README.md").read_text()
    assert len(text.splitlines()) <= 90
    assert not re.findall(r"^!\[", text, re.M)
    (line,) = [line for line in text.splitlines() if line.startswith("<img ")]
    pictures = re.findall(r'src="([^"]*)" width="(\d+)%"', line)
    assert [name for name, _ in pictures] == ["docs/pictures/run.webp", "docs/pictures/live.jpg"]
    assert sum(int(width) for _, width in pictures) <= 98
    assert all((CHECKOUT / name).stat().st_size < 400_000 for name, _ in pictures)
    assert set(links(CHECKOUT / "README.md")) >= {name for name, _ in pictures}
