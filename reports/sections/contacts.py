"""A contact that resists the motion of a link with stiffness d adds d e eᵀ to the link’s M(k), and
the filter factors M + JᵀDJ, which a batch method has to form. Robots stand on points of their feet
or tips, in random states; truth has 100 digits. What an update does with d decides what is left of
the digits beside it.
"""

from statistics import median

from charts.text import error_text, fit_text, share_text, time_text
from claims.claim import LOST, RISING, Plot
from page.section import Section, left, right
from read.contacts import ContactError
from read.data import Data, scene_name
from read.stress import U
from sections import claim_charts
from sections.common import SERIES, Group, groups, style_of
from summary.points import Fit, fit_exponent

WHO = ("scene", "variant", "precision")
SILENT = 0.01


def section(data: Data) -> Section | None:
    if not data.contact_errors:
        return None
    rows = [
        {
            "scene": it.scene,
            "task": "contacts",
            "variant": it.variant,
            "precision": it.precision,
            "x": it.stiffness,
            "error": _median(it.own),
            "share": _refused(it),
            "seeds": len(it.own),
        }
        for it in groups(data.contact_errors, *WHO, "stiffness")
    ]
    page = Section("Robots that stand: contacts as measurements", __doc__, style_of(rows))
    plot = Plot("stiffness d of a contact [kg]", "median error of (M + JᵀDJ)⁻¹b", rows)
    refused = "Crosses: the share of answers that are refused, as singular or indefinite."
    claim_charts.draw(page, plot, "error against stiffness", refused, "Robot")
    times = {(it.scene, it.variant, it.precision): it.nanoseconds for it in data.contact_times}
    page.table(
        f"""All stiffnesses together. Exponent: of the median error in d, where it is above 100 u.
        Time: from q to the answer at d = 10⁴ kg, memory taken before. Silent: answers that are
        wrong by more than 1 % without a warning. {_conditions(data.contact_errors)}""",
        [
            left("Robot", "scene", scene_name),
            SERIES,
            right("Time", lambda it: times.get((it.scene, it.variant, it.precision)), time_text),
            right("Exponent", _exponent, fit_text),
            right("Refused", _refused, share_text),
            right("Largest error", lambda it: max(_errors(it.own), default=None), error_text),
            right("Silent", _silent),
        ],
        groups(data.contact_errors, *WHO),
        folded=True,
    )
    return page


def _errors(own: list[ContactError]) -> list[float]:
    return [it.error for it in own if it.error is not None]


def _median(own: list[ContactError]) -> float | None:
    return median(errors) if (errors := _errors(own)) else None


def _refused(group: Group) -> float:
    return sum(it.status != "ok" for it in group.own) / len(group.own)


def _exponent(series: Group) -> Fit | None:
    """Of the median error in the stiffness, where it is neither rounding nor lost."""
    points = sorted(groups(series.own, "stiffness"), key=lambda it: it.stiffness)
    medians = [(it.stiffness, _median(it.own)) for it in points]
    low = RISING * U[series.precision]
    return fit_exponent([(d, e) for d, e in medians if e is not None and low < e < LOST], 0)


def _silent(series: Group) -> int:
    return sum(it > SILENT for it in _errors([it for it in series.own if not it.warns]))


def _conditions(answers: list[ContactError]) -> str:
    """What moving the parameters moves the answers by."""
    found = [it.kS for it in answers if it.kS is not None]
    if not found:
        return ""
    return f"""Parameters that are wrong by u move the answers by kS u, kS = {median(found):.1f} in
        the median and {max(found):.1f} at most."""
