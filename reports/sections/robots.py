"""{robots} robots of a campaign, as given, loaded, without armature, with a light wrist, a long
tool and a light first link; the worst position of each is searched for. Silent: answers of any
variant more than 1 % wrong without a warning.
"""

from charts.text import sentence, tolerance_text
from page.section import Section, left, right
from read.data import Data, Kept, scene_size
from summary.groups import by_key


def section(data: Data) -> Section | None:
    if not data.robot_limits:
        return None
    robots = by_key(sorted(data.robot_limits, key=lambda it: it.name), lambda it: it.name).values()
    judged = [rows for rows in robots if not rows[0].refused]
    page = Section("Many robots", __doc__.format(robots=len(judged)))
    page.table(
        "What each robot keeps, and how far stresses may go until it does not",
        [
            left("Robot", lambda rows: rows[0].name),
            right("DoF", lambda rows: scene_size(rows[0].robot)),
            left("Keeps", lambda rows: rows[0].promise or None),
            left("Lost beyond", _lost),
            right("Silent errors", lambda rows: sum(it.silent for it in rows)),
        ],
        judged,
    )
    page.table(
        "Files that were refused",
        [left("File", "name"), left("Reason", "refused", sentence)],
        [rows[0] for rows in robots if rows[0].refused],
        folded=True,
    )
    return page


def _lost(rows: list[Kept]) -> str | None:
    """The stresses that were too much, and their last values that were not."""
    limits = (
        f"{it.stress}: at once"
        if it.kept is None
        else f"{it.stress}: {tolerance_text(it.kept)} {it.unit}".rstrip()
        for it in rows
        if not it.whole
    )
    return "; ".join(limits) or None
