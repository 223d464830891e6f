"""Adds up units and merged units of one campaign, to the byte the same in whatever order.

Refuses another key, other sums, and mechanisms that would count twice.
"""

from collections.abc import Iterable
from pathlib import Path

from page.output import write
from read.campaign import Campaign, MergeError
from read.campaign_files import read, written
from read.data import DataError


def merged(files: Iterable[Path]) -> Campaign:
    """One file is held at a time."""
    campaign, first = None, None
    for file in files:
        part = read(file)
        if campaign is None:
            # not `part` itself: what is counted twice is found in the first file as well
            campaign, first = Campaign(part.key, summed=part.summed), file
        try:
            campaign.add(part)
        except MergeError as error:
            raise DataError(f"{file}: not to be merged with {first}: {error}") from None
    if campaign is None:
        raise DataError("no file to merge")
    return campaign


def run(files: list[Path], out: Path, sum_over: list[str]) -> None:
    write(out, written(merged(files).sum_over(sum_over)))
