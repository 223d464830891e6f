"""Our fast path and other libraries on the same model and states in one run, by one thread; a
library that knows no armature solves the model without. Every result was checked before it was
timed. After an @ stands the compiler, in brackets the convention of a library that has several.
"""

from markupsafe import Markup

from charts import palette
from charts.groups import LIBRARIES
from charts.text import factor_text, task_rank, task_text, time_text
from page.section import Section, left, right
from read.data import Call, Data, Time, scene_name, scene_size
from sections.common import Group, groups
from sections.method import distinct, timed_calls
from summary.groups import by_key

TASK = "task"


def section(data: Data) -> Section | None:
    if not data.peers:
        return None
    contests = _contests(data.peers)
    tasks = list(dict.fromkeys(contest.task for contest in contests))
    present = {_peer(call.time) for call in data.peers}
    absent = [peer for peer in LIBRARIES if peer not in present]
    page = Section("Against peers", __doc__)
    page.say(
        *timed_calls(data.peers_contexts),
        *(f"Versions: {text}." for text in distinct(data.peers_contexts, "peers")),
        absent
        and f"""Not in this run: {", ".join(absent)}. bench_peers measures those that it was built
        with; scripts/setup --peers installs them.""",
    )
    page.choose(TASK, "Task", tasks, task_text)
    for task in tasks:
        _overview(page, [it for it in contests if it.task == task], task)
    for contest in contests:
        _bars(page, contest, data.peers)
    return page


def _peer(time: Time) -> str | None:
    """The library, or None for ours."""
    name = palette.family(time.variant)
    return name if name in LIBRARIES else None


def _contests(calls: list[Call]) -> list[Group]:
    """All that does one task on one scene, the fastest first; what is not timed is last."""

    def order(time: Time):
        speed = time.nanoseconds is None, time.nanoseconds, time.variant
        return task_rank(time.task), scene_size(time.scene), time.scene, speed

    contests = groups(sorted((call.time for call in calls), key=order), "task", "scene")
    for it in contests:
        it.timed = [time for time in it.own if time.nanoseconds]
        it.best_peer = next(filter(_peer, it.timed), None)
    return contests


def _overview(page: Section, contests: list[Group], task: str) -> None:
    """Our best in each precision against the best peer."""
    rows = []
    for contest in contests:
        ours = by_key((time for time in contest.own if not _peer(time)), lambda it: it.precision)
        for precision in sorted(ours, reverse=True):
            if ours[precision][0].nanoseconds and contest.best_peer:
                rows.append((ours[precision][0], contest.best_peer))
    page.table(
        f"{task_text(task)}: our fastest against the fastest peer, in float64",
        [
            left("Scene:N", "scene"),
            left("Precision", "precision"),
            left("Ours", "variant"),
            right("Time", "nanoseconds", time_text),
            left("Best peer", lambda _, best: best.variant),
            right("Time", lambda _, best: time_text(best.nanoseconds)),
            right("Ours is", lambda mine, best: factor_text(_over(best, mine))),
        ],
        rows,
        shown={TASK: task},
    )


def _over(time: Time, other: Time) -> float:
    return time.nanoseconds / other.nanoseconds


def _bars(page: Section, contest: Group, calls: list[Call]) -> None:
    longest = contest.timed[-1] if contest.timed else None
    best = contest.best_peer

    def name(time: Time) -> str | Markup:
        return time.variant if _peer(time) else Markup("<strong>{}</strong>").format(time.variant)

    def whose(time: Time) -> str:
        return "peer" if _peer(time) else "ours"

    def bar(time: Time) -> Markup:
        width = f"{100 * _over(time, longest):.2f}%"
        return Markup('<span class="bar {}" style="width: {}"></span>').format(whose(time), width)

    def against(time: Time) -> str | None:
        return best and ("best peer" if time == best else factor_text(_over(best, time)))

    missing = ", ".join(_missing(contest, calls))
    page.table(
        f"""{scene_name(contest.scene)}, N = {scene_size(contest.scene)}:
        {task_text(contest.task)}""",
        [
            left("Variant", name),
            right("Time", "nanoseconds", time_text),
            left("As a bar", bar),
            right("Against the best peer", against),
            left("Precision", "precision"),
            left("Whose", whose),
        ],
        contest.timed,
        last=missing and f"Missing: {missing}",
        shown={TASK: contest.task},
        style="bars",
    )


def _missing(contest: Group, calls: list[Call]) -> list[str]:
    """What of this run is not among the times, and why."""
    here = set(map(_peer, contest.own))
    present = {_peer(call.time) for call in calls}
    able = {_peer(call.time) for call in calls if call.time.task == contest.task}
    return [
        *(
            f"{time.variant} in {time.precision} ({time.refused})"
            for time in contest.own
            if time.nanoseconds is None
        ),
        *(
            f"{peer} ({'not measured on this scene' if peer in able else 'has no such call'})"
            for peer in LIBRARIES
            if peer in present - here
        ),
    ]
