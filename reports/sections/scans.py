"""A Kalman filter can be written as an associative operation on blocks of links, which a balanced
tree combines in log N steps, so that several processors share one mechanism. Here it is one of the
family {family}, in float64, beside the same filter in sequence and the fast path.

A scan does more arithmetic in all than the filter in sequence, and less of it one after another:
the span, in flops, which any number of processors needs. In blocks of a fixed size the span grows
as log N. The blocks that are timed have N/64 links, at least 4 and at most 1024, for few
processors; smaller ones have a shorter span and more work.
"""

from charts import scans as scan_charts
from charts.common import VIEW, Style
from charts.scans import BOUND, BOUNDS, SIZE
from charts.text import task_rank, task_text, thousands_text, three_digits, time_text
from claims.scans import SCANS
from page.section import Choice, Section, first_of, left, right
from read.data import Data, scene_name
from sections.common import from_to, ratio
from sections.method import timed_calls
from summary.groups import by_key
from summary.scans import Machine, Scanned, checks, is_scan, machine, scanned

FAST = "Ladder<default>"


def section(data: Data) -> Section | None:
    found = scanned(data)
    of = machine(data)
    both = [it for it in found if it.timed_errors and it.times]
    spans = [it for it in found if it.errors.keys() & it.flops.keys()]
    predictable = [it for it in found if is_scan(it.variant) and it.times.get(1) and it.timed]
    sizes = sorted({it.n for it in predictable})
    on_processors = [it for it in found if it.n in sizes and it.times]
    drawn = both + spans + on_processors
    if not drawn:
        return None
    tasks = {task for it in both + spans for by_task in it.errors.values() for task in by_task}
    page = Section(
        "The filter as a scan",
        __doc__.format(family=scene_name(found[0].scene)),
        Style((it.variant for it in drawn), []),
    )
    page.say(
        *timed_calls(data.scan_contexts),
        any(it.times for it in found)
        and any(it.errors or it.flops for it in found)
        and """Errors and flops are of the family’s state in the laboratory, times of a random one.
        Where only one of the two is suspected to be singular, the second look at it counts in flops
        and not in time, or in time and not in flops.""",
        predictable and _rule(predictable, of),
        predictable and _checked(found, of),
        _missing(found),
    )
    first_task = "dynamics" if "dynamics" in tasks else ""
    page.choose(VIEW, "Errors of", sorted(tasks, key=task_rank), task_text, first_task)
    if both:
        page.figure(
            "error against run time",
            scan_charts.error_against_time(both, page.style, page.first),
            scan_charts.TOOLTIPS,
            notes=f"Points of a line are N. {_threads_note(both)}",
        )
    if spans:
        page.figure(
            "error against span",
            scan_charts.error_against_span(spans, page.style, page.first),
            scan_charts.SPAN_TOOLTIPS,
            notes="""Points of a line are N. A sequential filter has all its flops one after
            another. Broken lines are blocks of another size than those that are timed.""",
        )
    if predictable:
        _prediction(page, on_processors, sizes, of)
    _table(page, found, of)
    return page


def _threads_note(both: list[Scanned]) -> str:
    threads = sorted({threads for it in both for threads in it.times})
    looks = ["circles, drawn through", "triangles, broken", "diamonds, dotted"]
    if len(threads) == 1:
        return ""
    known = [f"{_threads(count)}: {look}" for count, look in zip(threads, looks, strict=False)]
    return f"On {'; '.join(known)}."


def _threads(count: int) -> str:
    return "1 thread" if count == 1 else f"{count} threads"


def _prediction(page: Section, found: list[Scanned], sizes: list[int], of: Machine) -> None:
    bounds = BOUNDS if _has_memory(found, of) else ["arithmetic"]
    choices = [
        Choice(SIZE, "N", sizes, thousands_text, first=str(sizes[-1])),
        Choice(BOUND, "Bound by", bounds, BOUNDS.get, first="memory" if bounds is BOUNDS else ""),
    ]
    page.figure(
        "time on any number of processors",
        scan_charts.time_on_processors(found, of, page.style, first_of(choices)),
        scan_charts.PROCESSOR_TOOLTIPS,
        choices=choices,
        notes="""
        Small marks are predicted, large ones measured. Broken lines are blocks of another size,
        which were not timed: their flops are taken to go at the same rate, through as much memory.
        Level lines are times on one processor.
        """,
    )


def _has_memory(found: list[Scanned], of: Machine) -> bool:
    return any(it.bytes for it in found) and of.bandwidth(1) is not None


def _rule(predictable: list[Scanned], of: Machine) -> str:
    """By which times are predicted."""
    memory = (
        f"""and no shorter than the memory of a call takes at the bandwidth of a copy, which grows
        with processors up to that of the most threads on which it was measured,
        {_threads(max(of.bandwidths))}; what stays in caches is not bound by that"""
        if _has_memory(predictable, of)
        else "arithmetic alone, since bandwidth was not measured"
    )
    kinematics = (
        "Kinematics, which is not parallel, is added as it was timed."
        if of.kinematics
        else """Kinematics, which is not parallel, was not timed apart and counts as if it were: on
        many processors the times are too short."""
    )
    return f"""Predicted times are the flops that p processors have one after another, at the rate
        at which the same scan did its flops on one thread, {memory}. {kinematics}"""


def _checked(found: list[Scanned], of: Machine) -> str:
    texts = []
    checked = by_key(checks(found, of), lambda it: (it[0].variant, it[1]))
    for (variant, threads), own in sorted(checked.items()):
        ratios = from_to([it[2] for it in own], three_digits)
        texts.append(f"{variant} on {_threads(threads)} {ratios}")
    measured = f"Measured time over the predicted one, over all N: {'; '.join(texts)}."
    return measured if texts else ""


def _missing(found: list[Scanned]) -> str:
    threads = max((count for it in found for count in it.times), default=0)
    largest = max(it.n for it in found)
    more = f"more than {_threads(threads)}, " if threads else "times, "
    return f"Not measured: {more}N above {thousands_text(largest)}, other families, GPUs."


def _table(page: Section, found: list[Scanned], of: Machine) -> None:
    known = {(it.variant, it.n): it for it in found}
    ratios = {(it.variant, it.n, threads): ratio for it, threads, ratio in checks(found, of)}
    most = max((count for it in found for count in it.times), default=1)

    def work(it: Scanned | None) -> float | None:
        return it and it.timed and it.timed.work

    def span(it: Scanned) -> float | None:
        return it.timed and it.timed.span

    def in_sequence(it: Scanned) -> Scanned | None:
        return known.get((SCANS.get(it.variant), it.n))

    def faster(other: Scanned | None, it: Scanned) -> float | None:
        return other and ratio(other.times.get(1), it.times.get(most))

    page.table(
        f"""Work ratio: flops over those of the same filter in sequence. Most speed-up: flops of the
        filter in sequence over the span, which no number of processors exceeds. Over the filter in
        sequence and over the fast path: how many times as fast the scan was on {_threads(most)} as
        they are on one; below 1 it is slower. Work and span are counted without kinematics.""",
        [
            right("N", "n", thousands_text),
            left("Variant", "variant"),
            left("Links of a block", "links"),
            right("Work ratio", lambda it: ratio(work(it), work(in_sequence(it))), _small),
            right("Span [flops]", span, thousands_text),
            right("Most speed-up", lambda it: ratio(work(in_sequence(it)), span(it)), _small),
            [
                right(f"Time on {_threads(n)}", lambda it, n=n: it.times.get(n), time_text)
                for n in dict.fromkeys((1, most))
            ],
            right("Over the filter in sequence", lambda it: faster(in_sequence(it), it), _small),
            right("Over the fast path", lambda it: faster(known.get((FAST, it.n)), it), _small),
            right("Measured / predicted", lambda it: ratios.get((it.variant, it.n, most)), _small),
        ],
        [it for it in found if is_scan(it.variant) and (it.timed or it.times)],
    )


def _small(ratio: float) -> str:
    """With its digits, however small."""
    return three_digits(ratio) if ratio > 0.1 else f"{ratio:.2g}"
