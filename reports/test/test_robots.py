"""A campaign of many robots on the page."""

import pytest

from read.data import Data, DataError
from read.robots import COLUMNS
from sections import robots

ROWS = """\
arm,arm:7,Ladder<A>,float32,5,Payload on link7,times its mass,30,1e8,2,
arm,arm:7,Ladder<A>,float32,5,Poses,,1,1,0,
arm,arm:7,Ladder<A>,float32,5,Light rod,times as long,,1e4,1,
bad,,,,,,,,,,body link2: mass is negative
weak,weak:3,,,,Poses,,,1,7,
"""


@pytest.fixture
def take(read):
    return lambda rows: read("robots-campaign.csv", ",".join(COLUMNS) + "\n" + rows)


def test_a_robot_has_what_it_keeps_and_where_that_ends(take):
    judged, refused = robots.section(take(ROWS)).tables
    assert judged.rows == [
        [
            "arm",
            "7",
            "Ladder<A>, float32: 5 digits",
            "Payload on link7: 30 times its mass; Light rod: at once",
            "3",
        ],
        ["weak", "3", "–", "Poses: at once", "7"],
    ]
    assert refused.rows == [["bad", "Body link2: mass is negative."]]


def test_without_such_a_campaign_there_is_nothing_of_it():
    assert robots.section(Data()) is None


@pytest.mark.parametrize(
    "row",
    [
        "arm,arm,Ladder<A>,float32,5,Poses,,1,1,0,",
        "arm,arm:7,Ladder<A>,float32,many,Poses,,1,1,0,",
        "arm,arm:7,Ladder<A>,float32,5,Poses,,nan,1,0,",
        "arm,arm:7,Ladder<A>,float32,5,Poses,,1,1,-1,",
        ",arm:7,Ladder<A>,float32,5,Poses,,1,1,0,",
    ],
)
def test_what_is_no_such_record_is_refused_by_name(take, row):
    with pytest.raises(DataError, match=r"robots-campaign.csv:2"):
        take(row + "\n")


def test_a_robot_that_stands_twice_is_refused(take):
    with pytest.raises(DataError, match="stress of a robot of arm/Poses is recorded 2 times"):
        take(2 * "arm,arm:7,Ladder<A>,float32,5,Poses,,1,1,0,\n")
