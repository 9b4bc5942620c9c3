"""Cost of an image of a given true error, from measured points of a program's settings."""
import math
from typing import NamedTuple


class Point(NamedTuple):
    """One setting of a program."""
    setting: str
    error: float        # true error of the image, in levels
    cpu_s: float        # of all threads, without those of an image of few pixels
    wall_s: float       # likewise
    rays: int = 0       # 0: the program does not count them as Whittle does


class Cost(NamedTuple):
    value: float
    setting: str        # the cheapest measured one that reaches the error


def frontier(points, field):
    """The points that no other beats in both cost and error, from the cheapest to the most accurate. Points that cost less
    than an image of few pixels, which was subtracted, are too short to measure."""
    found, measurable = [], [point for point in points if getattr(point, field) > 0]
    for point in sorted(measurable, key=lambda point: (getattr(point, field), point.error)):
        if not found or point.error < found[-1].error:
            found.append(point)
    return found


def cost_at(points, target, field):
    """The Cost of a true error of `target`: the logarithm of the cost is interpolated linearly over that of the error,
    between the two neighbours on the frontier. None if no setting reaches the target: nothing is extrapolated. If the
    cheapest setting reaches it, its cost counts."""
    front = frontier(points, field)
    at = next((i for i, point in enumerate(front) if point.error <= target), None)
    if at is None:
        return None
    below = front[at]
    if at == 0 or below.error <= 0:
        return Cost(getattr(below, field), below.setting)
    above = front[at - 1]
    share = math.log(above.error / target) / math.log(above.error / below.error)
    low, high = getattr(above, field), getattr(below, field)
    return Cost(low * (high / low) ** share, below.setting)


class Ratio(NamedTuple):
    """Cost of other points relative to that of ours. Not `exact` if they never reach the error: then that of the dearest."""
    value: float
    exact: bool


def ratio_at(points, ours, target, field):
    """The Ratio at a true error of `target`; None if ours never reaches it, or if all of theirs are too short to measure."""
    cost, base, theirs = cost_at(points, target, field), cost_at(ours, target, field), frontier(points, field)
    if not base or not theirs:
        return None
    dearest = max(getattr(point, field) for point in points)
    return Ratio((cost.value if cost else dearest) / base.value, cost is not None)


def geometric_mean(ratios):
    """Over the exact ones; None without any."""
    exact = [ratio.value for ratio in ratios if ratio and ratio.exact]
    return math.exp(sum(map(math.log, exact)) / len(exact)) if exact else None
