"""Runs a worker that writes all its rows too, and keeps these as Parquet: a fifth of the bytes.

rows.py FILE.parquet WORKER OPTION…
"""

import os
import subprocess
import sys
from pathlib import Path

import duckdb

ROOT = Path(__file__).parents[2]
sys.path[1:1] = [str(ROOT / "scripts"), str(ROOT / "reports")]
from children import end_with_parent  # noqa: E402
from read.stress import COLUMNS, TEXTS  # noqa: E402

WHOLE = ("n", "seed", "steps", "widened")
ORDER = ("family", "value", "task", "variant", "precision", "seed")  # of like beside like


def kind(column: str) -> str:
    return "VARCHAR" if column in TEXTS else "BIGINT" if column in WHOLE else "DOUBLE"


def convert(rows: Path, parquet: Path) -> None:
    """Under another name until it is whole."""
    partial = parquet.with_suffix(".partial")
    table = duckdb.read_csv(
        str(rows), header=True, columns={name: kind(name) for name in COLUMNS}, auto_detect=False
    )
    table.order(", ".join(ORDER)).write_parquet(str(partial), compression="zstd")
    with partial.open("rb") as file:
        os.fsync(file.fileno())
    partial.replace(parquet)


def main() -> int:
    parquet, command = Path(sys.argv[1]), sys.argv[2:]
    rows = parquet.with_suffix(".csv")
    worker = [*command, f"--rows={rows}"]
    code = subprocess.run(worker, check=False, preexec_fn=end_with_parent(os.getpid())).returncode
    if code:
        return code
    try:
        convert(rows, parquet)
    except (duckdb.Error, OSError) as error:
        print(f"rows: error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    finally:
        rows.unlink(missing_ok=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
