#!/usr/bin/env python3
"""Turns a run's recorded data into one self-contained page, the README's figure and an archive."""

import argparse
import base64
import gzip
import sys
from pathlib import Path

import altair as alt
import jinja2
import vl_convert
from markupsafe import Markup

from charts import palette
from charts import variants as variant_charts
from charts.common import THEME, Style, css_colour, css_name
from charts.drawing import VEGA_LITE, bundle, compiled
from charts.text import task_text
from page.archive import archive, link
from page.output import write
from page.section import slug
from read.data import Data, DataError, scene_name
from read.readers import data_files, load, load_baseline
from sections import SECTIONS
from sections.method import distinct
from summary.points import points

PAGE = Path(__file__).parent / "page"
STYLE = ("page.css", "layout.css", "tables.css")
SCRIPT = ("figures.js", "numbers.js", "save.js", "page.js")
FIGURE_ROBOT = "panda"


class Parser(argparse.ArgumentParser):
    def error(self, message: str):
        self.exit(2, f"{self.prog}: error: {message}\n")


def facts(data: Data) -> list[tuple[str, str]]:
    """When, what and where, as far as the benchmarks recorded it."""
    contexts = data.all_contexts
    days = sorted({date[:10] for date in distinct(contexts, "date")})
    found = [
        ("Date", " to ".join(dict.fromkeys([days[0], days[-1]])) if days else ""),
        ("Git revision", ", ".join(distinct(contexts, "git_revision"))),
        ("Machine", ", ".join(distinct(contexts, "cpu") or distinct(contexts, "host_name"))),
        ("CPUs", ", ".join(distinct(contexts, "num_cpus"))),
        ("Run", ", ".join(distinct(contexts, "mode"))),
    ]
    return [(name, value) for name, value in found if value]


def page(data: Data, archived: Markup | str = "") -> str:
    """`archived` says where the data are to be had."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(PAGE), autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["packed"] = packed
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":")}
    sections = [section for make in SECTIONS if (section := make(data))]
    variants = {variant for section in sections for variant in section.variants}
    return environment.get_template("page.html.jinja").render(
        facts=facts(data) + ([("Data", archived)] if archived else []),
        sections=sections,
        colours={css_name(name): pair for name, pair in palette.colours(variants).items()},
        css_colour=css_colour,
        shape=palette.shape,
        shapes=palette.shapes,
        slug=slug,
        compiled=compiled,
        css=_inline(STYLE),
        script=_inline(SCRIPT),
        bundle=bundle(),
    )


def packed(text: str) -> str:
    """Text that page.js unpacks: gzip in base64, of the same bytes for the same text."""
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()


def _inline(names: tuple[str, ...]) -> Markup:
    return Markup("".join((PAGE / name).read_text(encoding="utf-8") for name in names))


def figure(data: Data) -> str:
    """Error against run time of one robot as SVG, a panel for a and one for its inverse."""
    robots = data.robots or data.scenes
    if not robots:
        raise DataError("the figure needs errors and times of a scene")
    scene = next((robot for robot in robots if scene_name(robot) == FIGURE_ROBOT), robots[0])
    drawn = [
        point
        for point in points(data)
        if point.scene == scene
        and point.measure == "relative"
        and point.time is not None
        and point.states
    ]
    tasks = [
        task for task in ("acceleration", "inverse") if task in {point.task for point in drawn}
    ]
    if not tasks:
        raise DataError(f"{scene}: no task with errors and times to draw")
    drawn = [point for point in drawn if point.task in tasks]
    style = Style((p.variant for p in drawn), (p.precision for p in drawn), for_file=True)
    panels = []
    for i, task in enumerate(tasks):
        panel = [point for point in drawn if point.task == task]
        chart = variant_charts.work_precision(panel, style, scales=f"concat_{i}_")
        panels.append(chart.properties(width=330, title=f"{scene_name(scene)}: {task_text(task)}"))
    theme = THEME | {"background": "white", "padding": 10}
    return vl_convert.vegalite_to_svg(
        alt.hconcat(*panels).resolve_scale(color="shared", shape="shared").to_dict(),
        vl_version=VEGA_LITE,
        config=theme,
    )


def main() -> None:
    parser = Parser(description=__doc__)
    parser.add_argument("--data", type=Path, metavar="DIR", help="folder of a run's data files")
    parser.add_argument(
        "--files", type=Path, nargs="+", metavar="FILE", help="these data files only"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="the page to write")
    parser.add_argument(
        "--baseline",
        type=Path,
        metavar="DIR|data.tar.xz",
        help="data of another run, to compare with: a folder, or what lies beside its page",
    )
    parser.add_argument(
        "--figure", type=Path, metavar="FILE.svg", help="the README's figure to write"
    )
    parser.add_argument(
        "--archive",
        type=Path,
        metavar="FILE.tar.xz",
        help="the data files, packed, which the page names with their checksum",
    )
    parser.add_argument(
        "--leave-out",
        nargs="+",
        default=[],
        metavar="NAME",
        help="data files of which the archive has checksums alone",
    )
    arguments = parser.parse_args()
    if not (arguments.data or arguments.files):
        parser.error("neither --data nor --files is given")
    if not (arguments.out or arguments.figure):
        parser.error("neither --out nor --figure is given")
    if arguments.archive and not arguments.out:
        parser.error("--archive is for the page of --out")
    if arguments.leave_out and not arguments.archive:
        parser.error("--leave-out is for --archive")
    try:
        data = load(arguments.data, arguments.files)
        if arguments.baseline:
            data.baseline = load_baseline(arguments.baseline)
        if arguments.figure:
            write(arguments.figure, figure(data))
        if arguments.archive:
            files = data_files(arguments.data, arguments.files)
            left_out = [file for file in files if file.name in arguments.leave_out]
            if absent := set(arguments.leave_out) - {file.name for file in left_out}:
                raise DataError(f"--leave-out: {min(absent)} is none of the data files")
            packed = archive(files, left_out)
            text = page(data, link(arguments.archive, arguments.out, packed, left_out))
            write(arguments.archive, packed)
            write(arguments.out, text)
        elif arguments.out:
            write(arguments.out, page(data))
    except DataError as error:
        parser.error(str(error))


if __name__ == "__main__":
    sys.exit(main())
