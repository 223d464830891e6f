"""The roofline: how near our calls come to what arithmetic and memory allow.

A call of W flops a state that must move Q bytes a state, its arguments read once and its result
written once, has the intensity

    I = W / Q                                                                           (1)

With P the peak of arithmetic and b(s) the bandwidth of a copy of s bytes, no call whose arrays have
s bytes does more flops a second than its roof

    R = min(P, b(s) I),   s = Q n of n states                                           (2)

Memory bounds it below the ridge, arithmetic from there on:

    I* = P / b(s)                                                                       (3)

b(s) is measured for some s. What is taken is the largest of these that is not above the call's, or
else the smallest: smaller arrays are copied faster, so that the roof is not too low.
"""

from typing import NamedTuple

from read.data import Bandwidth, Call, Data
from summary.groups import by_key

MEMORY, ARITHMETIC = "memory", "arithmetic"


class Placed(NamedTuple):
    """A call on the roofline."""

    call: Call
    copy: Bandwidth  # whose bandwidth is b(s)

    @property
    def intensity(self) -> float:
        """(1), in flops a byte."""
        return self.call.flops / self.call.bytes

    @property
    def arrays(self) -> float:
        """s of (2), in bytes."""
        return self.call.bytes * self.call.states

    @property
    def roof(self) -> float:
        """R of (2), in flops a second."""
        return min(self.call.peak, self.copy.rate * self.intensity)

    @property
    def share(self) -> float:
        return self.call.rate / self.roof

    @property
    def bound(self) -> str:
        """By (3)."""
        return MEMORY if self.intensity < self.call.peak / self.copy.rate else ARITHMETIC


def placed(data: Data) -> list[Placed]:
    """Of each scene, task and precision our fastest call whose flops and bytes are known, where
    peak and bandwidth were measured."""
    known = [
        call
        for call in data.peers
        if call.rate and call.flops and call.bytes and call.peak and call.bandwidths
    ]
    groups = by_key(known, lambda call: (call.time.scene, call.time.task, call.time.precision))
    fastest = [min(own, key=lambda call: call.time.nanoseconds) for own in groups.values()]
    return [Placed(call, _copy(call)) for call in fastest]


def _copy(call: Call) -> Bandwidth:
    below = [it for it in call.bandwidths if it.bytes <= call.bytes * call.states]
    return below[-1] if below else call.bandwidths[0]
