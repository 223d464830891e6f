"""Small records of every kind, to be changed by a test."""

import fake_estimation
from read.readers import COLUMNS, SAMPLE_COLUMNS

HEADER = ",".join(COLUMNS)
ROW = "panda:7,7,Batch<EigenLLT>,float64,inverse,0,relative,1.5e-16,ok"
ROBOT = {
    "scene": "panda:7",
    "states": 100,
    "notes": [],
    "mass": {"max": 1e-15, "median": 1e-16, "bound": 1e-13},
    "mass_variants": [{"variant": "CRBA", "mass": {"max": 1e-15, "median": 1e-16}}],
    "variants": [],
    "pass": True,
}
SAMPLES = ",".join(SAMPLE_COLUMNS)
SAMPLE = "panda:7,7,M,MonteCarlo,64,0,0.25,1e-4,2"


def timed(name="inverse/Batch<EigenLLT>/panda:7/float64", **row):
    return {
        "name": name,
        "run_name": name,
        "run_type": "iteration",
        "real_time": 1.0,
        "time_unit": "ns",
    } | row


def paper(**residual):
    """A record of one erratum, whose residual in mp is as said."""
    document = fake_estimation.paper("chain:6")
    document["rows"] = [row for row in document["rows"] if row["id"] == "(3.12)"]
    document["rows"][0]["residuals"]["mp"] |= residual
    return document


def changed(document: dict, **row):
    document["rows"][0] |= row
    return document


def fast(name="acceleration_batch/Ladder<default>/g1:35/float64", **row):
    """A call of 1000 states during which other programs had the processor half of the time."""
    return timed(name, real_time=50.0, cpu_time=25.0, time_unit="us", **row)


def peak(precision: str, rate: float):
    return timed(f"peak/fma/native/{precision}") | {"FLOP/s": rate}
