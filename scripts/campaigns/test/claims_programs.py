"""Stands for the workers of a campaign of claims: claims_programs.py NAME OPTION…

What they write confirms all claims without times, but that C1 is refuted in every third replicate by
η of ABA on the straight chain. Environment as that of bin/stress; a fault is of a replicate: die,
refuse, early or late."""

import argparse
import hashlib
import json
import os
import signal
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "reports"), str(ROOT / "reports" / "test")]
import fake_campaign  # noqa: E402
import fake_stress  # noqa: E402

SEEDS = 150  # of a replicate
ABA = "Sequential<Conventional>"


def eta(replicate: int) -> float:
    """At most 10 by C1."""
    return (1 + replicate / 100) * (30 if replicate % 3 == 0 else 1)


def records(replicate: int) -> list[dict]:
    rows = fake_stress.records()
    for row in rows:
        if (row["family"], row["variant"]) == ("straight", ABA) and row["task"] == "random":
            row["eta"] = eta(replicate)
    return rows


def main() -> int:
    name = sys.argv.pop(1)
    parser = argparse.ArgumentParser(allow_abbrev=False)
    for option in ("--first-seed", "--jobs"):
        parser.add_argument(option, type=int)
    for option in ("--quick", "--list"):
        parser.add_argument(option, action="store_true")
    for option in ("--variant", "--unit", "--task", "--precision"):
        parser.add_argument(option)
    for option in ("--json", "--out"):
        parser.add_argument(option, type=Path)
    options = parser.parse_args()
    if options.list:
        options.json.write_text(json.dumps(fake_stress.described()))
        return 0
    if options.unit:
        program = hashlib.sha1(Path(os.environ["FAKE_STRESS"]).read_bytes()).hexdigest()
        options.out.write_text(json.dumps(fake_campaign.unit("wild", 1.0, 1, 1, program)))
        return 0
    replicate, none = divmod(options.first_seed - 1, SEEDS)
    assert none == 0 and os.environ["KALMARM_CACHE"] == ""
    replicate += 1
    if name == "stress":
        rows = records(replicate)
        if log := os.environ.get("FAKE_LOG"):
            with open(log, "a") as file:
                print(os.getpid(), replicate, file=file)
        time.sleep(float(os.environ.get("FAKE_SECONDS", "0")))
    else:
        rows = fake_stress.integrations()
    fault = Path(os.environ.get("FAKE_FAULT", "/nonexistent"))
    faulty, mode = fault.read_text().split() if fault.exists() else ("0", "")
    if int(faulty) == replicate:
        if mode == "die":
            os.kill(os.getpid(), signal.SIGKILL)
        if mode == "refuse":
            print("stress: error: no memory", file=sys.stderr)
            return 2
        rows[0]["seed"] = 0 if mode == "early" else 1000  # of another replicate
    for row in rows:
        row["seed"] += options.first_seed - 1
    fake_stress.write_csv(options.out, rows[0], [fake_stress.line(row) for row in rows])
    return 0


if __name__ == "__main__":
    sys.exit(main())
