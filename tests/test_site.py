"""The docs site: every page in its navigation, every public name once, and no link of the built site leads nowhere."""

from __future__ import annotations

import os
import posixpath
import re
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote

import pytest

import mjtactile
from mjtactile._installed import DOCUMENTATION, page_address
from mjtactile.errors import ContactError

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
NAVIGATION = (ROOT / "mkdocs.yml").read_text().split("\nnav:\n")[1].split("\n\n")[0]
API = (DOCS / "api.md").read_text()


def test_the_api_page_lists_every_public_name_once():
    assert sorted(re.findall(r"^::: mjtactile\.(\w+)$", API, flags=re.MULTILINE)) == sorted(mjtactile.__all__)


@pytest.mark.parametrize("package", mjtactile._PACKAGES)
def test_the_api_page_lists_every_public_name_of_a_package_once(package):
    """An error may stand there as a name of mjtactile."""
    public = set(getattr(mjtactile, package).__all__) - set(mjtactile.__all__)
    listed = re.findall(rf"^::: mjtactile\.{package}\.(\w+)$", API, flags=re.MULTILINE)
    if package == "recognition":
        (members,) = re.findall(r"^      members: \[(.+)\]$", API, flags=re.MULTILINE)
        listed += members.split(", ")
    assert sorted(listed) == sorted(public)


def test_the_site_has_one_address():
    """What errors name, what the package says of itself, and what the built pages call their own."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        assert tomllib.load(file)["project"]["urls"]["Documentation"] == DOCUMENTATION
    assert f"site_url: {DOCUMENTATION} " in (ROOT / "mkdocs.yml").read_text()


def test_every_page_is_in_the_navigation_once():
    pages = [path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")]
    named = re.findall(r"(\S+\.md)$", NAVIGATION, flags=re.MULTILINE)
    assert sorted(page for page in named if not page.startswith("source/")) == sorted(pages)


def test_tutorials_come_in_the_order_a_newcomer_needs():
    names = re.findall(r"tutorials/([\w-]+)\.md", NAVIGATION)
    assert names == ["press", "pad-on-my-hand", "plugin-in-xml", "policy", "dataset", "own-pad", "curved-pad"]
    for name, following in pairwise(names):
        assert f"({following}.md)" in (DOCS / "tutorials" / f"{name}.md").read_text().rsplit("Next:", 1)[1]


class Page(HTMLParser):
    """What a page links to, and what of it can be linked to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if value and key in ("href", "src"):
                self.links.append(value)
            elif value and key in ("id", "name"):
                self.anchors.add(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> dict[str, Page]:
    """Pages of the site as it was just built, by path; any warning is an error."""
    if find_spec("mkdocs") is None:
        pytest.skip("mkdocs is not installed: pip install 'mjtactile[docs]'")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    others = {path.relative_to(folder).as_posix(): Page("") for path in folder.rglob("*") if path.is_file()}
    pages = {path.relative_to(folder).as_posix(): Page(path.read_text()) for path in folder.rglob("*.html")}
    return others | pages


@pytest.mark.slow
def test_links_of_the_built_site_lead_to_what_is_there(site):
    broken = []
    for name, page in site.items():
        for link in page.links:
            path, _, anchor = link.partition("#")
            if re.match(r"[a-z]+:", path) or name == "404.html":
                continue
            target = posixpath.normpath(posixpath.join(posixpath.dirname(name), unquote(path))) if path else name
            target = "index.html" if target == "." else target
            found = site.get(target) or site.get(f"{target}/index.html")
            if found is None or (anchor and target.endswith(".html") and unquote(anchor) not in found.anchors):
                broken.append(f"{name}: {link}")
    assert not broken
    assert sum(len(page.links) for page in site.values()) > 1000


@pytest.mark.slow
def test_public_names_have_their_docstrings_on_the_site(site):
    assert {f"mjtactile.{name}" for name in mjtactile.__all__} <= site["api.html"].anchors


@pytest.mark.slow
def test_addresses_that_errors_name_are_those_of_built_pages(site):
    assert page_address(str(ContactError.page)).removeprefix(DOCUMENTATION) in site


@pytest.mark.slow
def test_nothing_is_fetched_from_elsewhere(site):
    for name, page in site.items():
        if name.endswith(".html"):
            fetched = [link for link in page.links if re.match(r"(https?:)?//", link)]
            assert not [link for link in fetched if re.search(r"\.(js|css|png|svg|woff2?)$", link)], name
