"""The filter as a scan: what it costs in digits and time, on few processors and on many."""

from charts import scans as scan_charts
from charts.common import VIEW, Style
from charts.scans import BOUND, BOUNDS, SIZE
from charts.text import TASKS, task_rank, thousands_text, three_digits, time_text
from claims.scans import SCANS
from page.section import Choice, Figure, Section, Table
from read.data import Data, scene_name
from sections.method import distinct
from summary.scans import Machine, Scanned, checks, is_scan, machine, scanned

FAST = "Ladder<default>"


def section(data: Data) -> Section | None:
    found = scanned(data)
    if not found:
        return None
    of = machine(data)
    both = [it for it in found if it.timed_errors and it.times]
    spans = [it for it in found if it.errors.keys() & it.flops.keys()]
    predictable = [it for it in found if is_scan(it.variant) and it.times.get(1) and it.timed]
    sizes = sorted({it.n for it in predictable})
    on_processors = [it for it in found if it.n in sizes and it.times]
    drawn = both + spans + on_processors
    if not drawn:
        return None
    style = Style((it.variant for it in drawn), [])
    tasks = {task for it in both + spans for by_task in it.errors.values() for task in by_task}
    tasks = sorted(tasks, key=task_rank)
    first = "dynamics" if "dynamics" in tasks else (tasks or [""])[0]
    choice = Choice(VIEW, "Errors of", [(task, TASKS.get(task, task)) for task in tasks], first)
    figures = []
    if both:
        chart = scan_charts.error_against_time(both, style, {VIEW: first})
        note = "Points of a line are N. " + _threads_note(both)
        figures.append(
            Figure("error against run time", chart, scan_charts.TOOLTIPS, notes=[note.strip()])
        )
    if spans:
        chart = scan_charts.error_against_span(spans, style, {VIEW: first})
        note = (
            "Points of a line are N. A sequential filter has all its flops one after another. "
            "Broken lines are blocks of another size than those that are timed."
        )
        figures.append(
            Figure("error against span", chart, scan_charts.SPAN_TOOLTIPS, notes=[note])
        )
    if predictable:
        figures.append(_prediction(on_processors, sizes, of, style))
    return Section(
        "The filter as a scan",
        [
            "A Kalman filter can be written as an associative operation on blocks of links, which "
            "a balanced tree combines in log N steps, so that several processors share one "
            f"mechanism. Here it is one of the family {scene_name(found[0].scene)}, in float64, "
            "beside the same filter in sequence and the fast path.",
            "A scan does more arithmetic in all than the filter in sequence, and less of it one "
            "after another: the span, in flops, which any number of processors needs. In blocks of "
            "a fixed size the span grows as log N. The blocks that are timed have N/64 links, at "
            "least 4 and at most 1024, for few processors; smaller ones have a shorter span and "
            "more work.",
        ],
        statements=_statements(found, of, data),
        choices=[choice] if tasks else [],
        variants=style.variants,
        figures=figures,
        tables=_tables(found, of),
    )


def _threads_note(both: list[Scanned]) -> str:
    threads = sorted({threads for it in both for threads in it.times})
    looks = ["circles, drawn through", "triangles, broken", "diamonds, dotted"]
    if len(threads) == 1:
        return ""
    known = [f"{_threads(count)}: {look}" for count, look in zip(threads, looks, strict=False)]
    return f"On {'; '.join(known)}."


def _threads(count: int) -> str:
    return "1 thread" if count == 1 else f"{count} threads"


def _prediction(
    on_processors: list[Scanned], sizes: list[int], of: Machine, style: Style
) -> Figure:
    size = Choice(SIZE, "N", [(str(n), thousands_text(n)) for n in sizes], str(sizes[-1]))
    choices = [size]
    first = {SIZE: size.first, BOUND: "arithmetic"}
    if _has_memory(on_processors, of):
        choices.append(Choice(BOUND, "Bound by", list(BOUNDS.items()), "memory"))
        first[BOUND] = "memory"
    chart = scan_charts.time_on_processors(on_processors, of, style, first)
    return Figure(
        "time on any number of processors",
        chart,
        scan_charts.PROCESSOR_TOOLTIPS,
        choices=choices,
        notes=[
            "Small marks are predicted, large ones measured. Broken lines are blocks of another "
            "size, which were not timed: their flops are taken to go at the same rate, through as "
            "much memory. Level lines are times on one processor."
        ],
    )


def _has_memory(found: list[Scanned], of: Machine) -> bool:
    return any(it.bytes for it in found) and of.bandwidth(1) is not None


def _statements(found: list[Scanned], of: Machine, data: Data) -> list[str]:
    calls = [f"A timed call: {text}" for text in distinct(data.scan_contexts, "timed_call")]
    if any(it.times for it in found) and any(it.errors or it.flops for it in found):
        calls.append(
            "Errors and flops are of the family’s state in the laboratory, times of a random one. "
            "Where only one of the two is suspected to be singular, the second look at it counts "
            "in flops and not in time, or in time and not in flops."
        )
    predictable = [it for it in found if is_scan(it.variant) and it.times.get(1) and it.timed]
    if not predictable:
        return calls + _missing(found)
    memory = (
        "and no shorter than the memory of a call takes at the bandwidth of a copy, which grows "
        "with processors up to that of the most threads on which it was measured, "
        f"{_threads(max(of.bandwidths))}; what stays in caches is not bound by that"
        if _has_memory(predictable, of)
        else "arithmetic alone, since bandwidth was not measured"
    )
    kinematics = (
        "Kinematics, which is not parallel, is added as it was timed."
        if of.kinematics
        else "Kinematics, which is not parallel, was not timed apart and counts as if it were: on "
        "many processors the times are too short."
    )
    return [
        *calls,
        "Predicted times are the flops that p processors have one after another, at the rate at "
        f"which the same scan did its flops on one thread, {memory}. {kinematics}",
        *_checked(found, of),
        *_missing(found),
    ]


def _checked(found: list[Scanned], of: Machine) -> list[str]:
    by_threads = {}
    for it, threads, ratio in checks(found, of):
        by_threads.setdefault((it.variant, threads), []).append(ratio)
    texts = []
    for (variant, threads), ratios in sorted(by_threads.items()):
        ends = dict.fromkeys(map(three_digits, (min(ratios), max(ratios))))
        texts.append(f"{variant} on {_threads(threads)} {' to '.join(ends)}")
    if not texts:
        return []
    return [f"Measured time over the predicted one, over all N: {'; '.join(texts)}."]


def _missing(found: list[Scanned]) -> list[str]:
    threads = max((count for it in found for count in it.times), default=0)
    largest = max(it.n for it in found)
    more = f"more than {_threads(threads)}, " if threads else "times, "
    return [f"Not measured: {more}N above {thousands_text(largest)}, other families, GPUs."]


def _tables(found: list[Scanned], of: Machine) -> list[Table]:
    known = {(it.variant, it.n): it for it in found}
    ratios = {(it.variant, it.n, threads): ratio for it, threads, ratio in checks(found, of)}
    most = max((count for it in found for count in it.times), default=1)
    rows = []
    for it in found:
        if not is_scan(it.variant) or not (it.timed or it.times):
            continue
        sequence = known.get((SCANS.get(it.variant), it.n))
        fast = known.get((FAST, it.n))
        work = it.timed and sequence and sequence.timed and sequence.timed.work
        rows.append(
            [
                thousands_text(it.n),
                it.variant,
                str(it.links),
                _ratio(it.timed and it.timed.work, work),
                thousands_text(it.timed.span) if it.timed else "–",
                _ratio(work, it.timed and it.timed.span),
                *(time_text(it.times.get(threads)) for threads in dict.fromkeys((1, most))),
                _ratio(sequence and sequence.times.get(1), it.times.get(most)),
                _ratio(fast and fast.times.get(1), it.times.get(most)),
                _ratio(ratios.get((it.variant, it.n, most)), 1),
            ]
        )
    if not rows:
        return []
    columns = ["N", "Variant", "Links of a block", "Work ratio", "Span [flops]", "Most speed-up"]
    columns += [f"Time on {_threads(threads)}" for threads in dict.fromkeys((1, most))]
    columns += ["Over the filter in sequence", "Over the fast path", "Measured / predicted"]
    return [
        Table(
            "Work ratio: flops over those of the same filter in sequence. Most speed-up: flops of "
            "the filter in sequence over the span, which no number of processors exceeds. Over the "
            "filter in sequence and over the fast path: how many times as fast the scan was on "
            f"{_threads(most)} as they are on one; below 1 it is slower. Work and span are counted "
            "without kinematics.",
            columns,
            rows,
            "rll" + "r" * (len(columns) - 3),
        )
    ]


def _ratio(one: float | None, other: float | None) -> str:
    if not (one and other):
        return "–"
    return three_digits(one / other) if one > 0.1 * other else f"{one / other:.2g}"
