"""The whole free-space diagram of two polylines, cell by cell: slow, plain, and shares no code with what it judges."""

from __future__ import annotations

Point = list[float]


def passes(own: list[Point], path: list[Point], radius: float) -> bool:
    """Whether both can be run beside each other, forward only; every triple of coordinates has to keep the radius."""
    own, path = (values * 2 if len(values) == 1 else values for values in (own, path))
    rows, columns = len(own) - 1, len(path) - 1
    if apart(own[0], path[0]) > radius or apart(own[-1], path[-1]) > radius:
        return False
    below: list[tuple[float, float] | None] = []
    reached = True
    for k in range(columns):
        free = within(own[0], path[k], path[k + 1], radius)
        below.append(free if reached and free and free[0] <= 0 else None)
        reached = below[-1] is not None and below[-1][1] >= 1 and apart(own[0], path[k + 1]) <= radius
    reached = True
    for i in range(rows):
        free = within(path[0], own[i], own[i + 1], radius)
        left = free if reached and free and free[0] <= 0 else None
        reached = left is not None and left[1] >= 1
        for k in range(columns):
            above = within(own[i + 1], path[k], path[k + 1], radius)
            right = within(path[k + 1], own[i], own[i + 1], radius)
            entered = below[k]
            below[k] = above if left else _from(entered, above)
            left = right if entered else _from(left, right)
    return below[-1] is not None and below[-1][1] >= 1


def _from(entry: tuple[float, float] | None, free: tuple[float, float] | None) -> tuple[float, float] | None:
    if entry is None or free is None or entry[0] > free[1]:
        return None
    return max(entry[0], free[0]), free[1]


def within(point: Point, start: Point, end: Point, radius: float) -> tuple[float, float] | None:
    """Fractions from and to which a segment is near a point."""
    low, high = 0.0, 1.0
    for c in range(0, len(point), 3):
        way = [end[i] - start[i] for i in range(c, c + 3)]
        away = [point[i] - start[i] for i in range(c, c + 3)]
        a, b = sum(x * x for x in way), sum(x * y for x, y in zip(way, away, strict=True))
        rest = sum(x * x for x in away) - radius * radius
        if a == 0:
            if rest > 0:
                return None
            continue
        root = b * b - a * rest
        if root < 0:
            return None
        low, high = max(low, (b - root**0.5) / a), min(high, (b + root**0.5) / a)
    return (low, high) if low <= high else None


def apart(one: Point, other: Point) -> float:
    """Largest distance of the triples."""
    squares = [(x - y) ** 2 for x, y in zip(one, other, strict=True)]
    return max(sum(squares[c : c + 3]) ** 0.5 for c in range(0, len(squares), 3))
