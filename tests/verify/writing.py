"""Small, plain writer of correct NC texts: proportional rounding, no regard for speed of reading or of writing.

Shares no code with the package; it knows the NC text contract and formula for L of docs/method.md, nothing else.
"""

from __future__ import annotations

import numpy as np

RETRACT = ["G91 G28 Z0.", "G90"]
HEAD = ["%", "O0001", "(TEST)", "G21 G90 G94 G17 G40 G49 G80", *RETRACT, "G54"]
TAIL = [*RETRACT, "G49", "M30", "%"]


def unit(v):
    v = np.asarray(v, float)
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def transitions(tip, axis, eps, h, rounding=2e-4, sharp=()):
    """Control points (k, 5, 6) of the inner poses, and which are rounded; sharp poses get none."""
    x = np.hstack((tip, tip + h * axis))
    d = np.diff(x, axis=0)
    m = np.sqrt((d**2).sum(1) / 2)
    u = d / m[:, None]
    du = u[1:] - u[:-1]
    lim = np.minimum(m[:-1], m[1:]) / 2
    for part in (du[:, :3], du[:, 3:]):
        size = np.linalg.norm(part, axis=1)
        lim = np.minimum(
            lim, np.divide((eps - rounding) * 5.6, size, out=np.full_like(lim, np.inf), where=size > 1e-12)
        )
    cosine = (u[1:] * u[:-1]).sum(1) / 2
    rounded = (lim > 4 * rounding) & (cosine > -0.98) & (np.abs(du).max(1) > 1e-3)
    for i in sharp:
        rounded[i - 1] = False
    lead, trail = lim[:, None] * u[:-1], lim[:, None] * u[1:]
    c = x[1:-1]
    return np.stack((c - lead, c - 2 / 3 * lead, c, c + 2 / 3 * trail, c + trail), axis=1), rounded


def curve(cp, t):
    """Point of the five-point cubic with knots 0 0 0 0 1/2 1 1 1 1 by de Boor."""
    knots = [0, 0, 0, 0, 0.5, 1, 1, 1, 1]
    k = 3 if t < 0.5 else 4
    d = [cp[:, j + k - 3] for j in range(4)]
    for r in range(1, 4):
        for j in range(3, r - 1, -1):
            low, high = knots[j + k - 3], knots[j + 1 + k - r]
            a = (t - low) / (high - low)
            d[j] = (1 - a) * d[j - 1] + a * d[j]
    return d[3]


def number(v, decimals):
    text = f"{v:.{decimals}f}"
    return text[1:] if float(text) == 0 and text[0] == "-" else text


def place_g1(tip, axis, decimals=4):
    return " ".join(
        [f"{w}{number(v, decimals)}" for w, v in zip("XYZ", tip, strict=True)]
        + [f"{w}{number(v, 7)}" for w, v in zip("IJK", axis, strict=True)]
    )


def place_g62(tip, point, decimals=4):
    return " ".join(
        [f"{w}{number(v, decimals)}" for w, v in zip("XYZ", tip, strict=True)]
        + [f"{w}{number(v, decimals)}" for w, v in zip("UVW", point, strict=True)]
    )


def chain_lines(tip, axis, eps, h, form, feed=None, sharp=(), samples=4, scale=1.0, decimals=4):
    """Motion blocks of one chain, from its first pose (not written) to its last; feed (n-1,) or a number or None."""
    n = len(tip)
    feeds = [None] * (n - 1) if feed is None else list(np.broadcast_to(feed, n - 1))
    if form == "g6.2":  # F cannot change inside a curve
        sharp = {*sharp, *(i for i in range(1, n - 1) if feeds[i - 1] != feeds[i])}
    cps, rounded = transitions(tip, axis, eps, h, sharp=sharp) if n > 2 else (np.zeros((0, 5, 6)), [])
    lines, last, said = [], None, None

    def f(i):
        nonlocal said
        if feeds[i] is None or feeds[i] == said:
            return ""
        said = feeds[i]
        return f" F{said:g}." if said == int(said) else f" F{said:g}"

    def g1(x, i):
        nonlocal last
        a, b = x[:3], x[3:]
        text = place_g62(a / scale, b / scale, decimals)
        if form == "g1":
            text = place_g1(a / scale, unit(b - a), decimals)
        if text != last:
            lines.append("G1 " + text + f(i))
            last = text

    start = np.hstack((tip[0], tip[0] + h * axis[0]))
    last = (
        place_g1(tip[0] / scale, axis[0], decimals)
        if form == "g1"
        else place_g62(start[:3] / scale, start[3:] / scale, decimals)
    )
    for i in range(1, n):
        if i < n - 1 and rounded[i - 1]:
            cp = cps[i - 1]
            g1(cp[0], i - 1)
            if form == "g1":
                for t in np.linspace(0, 1, 2 * samples + 1)[1:]:
                    g1(curve(cp[None], t)[0], i - 1 if t <= 0.5 else i)
            else:
                for j in range(5):
                    text = place_g62(cp[j, :3] / scale, cp[j, 3:] / scale, decimals)
                    if j == 0:
                        assert text == last
                        lines.append(f"G6.2 P4 K0. {text} R1.{f(i - 1)}")
                    else:
                        lines.append(f"K{'0.5' if j == 4 else '0.'} {text} R1.")
                lines += ["K1."] * 4
                last = text
        else:
            g1(np.hstack((tip[i], tip[i] + h * axis[i])), i - 1)
    return lines


def head(form, tool=1):
    return [*HEAD, *([f"G43.5 H{tool}"] if form == "g1" else [])]


def rapid(tip, axis, h, form, scale=1.0, decimals=4):
    if form == "g1":
        return "G0 " + place_g1(tip / scale, axis, decimals)
    return "G0 " + place_g62(tip / scale, (tip + h * axis) / scale, decimals)


def simple_text(tip, axis, eps, h, form, feed=250.0, **options):
    """Whole program: rapid to the first pose, one chain, end."""
    lines = [*head(form), rapid(tip[0], axis[0], h, form)]
    lines += chain_lines(tip, axis, eps, h, form, feed, **options)
    return ("\n".join(lines + TAIL) + "\n").encode()


def wavy(n, step=0.3, seed=0, tilt=0.3):
    """A five-axis path that wanders: (n, 3) tips and unit axes."""
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(0, 0.15, n))
    tip = np.cumsum(np.stack((np.cos(heading), np.sin(heading), 0.2 * rng.normal(0, 1, n)), 1) * step, axis=0)
    s = np.arange(n) * step
    axis = unit(np.stack((tilt * np.sin(s / 7), tilt * np.cos(s / 5), np.ones(n)), 1))
    return tip.round(4), unit(axis.round(7))


def corners(n, seed=0, step=(0.6, 3.0)):
    """A five-axis path with real corners: (n, 3) tips and unit axes."""
    rng = np.random.default_rng(seed)
    turns = np.radians(rng.uniform(10, 60, n)) * rng.choice([-1, 1], n)
    heading = np.cumsum(turns)
    length = rng.uniform(*step, n)
    rise = rng.uniform(-0.3, 0.3, n)
    tip = np.cumsum(np.stack((np.cos(heading), np.sin(heading), rise), 1) * length[:, None], axis=0)
    tilt = np.cumsum(rng.uniform(-0.06, 0.06, (n, 2)), axis=0)
    axis = unit(np.stack((tilt[:, 0], tilt[:, 1], np.ones(n)), 1))
    return tip.round(4), unit(axis.round(7))


def job(form, eps=0.02, h=10.0, seed=0):
    """A program with everything in it, and its correct text as a list of lines.

    Rapid, chain with a change of feed, optional stop, chain, dwell, chain, rapid out, over and in, second chain.
    """
    from cornersmooth.model import Move, Program, Statement

    tip, axis = corners(34, seed)
    tip[27:] += [0, 0, 2.0]
    kind = np.full(34, Move.LINEAR, np.uint8)
    kind[[0, 24, 25, 26]] = Move.RAPID
    feed = np.full(34, 250.0)
    feed[8:] = 400.0
    feed[27:] = 123.5
    statements = (
        Statement(0, 1, "LOADTL", (3.0,), "LOADTL/3"),
        Statement(0, 2, "SPINDL", (12000.0, "RPM", "CLW"), "SPINDL/12000,RPM,CLW"),
        Statement(0, 3, "COOLNT", ("ON",), "COOLNT/ON"),
        Statement(14, 40, "OPSTOP", (), "OPSTOP"),
        Statement(19, 50, "DELAY", (1.5,), "DELAY/1.5"),
        Statement(24, 60, "COOLNT", ("OFF",), "COOLNT/OFF"),
        Statement(26, 70, "COOLNT", ("MIST",), "COOLNT/MIST"),
        Statement(34, 90, "SPINDL", ("OFF",), "SPINDL/OFF"),
        Statement(34, 91, "FINI", (), "FINI"),
    )
    line = np.arange(100, 134)
    program = Program.from_poses(tip, axis, kind=kind, feed=feed, line=line, statements=statements)

    def chain(first, last, with_feed):
        feeds = feed[first + 1 : last + 1]
        lines = chain_lines(tip[first : last + 1], axis[first : last + 1], eps, h, form, feeds)
        if not with_feed:
            lines[0] = lines[0].rsplit(" F", 1)[0]
        return lines

    def go(i):
        return rapid(tip[i], axis[i], h, form)

    text = [*HEAD, "T3 M6", "S12000 M3", "M8", "G43.5 H3" if form == "g1" else "G43 H3", go(0)]
    text += [*chain(0, 13, True), "M1", "M3", "M8", *chain(13, 18, False), "G4 P1500", *chain(18, 23, False), "M9"]
    text += [go(24), go(25), "M7", go(26), *chain(26, 33, True), "M5", *TAIL]
    return program, text


def encode(lines):
    return ("\n".join(lines) + "\n").encode()
