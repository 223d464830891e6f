"""Many robots under every stress: what each keeps, and which files were refused."""

from itertools import groupby

from charts.text import sentence, tolerance_text
from page.section import Section, Table
from read.data import Data, Kept, scene_size


def section(data: Data) -> Section | None:
    if not data.robot_limits:
        return None
    by_name = groupby(sorted(data.robot_limits, key=lambda it: it.name), lambda it: it.name)
    robots = {name: list(rows) for name, rows in by_name}
    judged = {name: rows for name, rows in robots.items() if not rows[0].refused}
    refused = [
        [name, sentence(rows[0].refused)] for name, rows in robots.items() if rows[0].refused
    ]
    tables = []
    if judged:
        tables.append(
            Table(
                "What each robot keeps, and how far stresses may go until it does not",
                ["Robot", "DoF", "Keeps", "Lost beyond", "Silent errors"],
                [_row(name, rows) for name, rows in judged.items()],
                "lrllr",
            )
        )
    if refused:
        columns = ["File", "Reason"]
        tables.append(Table("Files that were refused", columns, refused, "ll", folded=True))
    return Section(
        "Many robots",
        [
            f"{len(judged)} robots of a campaign, as given, loaded, without armature, with a light "
            "wrist, a long tool and a light first link; the worst position of each is searched for. "
            "Silent: answers of any variant more than 1 % wrong without a warning.",
        ],
        tables=tables,
    )


def _row(name: str, rows: list[Kept]) -> list[str]:
    lost = [
        f"{it.stress}: {'at once' if it.kept is None else tolerance_text(it.kept)}"
        + (f" {it.unit}" if it.unit and it.kept is not None else "")
        for it in rows
        if not it.whole
    ]
    size = str(scene_size(rows[0].robot))
    silent = str(sum(it.silent for it in rows))
    return [name, size, rows[0].promise or "–", "; ".join(lost) or "–", silent]
