"""The site's pages are the Markdown files of the repository, at their own paths, so that links among them are good in both.
Links to other files lead to the repository's pages, of the revision that the site is made from. Notebooks are pages too, and
the page of a robot ends with what the example report measured of it. The article is a PDF.
"""

import logging
import re
import subprocess
import sys
from pathlib import Path
from posixpath import dirname, join, normpath

import jupytext
from mkdocs.structure.files import File

sys.path.append(str(Path(__file__).parent))
import article  # noqa: E402
import measured  # noqa: E402

ROOT = Path(__file__).parents[2]
SHOWN = ("*.md", "docs/*.svg", "reports/example/*", ":!scripts/site")
NOTEBOOKS = "docs/notebooks/*.py"
ARTICLE = "docs/article/article.typ"
ROBOT = re.compile(r"robots/models/(\w+)/SOURCE\.md")
LINK = re.compile(r"(?<=\]\()([^()\s#]+)(?=[)#])")
FENCED = re.compile(r"^ *```.*?^ *```", re.DOTALL | re.MULTILINE)
UNSEPARATED = re.compile(r"^(?!#|- |\d+\. )\S.*\n(?:- |1\. ).*", re.MULTILINE)
log = logging.getLogger("mkdocs.hooks")


def git(*words: str) -> str:
    return subprocess.run(
        ["git", "-C", ROOT, *words], capture_output=True, check=True, text=True
    ).stdout.strip()


def tracked(*patterns: str) -> list[str]:
    listed = git("ls-files", "--cached", "--others", "--exclude-standard", *patterns).splitlines()
    return sorted(name for name in set(listed) if (ROOT / name).exists())


def on_config(config):
    config.extra["revision"] = git("rev-parse", "HEAD")


def on_files(files, config):
    for name in tracked(*SHOWN):
        files.append(File(name, str(ROOT), config.site_dir, config.use_directory_urls))
    for name in tracked(NOTEBOOKS):
        notebook = jupytext.read(ROOT / name)
        for kind in ("md", "ipynb"):
            text = jupytext.writes(notebook, fmt=kind)
            files.append(File.generated(config, str(Path(name).with_suffix(f".{kind}")), content=text))
    made = article.pdf(article.numbers())
    files.append(File.generated(config, str(Path(ARTICLE).with_suffix(".pdf")), content=made))
    return files


def on_page_markdown(markdown, page, config, files):
    here = page.file.src_uri

    def in_the_site(link: re.Match) -> str:
        name = normpath(join(dirname(here), link[0]))
        target = ROOT / name
        if ":" in link[0] or name in files.src_uris or not target.exists():
            return link[0]
        if name == ARTICLE:
            return str(Path(link[0]).with_suffix(".pdf"))
        if Path(name).match(NOTEBOOKS):
            return str(Path(link[0]).with_suffix(".md"))
        kind = "tree" if target.is_dir() else "blob"
        return f"{config.repo_url}/{kind}/{config.extra['revision']}/{name}"

    for found in UNSEPARATED.findall(FENCED.sub("", markdown)):
        log.warning(f"{here}: a list needs an empty line before it: {found!r}")
    robot = ROBOT.fullmatch(here)
    if robot and measured.has(robot[1]):
        report = "../../../reports/example/index.html"
        markdown += f"\n\n## Times and errors\nIn float64, of one state, from the [example report]({report}).\n\n{measured.table(robot[1])}\n"
    if here.startswith("docs/notebooks/"):
        markdown += f"\n\n[This notebook for Jupyter]({Path(here).stem}.ipynb).\n"
    return LINK.sub(in_the_site, markdown)
