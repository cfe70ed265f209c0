"""Hooks of the docs site: what a page links to outside docs/ becomes part of the site, under source/.

Pages link to the code they speak of, by paths that lead there in the repository, too. Pages of the repository's root
(README, CONTRIBUTING, CHANGELOG) become pages of the site; other files are served as they are.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

_LINK = re.compile(r"(\]\()([^)\s#]+)(#[^)\s]*)?(\))")
#: Where files from outside docs/ go.
_SOURCE = "source"


def _outside(docs: Path, page: str, target: str) -> str | None:
    """The path below the repository's root of what a page links to outside docs/; None for anything else."""
    if re.match(r"[a-z]+:", target):
        return None
    found = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), target))
    inside = found == "docs" or found.startswith(("docs/", ".."))
    return None if inside or not (docs.parent / found).is_file() else found


def on_files(files: Files, config: Any) -> Files:
    """Add what pages link to."""
    docs = Path(config.docs_dir)
    waiting = [(page.src_uri, Path(str(page.abs_src_path)).read_text()) for page in files.documentation_pages()]
    while waiting:
        page, text = waiting.pop()
        for match in _LINK.finditer(text):
            outside = _outside(docs, page, match[2])
            if outside is None or files.get_file_from_path(f"{_SOURCE}/{outside}") is not None:
                continue
            path = docs.parent / outside
            if path.suffix == ".md":
                moved = _moved(docs, posixpath.join("..", outside), path.read_text(), f"{_SOURCE}/{outside}")
                files.append(File.generated(config, f"{_SOURCE}/{outside}", content=moved))
                waiting.append((posixpath.join("..", outside), path.read_text()))
            else:
                files.append(File.generated(config, f"{_SOURCE}/{outside}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, *, page: Any, config: Any, **_: Any) -> str:
    """Lead links to where the files are on the site."""
    if page.file.src_uri.startswith(f"{_SOURCE}/"):
        return markdown  # led already
    return _moved(Path(config.docs_dir), page.file.src_uri, markdown, page.file.src_uri)


def _moved(docs: Path, page: str, markdown: str, now: str) -> str:
    """A page's text with its links as they must be on the site.

    Args:
        docs: folder of the pages.
        page: where its links start from, below docs/.
        markdown: its text.
        now: where it stands on the site.
    """

    def lead(match: re.Match[str]) -> str:
        if re.match(r"[a-z]+:", match[2]):
            return match[0]
        outside = _outside(docs, page, match[2])
        there = posixpath.normpath(posixpath.join(posixpath.dirname(page), match[2]))
        target = f"{_SOURCE}/{outside}" if outside is not None else there.removeprefix("../docs/")
        return f"{match[1]}{posixpath.relpath(target, posixpath.dirname(now) or '.')}{match[3] or ''}{match[4]}"

    return _LINK.sub(lead, markdown)
