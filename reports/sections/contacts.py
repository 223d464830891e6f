"""Robots that stand: error of (M + JᵀDJ)⁻¹b against the contacts' stiffness, by variant."""

import math
from collections import defaultdict
from statistics import median

from charts.common import Style
from charts.text import error_text, fit_text, share_text, time_text
from claims.claim import Plot
from page.section import Section, Table
from read.contacts import ContactError
from read.data import Data, scene_name
from read.stress import U
from sections import claim_charts
from summary.points import fit_exponent

TASK = "contacts"
RISING = 100  # in units of u: a median above is more than rounding of the answer
SILENT = 0.01


def section(data: Data) -> Section | None:
    if not data.contact_errors:
        return None
    found = defaultdict(list)
    for it in data.contact_errors:
        found[it.scene, it.variant, it.precision, it.stiffness].append(it)
    rows = [
        {
            "scene": scene,
            "task": TASK,
            "variant": variant,
            "precision": precision,
            "x": stiffness,
            "error": _median(own),
            "share": sum(it.status != "ok" for it in own) / len(own),
            "seeds": len(own),
        }
        for (scene, variant, precision, stiffness), own in found.items()
    ]
    style = Style((row["variant"] for row in rows), (row["precision"] for row in rows))
    plot = Plot("stiffness d of a contact [kg]", "median error of (M + JᵀDJ)⁻¹b", rows)
    notes = ["Crosses: the share of answers that are refused, as singular or indefinite."]
    figure = claim_charts.figure(plot, "error against stiffness", style, notes, "Robot")
    return Section(
        "Robots that stand: contacts as measurements",
        [
            "A contact that resists the motion of a link with stiffness d adds d e eᵀ to the "
            "link’s M(k), and the filter factors M + JᵀDJ, which a batch method has to form. "
            "Robots stand on points of their feet or tips, in random states; truth has 100 "
            "digits. What an update does with d decides what is left of the digits beside it.",
        ],
        variants=style.variants,
        precisions=style.precisions,
        figures=[figure] if figure else [],
        tables=[_table(found, data)],
    )


def _median(own: list[ContactError]) -> float | None:
    errors = [it.error for it in own if it.error is not None]
    return median(errors) if errors else None


def _conditions(answers: list[ContactError]) -> str:
    """What moving the parameters moves the answers by."""
    found = [it.kS for it in answers if it.kS is not None]
    if not found:
        return ""
    return (
        f" Parameters that are wrong by u move the answers by kS u, kS = {median(found):.1f} in the "
        f"median and {max(found):.1f} at most."
    )


def _table(found: dict[tuple, list[ContactError]], data: Data) -> Table:
    times = {(it.scene, it.variant, it.precision): it.nanoseconds for it in data.contact_times}
    rows = []
    for scene, variant, precision in dict.fromkeys(key[:3] for key in found):
        own = {key[3]: it for key, it in found.items() if key[:3] == (scene, variant, precision)}
        medians = [(d, _median(own[d])) for d in sorted(own)]
        rising = [(d, e) for d, e in medians if e is not None and RISING * U[precision] < e < 0.1]
        answers = [it for those in own.values() for it in those]
        silent = [it for it in answers if not it.warns and it.error and it.error > SILENT]
        worst = max((it.error for it in answers if it.error is not None), default=math.nan)
        rows.append(
            [
                scene_name(scene),
                variant,
                precision,
                time_text(times.get((scene, variant, precision))),
                fit_text(fit_exponent(rising, 0)),
                share_text(sum(it.status != "ok" for it in answers) / len(answers)),
                "–" if math.isnan(worst) else error_text(worst),
                str(len(silent)),
            ]
        )
    return Table(
        "All stiffnesses together. Exponent: of the median error in d, where it is above 100 u. "
        "Time: from q to the answer at d = 10⁴ kg, memory taken before. Silent: answers that are "
        "wrong by more than 1 % without a warning." + _conditions(data.contact_errors),
        ["Robot", "Variant", "Precision", "Time", "Exponent", "Refused", "Largest error", "Silent"],
        rows,
        "lllrrrrr",
        folded=True,
    )
