#!/usr/bin/env python3
"""Makes third_moments.json: third moments of the polygons of polygon_moments.json, exactly, about
the first vertex.

Every vertex is taken as the rational number its binary64 is; nothing is rounded before the end. The
integrals come from Green's theorem, term by term along the edges (exact integration of a cubic in the
edge's parameter), and not from the formulas the code uses.

    python3 tests/vectors/third_moments.py   # in the repository's root; writes beside itself
"""

import json
from fractions import Fraction
from math import comb
from pathlib import Path

HERE = Path(__file__).parent
PER_KIND = 12
# Third moments by name, with the power of x in each.
POWERS = [("xxx", 3), ("xxy", 2), ("xyy", 1), ("yyy", 0)]


def moment(vertices, p, q):
    """The integral of x^p y^q: the line integral of x^(p+1) y^q / (p+1) dy around the boundary."""
    total = Fraction(0)
    for (x, y), (x_next, y_next) in zip(vertices, vertices[1:] + vertices[:1]):
        dx, dy = x_next - x, y_next - y
        for i in range(p + 2):
            for j in range(q + 1):
                term = comb(p + 1, i) * x ** (p + 1 - i) * dx**i * comb(q, j) * y ** (q - j) * dy**j
                total += term * dy / (i + j + 1)
    return total / (p + 1)


def case(source):
    vertices = [(Fraction(x), Fraction(y)) for x, y in source["vertices"]]
    vx, vy = vertices[0]
    local = [(x - vx, y - vy) for x, y in vertices]
    about_vertex = {name: float(moment(local, p, 3 - p)) for name, p in POWERS}
    keep = {key: source[key] for key in ("id", "kind", "vertices")}
    return keep | {"about_vertex": about_vertex}


def main():
    cases = json.loads((HERE / "polygon_moments.json").read_text())["cases"]
    kinds = sorted({source["kind"] for source in cases})
    chosen = [source for kind in kinds for source in [c for c in cases if c["kind"] == kind][:PER_KIND]]
    lines = ",\n".join(json.dumps(case(source)) for source in chosen)
    note = "exact rational on the binary64 vertices, about the first one, correctly rounded; made by third_moments.py"
    head = f'"schema": "third_moments/1", "units": "m^5", "note": "{note}"'
    (HERE / "third_moments.json").write_text(f'{{{head}, "cases": [\n{lines}\n]}}\n')


if __name__ == "__main__":
    main()
