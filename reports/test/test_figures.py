"""The charts that Vega makes of hand-made points."""

import re

import pytest

import alt_scene
import fake_stress
from charts import palette
from charts import samples as sample_charts
from charts import variants as variant_charts
from charts.common import BAND, HEIGHT, QUANTITY, VIEW, Style
from read.readers import load
from sections import SECTIONS
from summary.points import Band, Point

STYLE = Style(["A", "B"], ["float64"], for_file=True)


def points(*times_and_errors, failures=0):
    return [
        Point(
            "panda:7",
            "panda",
            7,
            f"V{i}",
            "float64",
            "inverse",
            "relative",
            time,
            0.01,
            error,
            error,
            10,
            failures,
            "",
        )
        for i, (time, error) in enumerate(times_and_errors)
    ]


def front(drawn):
    """The front's (time, error), in its order."""
    style = Style([point.variant for point in drawn], ["float64"], for_file=True)
    (line, *_) = alt_scene.marks(variant_charts.work_precision(drawn, style), "line")
    return [
        tuple(map(float, re.findall(r"(?:time|error): ([^;]+)", item["description"])))
        for item in line
    ]


def test_every_chart_is_valid_vega_lite(run, tmp_path):
    fake_stress.write(tmp_path)
    charts = 0
    for data in map(load, (run, tmp_path)):
        for section in filter(None, (make(data) for make in SECTIONS)):
            for figure in section.figures:
                figure.chart.to_dict(validate=True)  # raises what is wrong
                charts += 1
    assert charts > 40


def test_the_front_leaves_out_what_another_beats():
    drawn = points((100, 1e-6), (200, 1e-9), (150, 1e-5), (300, 1e-8), (400, 1e-12))
    assert front(drawn) == [(100, 1e-6), (200, 1e-9), (400, 1e-12)]


def test_of_equal_times_the_front_takes_the_smaller_error():
    assert front(points((100, 1e-6), (100, 1e-9))) == [(100, 1e-9)]


def test_of_equal_errors_the_front_takes_the_faster():
    assert front(points((200, 1e-9), (100, 1e-9))) == [(100, 1e-9)]


def test_an_exact_result_ends_the_front():
    assert front(points((100, 1e-6), (200, 0.0), (300, 1e-9))) == [(100, 1e-6)]


def test_a_variant_that_fails_is_not_on_the_front():
    drawn = points((100, 1e-6)) + points((50, 1e-12), failures=1)
    assert front(drawn) == [(100, 1e-6)]


def test_a_failure_is_a_cross_with_its_share():
    chart = variant_charts.work_precision(points((100, None), failures=3), STYLE)
    (crosses,) = [
        items
        for items in alt_scene.marks(chart, "symbol")
        if items and items[0].get("shape") == "cross"
    ]
    assert len(crosses) == 1
    assert "30 %" in alt_scene.texts(chart)


def test_an_exact_result_has_a_mark_below_the_scale():
    chart = variant_charts.work_precision(points((100, 0.0), (200, 1e-9)), STYLE)
    ys = [
        item["y"]
        for items in alt_scene.marks(chart, "symbol")
        for item in items
        if "description" in item
    ]
    assert max(ys) == HEIGHT - BAND / 2
    assert min(ys) < HEIGHT - BAND


@pytest.mark.parametrize("span", [1.1, 1.6, 3, 10, 1e4, 1e7])
def test_a_time_axis_of_any_span_has_labels(span):
    labels = alt_scene.texts(
        variant_charts.work_precision(points((400, 1e-9), (400 * span, 1e-8)), STYLE)
    )
    assert sum(bool(re.fullmatch(r"[\d.]+ (ns|µs|ms|s)", label)) for label in labels) >= 1


def share(scene: str, n: int, share: float) -> dict:
    name = scene.split(":")[0]
    row = {"scene": scene, "name": name, "n": n, "variant": "A", "precision": "float64"}
    return row | {"view": "mass", "share": share}


@pytest.mark.parametrize("largest, height", [(0.5, 0), (2, 0.5)])
def test_the_peak_is_a_line_at_one_that_stays_in_sight(largest, height):
    rows = [share("chain:31", 31, 0.25), share("chain:100", 100, largest)]
    chart = variant_charts.share_of_peak(rows, STYLE, {VIEW: "mass"})
    (rule,) = [item for items in alt_scene.marks(chart, "rule") for item in items]
    assert rule["y"] == pytest.approx(height * HEIGHT)
    assert "peak of fused multiply-adds" in alt_scene.texts(chart)


def test_a_robot_is_on_no_line_of_a_family():
    rows = [share("chain:31", 31, 0.3), share("g1:35", 35, 0.9), share("chain:100", 100, 0.3)]
    chart = variant_charts.share_of_peak(rows, STYLE, {VIEW: "mass"})
    lines = alt_scene.marks(chart, "line")
    assert sorted(len(line) for line in lines) == [1, 2]
    assert len({item["y"] for item in max(lines, key=len)}) == 1
    points = [item for items in alt_scene.marks(chart, "symbol") for item in items]
    assert len(points) == len(rows)


KNOWN = list(palette.SHADES)


def test_known_variants_have_colours_of_their_own():
    assert len(set(palette.colours(KNOWN).values())) == len(KNOWN)


def test_a_known_variant_keeps_its_colour_beside_unknown_ones():
    strangers = ["Sequential<Potter>", "Batch<Another>", "Refined<Sequential<UD>>", "Peer"]
    together = palette.colours(KNOWN + strangers)
    assert {name: together[name] for name in KNOWN} == palette.colours(KNOWN)
    assert len(set(together.values())) == len(together)


def contrast(one: str, other: str) -> float:
    """The ratio of WCAG 2."""

    def luminance(colour):
        parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        linear = [
            part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
        ]
        return sum(weight * part for weight, part in zip((0.2126, 0.7152, 0.0722), linear))

    low, high = sorted([luminance(one), luminance(other)])
    return (high + 0.05) / (low + 0.05)


def test_every_colour_stands_out_from_its_page():
    ramps = [*palette.FAMILIES.values(), *palette.UNKNOWN_FAMILIES]
    for light, dark in (pair for ramp in ramps for pair in ramp):
        assert contrast(light, "#ffffff") >= 3 and contrast(dark, "#15181d") >= 3, (light, dark)


SAMPLERS = Style(["MonteCarlo", "SigmaPoints", "Recursion"], [], for_file=True)


def bands(*counts_and_errors, method="MonteCarlo"):
    """Bands from half to twice the median, 1 µs a sample."""
    return [
        Band("arm:2", "M", method, count, 8, error, error / 2, error * 2, 1e3 * max(count, 1), 1)
        for count, error in counts_and_errors
    ]


SAMPLED = bands((64, 0.1), (128, 0.05), (256, 0.01))
EXACT = bands((12, 1e-16), method="SigmaPoints") + bands((0, 2e-16), method="Recursion")


def samples(what, drawn=SAMPLED + EXACT):
    return sample_charts.against(drawn, SAMPLERS, {QUANTITY: "M"}, what)


def test_a_sampler_is_a_line_of_medians_in_its_band():
    chart = samples("samples")
    (line,) = alt_scene.marks(chart, "line")
    (area,) = alt_scene.marks(chart, "area")
    assert len(line) == len(area) == 3
    halving = line[1]["y"] - line[0]["y"]  # pixels between 0.1 and 0.05
    for on_line, in_band in zip(line, area):
        assert in_band["y"] == pytest.approx(on_line["y"] + halving)  # half the median
        assert in_band["y2"] == pytest.approx(on_line["y"] - halving)  # twice the median
    assert halving > 10 and line[2]["y"] > line[1]["y"]


def test_exact_methods_stand_below_the_scale_of_samples():
    chart = samples("samples")
    below = HEIGHT - BAND / 2
    (rule,) = [item for items in alt_scene.marks(chart, "rule") for item in items]
    assert rule["y"] == below and "Recursion" in rule["description"]
    points = [item for items in alt_scene.marks(chart, "symbol") for item in items]
    assert [item["y"] for item in points if "SigmaPoints" in item["description"]] == [below]
    assert {"exact", "Recursion"} <= alt_scene.texts(chart)
    assert all(item["y"] < below for item in points if "MonteCarlo" in item["description"])


def test_exact_methods_are_points_on_the_scale_of_time():
    chart = samples("time")
    points = [item for items in alt_scene.marks(chart, "symbol") for item in items]
    assert len(points) == 5 and not alt_scene.marks(chart, "rule")
    by_method = {item["description"].split("method: ")[1].split(";")[0]: item for item in points}
    recursion, sigma = by_method["Recursion"], by_method["SigmaPoints"]
    assert recursion["x"] < sigma["x"] and recursion["y"] < sigma["y"] < HEIGHT


def test_an_error_of_zero_has_a_mark_below_the_scale_of_time():
    chart = samples("time", SAMPLED + bands((0, 0.0), method="Recursion"))
    points = [item for items in alt_scene.marks(chart, "symbol") for item in items]
    (zero,) = [item for item in points if "Recursion" in item["description"]]
    assert zero["y"] == HEIGHT - BAND / 2
    (area,) = alt_scene.marks(chart, "area")
    assert max(item["y"] for item in area) < HEIGHT - BAND
    assert "0" in alt_scene.texts(chart)


def test_methods_have_shapes_of_their_own():
    assert len({palette.shape(method) for method in palette.METHODS}) == len(palette.METHODS)
