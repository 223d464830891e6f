"""Each claim's rule: on data that confirm it, that refute it, and that lack what it needs."""

from fnmatch import fnmatchcase

import pytest

import fake_stress
from claims import CLAIMS
from claims.claim import Check, Claim, Plot
from claims.contacts import ARRAYS
from claims.needed import VARIANTS
from read.contacts import ContactError
from read.data import Data, Time
from read.readers import load
from read.stress import U

ABA = "Sequential<Conventional>"
MGS = "Sequential<ArrayMGS>"
GIVENS = "Sequential<ArrayGivens>"
CHOLESKY = "Batch<EigenLLT>"
NAMES = {f"C{number}": decide for number, decide in enumerate(CLAIMS, 1)}


def standing(error=lambda variant, d: 5 * U["float32"], variants=ARRAYS) -> list[ContactError]:
    """A robot on three contacts; an error of None is a refusal."""
    return [
        ContactError(
            "g1:35", 3, d, "float32", variant, state, "ok" if at else "singular", False, at, 3.0
        )
        for variant in variants
        for d in (1e2, 1e6, 1e10)
        for state in range(3)
        for at in [error(variant, d)]
    ]


def timed(data: Data, ratio: float = 1.4) -> Data:
    """With ABA, and ABA refined, on one scene, and a robot that stands."""
    data.contact_errors.extend(standing())
    for variant, nanoseconds in ((ABA, 100.0), (f"Refined<{ABA}>", 100 * ratio)):
        data.times.append(
            Time("panda:7", variant, "float64", "acceleration", nanoseconds, None, 1, "")
        )
    return data


@pytest.fixture(scope="module")
def confirming(tmp_path_factory) -> Data:
    folder = tmp_path_factory.mktemp("claims")
    fake_stress.write(folder)
    return timed(load(folder))


@pytest.fixture
def changed(tmp_path):
    def changed(change, ratio: float = 1.4) -> Data:
        fake_stress.write(tmp_path, change)
        return timed(load(tmp_path), ratio)

    return changed


def is_row(row: dict, **wanted) -> bool:
    return all(row.get(name) == value for name, value in wanted.items())


def worse(factor, **wanted):
    """Makes the answers of these rows worse; `factor` may depend on the row."""

    def change(row):
        if is_row(row, status="ok", **wanted) and row["relative"]:
            times = factor(row) if callable(factor) else factor
            error = row["relative"] * times
            row |= {"relative": error, "estimate": 1.5 * error}
            if row["kS"]:
                row["eta"] = error / (U[row["precision"]] * row["kS"])
        return row

    return change


def without(**wanted):
    return lambda row: None if is_row(row, **wanted) else row


def setting(values, **wanted):
    return lambda row: row | values if is_row(row, **wanted) else row


def test_a_claim_is_refuted_by_one_check_and_open_by_one_absence():
    def claim(*held) -> str:
        values = {True: 0.5, False: 2.0, None: None}
        checks = [Check.within("", values[holds], 0, 1) for holds in held]
        return Claim("", "", "", checks, Plot("", "", [])).verdict

    assert claim(True, True) == "confirmed"
    assert claim(True, None) == "open"
    assert claim(None, False, True) == "refuted"
    assert claim() == "open"


@pytest.mark.parametrize("name", NAMES)
def test_data_made_to_confirm_confirms(confirming, name):
    claim = NAMES[name](confirming)
    assert claim.id == name
    assert claim.verdict == "confirmed", [check for check in claim.checks if not check.holds]


@pytest.mark.parametrize("name", NAMES)
def test_without_data_a_claim_is_open(name):
    claim = NAMES[name](Data())
    assert claim.verdict == "open" and claim.checks
    assert all(check.measured == "not in this run" for check in claim.checks)
    assert claim.plot.rows == []


def by_value(power: float):
    return lambda row: max(row["value"], 1) ** power


REFUTING = [
    # ABA's error grows with N, a little too fast; its size is too large; Cholesky's does not grow.
    ("C1", worse(by_value(0.3), family="random_chain", variant=ABA)),
    ("C1", worse(30, family="straight", variant=ABA)),
    ("C1", worse(by_value(-1.5), family="straight", variant=CHOLESKY)),
    # One family off the law; a failure where the law promises an answer.
    ("C2", worse(40, family="heavy_base", variant=CHOLESKY)),
    ("C2", worse(1e-2, family="taper", variant=CHOLESKY)),
    (
        "C2",
        setting(
            {"status": "indefinite", "relative": "", "eta": ""}, family="taper", variant=CHOLESKY
        ),
    ),
    # Slopes of another tier; float32 worse than float64.
    ("C3", worse(by_value(-0.5), family="heavy_tip", variant=ABA)),
    ("C3", worse(by_value(0.5), family="heavy_point", variant="Sequential<Potter>")),
    ("C3", worse(by_value(0.2), family="heavy_tip", variant=GIVENS, precision="float64")),
    ("C3", worse(1e3, family="heavy_tip", variant=GIVENS, precision="float32")),
    (
        "C3",
        setting(
            {"status": "singular", "relative": "", "eta": ""},
            family="heavy_tip",
            variant=GIVENS,
            value=1e6,
        ),
    ),
    # Joseph better than it may be; another power in the world's frame.
    ("C4", worse(0.05, family="heavy_tip", variant="Sequential<Joseph>")),
    ("C4", worse(by_value(-2), family="base_offset", variant="Sequential<WorldOrigin<Joseph>>")),
    # Still dependent on the gap; the gain too small.
    (
        "C5",
        worse(lambda row: row["value"] ** -0.5, family="axis_gap", variant="Sequential<Zeroed>"),
    ),
    ("C5", worse(1e4, family="axis_gap", variant="Sequential<Zeroed>")),
    # More calls at one ratio; a run that gives up; a rival that does not stall.
    (
        "C6",
        lambda row: (
            row | {"calls": row["calls"] + 20}
            if is_row(row, variant="FactoredBias<ArrayMGS>", value=1e10) and "calls" in row
            else row
        ),
    ),
    (
        "C6",
        lambda row: (
            row | {"finished": 0}
            if is_row(row, variant="FactoredBias<ArrayMGS>", value=1e10) and "calls" in row
            else row
        ),
    ),
    (
        "C6",
        lambda row: (
            row | {"calls": fake_stress.CALLS[row["seed"]], "finished": 1}
            if is_row(row, variant=ABA) and "calls" in row
            else row
        ),
    ),
    # Residuals that show the error: of the one kind, of the other, and a large one.
    (
        "C7",
        lambda row: (
            row | {"oettli_prager": 100 * row["oettli_prager"]}
            if is_row(row, variant=ABA, task="random", family="heavy_tip") and row["oettli_prager"]
            else row
        ),
    ),
    (
        "C7",
        lambda row: (
            row | {"backward": 100 * row["backward"]}
            if is_row(row, variant=CHOLESKY, task="inverse") and row["backward"]
            else row
        ),
    ),
    # Far above the law; worse than before.
    ("C8", worse(100, variant=f"Refined<{MGS}>")),
    # Too narrow a stretch; a failure in it.
    (
        "C9",
        worse(
            lambda row: 1e-3 if row["value"] > 1e6 else 1,
            variant=ABA,
            precision="float32",
            family="heavy_tip",
        ),
    ),
    (
        "C9",
        lambda row: (
            row | {"estimate": row["relative"] / 4}
            if is_row(row, variant=ABA, status="ok")
            else row
        ),
    ),
    # Another growth; digits lost; digits kept where they should be lost.
    (
        "C10",
        lambda row: (
            row | {"kappa": row["value"] ** 4}
            if is_row(row, family="non_minimum_phase_length")
            else row
        ),
    ),
    ("C10", worse(100, family="non_minimum_phase_length", variant="Sequential<UD>")),
    ("C10", worse(1e-3, family="non_minimum_phase", variant=ABA)),
    # One family worse than in sequence, by a failure, in the other task; ever worse with N.
    ("C11", worse(21, family="taper", variant="Scan<Conventional>")),
    ("C11", worse(21, family="heavy_point", variant="Scan<SquareRoot>")),
    ("C11", worse(11, family="heavy_tip", variant="Scan<SquareRoot>", task="dynamics")),
    (
        "C11",
        setting(
            {"status": "singular", "relative": "", "eta": ""},
            family="heavy_base",
            variant="Scan<Conventional>",
            value=1e3,
        ),
    ),
    (
        "C11",
        worse(
            lambda row: 2 * max(row["value"] / 16, 1) ** 0.52,  # at most 9 times
            family="random_chain",
            variant="Scan<SquareRoot>",
        ),
    ),
]


@pytest.mark.parametrize(
    "name, change", REFUTING, ids=[f"{n}-{i}" for i, (n, _) in enumerate(REFUTING)]
)
def test_data_made_to_refute_refutes(changed, name, change):
    assert NAMES[name](changed(change)).verdict == "refuted"


def test_a_refinement_that_costs_too_much_refutes(changed):
    assert NAMES["C8"](changed(None, ratio=1.6)).verdict == "refuted"


def test_an_answer_that_refinement_spoils_refutes(changed):
    def spoil(row):
        if is_row(row, variant=f"Refined<{ABA}>", family="heavy_tip", value=1e16, seed=1):
            row |= {"unrefined": row["relative"] / 2.5} if row["relative"] else {}
        return row

    claim = NAMES["C8"](changed(spoil))
    assert claim.verdict == "refuted"
    assert claim.checks[1].measured.startswith("4 of ")  # two tasks, two precisions


def test_the_numbers_follow_from_the_variants_that_are_said_to_be_needed(confirming, changed):
    needed = changed(
        lambda row: row if any(fnmatchcase(row["variant"], name) for name in VARIANTS) else None
    )
    for decide in CLAIMS:
        numbers, all_ = ([it.number for it in decide(data).checks] for data in (needed, confirming))
        assert numbers == all_


UNREFINED = ("FactoredBias<ArrayGivens>", "WideRefined<*")  # of made-up variants


@pytest.mark.parametrize("left_out", [name for name in VARIANTS if name not in UNREFINED])
def test_none_of_them_is_needed_for_nothing(confirming, changed, left_out):
    fewer = changed(lambda row: None if fnmatchcase(row["variant"], left_out) else row)
    assert [decide(fewer).checks for decide in CLAIMS] != [
        decide(confirming).checks for decide in CLAIMS
    ]


MISSING = [
    ("C1", without(family="straight", variant=CHOLESKY)),
    ("C2", lambda row: row if row["family"] in ("straight", "taper") else None),
    ("C3", without(family="heavy_point")),
    ("C4", without(family="base_offset")),
    ("C5", without(variant="Sequential<Zeroed>")),
    ("C6", lambda row: None if "calls" in row and row["variant"] == MGS else row),
    ("C7", without(task="inverse")),
    ("C8", lambda row: None if row["variant"].startswith("Refined<") else row),
    ("C9", without(precision="float32", variant=ABA, family="heavy_tip", task="random")),
    ("C10", without(family="non_minimum_phase")),
    ("C11", without(variant=GIVENS)),
    ("C11", lambda row: None if row["family"] in ("straight", "random_chain") else row),
]


@pytest.mark.parametrize(
    "error",
    [lambda variant, d: 1e-7 * d**0.5, lambda variant, d: None if d > 1e8 else 1e-7],
    ids=["grows", "is refused"],
)
def test_one_array_that_loses_digits_to_stiff_contacts_refutes(error):
    data = Data()
    kept = standing(variants=ARRAYS[:2])
    data.contact_errors.extend(kept)
    assert NAMES["C12"](data).verdict == "open"
    data.contact_errors.extend(standing(error, ARRAYS[2:]))
    claim = NAMES["C12"](data)
    assert claim.verdict == "refuted"
    assert [check.holds for check in claim.checks] == [True, True, False]
    assert "d = 1e+10 kg" in claim.checks[2].measured


@pytest.mark.parametrize("name, change", MISSING, ids=[name for name, _ in MISSING])
def test_a_claim_whose_data_is_absent_is_open(changed, name, change):
    assert NAMES[name](changed(change)).verdict == "open"


def test_the_slopes_are_those_of_the_laws(confirming):
    numbers = {check.what: check.measured for check in NAMES["C3"](confirming).checks}
    assert numbers[f"{ABA}, float64"] == "1.00 ± 0.00"
    assert numbers["Sequential<Potter>, float64, point mass"] == "0.50 ± 0.00"
    assert numbers[f"{MGS}, float32, beyond 1/u"].startswith("1.00 ± 0.0")
    length = {check.what: check.measured for check in NAMES["C1"](confirming).checks}
    assert length["exponent of Cholesky’s error, straight chain"] == "4"
    growth = NAMES["C10"](confirming).checks[0]
    assert growth.measured == "5.44"
