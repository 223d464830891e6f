"""Adds up units and merged units of one campaign, to the byte the same in whatever order.

Refuses another key, other sums, and mechanisms or replicates that would count twice.
"""

from collections.abc import Iterable
from pathlib import Path

from page.output import write
from read import campaign_files, replicate_files
from read.campaign import Campaign, MergeError
from read.checks import read_document
from read.data import DataError
from read.replicates import Replicates


def read(file: Path) -> Campaign | Replicates:
    document = read_document(file)
    of_claims = isinstance(document, dict) and document.get("format") == replicate_files.FORMAT
    return (replicate_files if of_claims else campaign_files).from_document(file, document)


def written(total: Campaign | Replicates) -> str:
    of_claims = isinstance(total, Replicates)
    return (replicate_files if of_claims else campaign_files).written(total)


def merged(files: Iterable[Path]) -> Campaign | Replicates:
    """One file is held at a time."""
    total, first = None, None
    for file in files:
        part = read(file)
        if total is None:
            # not `part` itself: what is counted twice is found in the first file as well
            total, first = part.emptied(), file
        try:
            if type(part) is not type(total):
                raise MergeError("a campaign of another kind")
            total.add(part)
        except MergeError as error:
            raise DataError(f"{file}: not to be merged with {first}: {error}") from None
    if total is None:
        raise DataError("no file to merge")
    return total


def run(files: list[Path], out: Path, sum_over: list[str]) -> None:
    total = merged(files)
    if sum_over:
        if not isinstance(total, Campaign):
            raise DataError("--sum-over: claims have no groups to sum over")
        total = total.sum_over(sum_over)
    write(out, written(total))
