r"""On which side does a point lie? Answers that are never wrong.

A determinant is computed in floating point first, with a bound of its error (Shewchuk 1997,
doi:10.1007/PL00009321). Where its sign is in doubt it is found exactly. Every product of
coordinate differences is a sum of some floating-point numbers, its *terms*. These are added up
like numbers on paper, but from the left, and in digits of 40 bits:

     term       digits                   Columns are added up from left to right, and each sum is
     ----    --------------------        carried into the next column. The sign is known as soon as
      t0      12    -7     3  ...        the sum is more than all columns to the right can come to,
      t1     -12     8     0  ...        or nothing is left there.
      t2       0    -1    -4  ...
             --------------------        The terms are made anew for every column, so that nothing
      sum      0     0    -1             has to be stored.

That is exact as long as all coordinates are 0 or between 1e-75 and 1e75 in size: then no part of
a product is too large or too small for a floating-point number. Points are tuples of two or three
numbers.
"""

import math

import numpy as np

from tetsimplify.kernels.jit import cold_part, inlined, part

EPSILON = 2.0**-53
ERROR_2D = (3.0 + 16.0 * EPSILON) * EPSILON  # in units of the same sum with all terms positive
ERROR_3D = (7.0 + 56.0 * EPSILON) * EPSILON

SPLITTER = 2.0**27 + 1.0  # cuts a number into two of half the bits
DIGIT = 2.0**40  # units of a column in the unit of the column to its left
N_TERMS = 192.0  # 6 products of three differences; 8 choices of heads and tails; 4 terms of each


@inlined
def orient2d(a, b, c):
    """Whether a, b, c turn counter-clockwise (1), clockwise (-1), or are in line (0)."""
    left = (a[0] - c[0]) * (b[1] - c[1])
    right = (a[1] - c[1]) * (b[0] - c[0])
    determinant = left - right
    if abs(determinant) > ERROR_2D * (abs(left) + abs(right)):
        return 1 if determinant > 0.0 else -1
    return exact_orient3d(
        (a[0], a[1], 0.0), (b[0], b[1], 0.0), (c[0], c[1], 1.0), (c[0], c[1], 0.0)
    )


@inlined
def orient3d(a, b, c, d):
    """On which side of the plane through a, b, c the point d lies.

    Returns
    -------
    int
        1 below, where a, b, c are seen clockwise; -1 above; 0 in the plane, or where a, b, c are
        in line.
    """
    ax, ay, az = a[0] - d[0], a[1] - d[1], a[2] - d[2]
    bx, by, bz = b[0] - d[0], b[1] - d[1], b[2] - d[2]
    cx, cy, cz = c[0] - d[0], c[1] - d[1], c[2] - d[2]
    bc, cb = bx * cy, cx * by
    ca, ac = cx * ay, ax * cy
    ab, ba = ax * by, bx * ay
    determinant = az * (bc - cb) + bz * (ca - ac) + cz * (ab - ba)
    size = (
        abs(az) * (abs(bc) + abs(cb))
        + abs(bz) * (abs(ca) + abs(ac))
        + abs(cz) * (abs(ab) + abs(ba))
    )
    if abs(determinant) > ERROR_3D * size:
        return 1 if determinant > 0.0 else -1
    return exact_orient3d(a, b, c, d)


@cold_part
def exact_orient3d(a, b, c, d):
    """The same as :func:`orient3d`, slowly."""
    x = _difference(a[0], d[0]), _difference(b[0], d[0]), _difference(c[0], d[0])
    y = _difference(a[1], d[1]), _difference(b[1], d[1]), _difference(c[1], d[1])
    z = _difference(a[2], d[2]), _difference(b[2], d[2]), _difference(c[2], d[2])
    bound = _size(x) * _size(y) * _size(z)
    if bound == 0.0:
        return 0
    total = 0.0
    unit = math.ldexp(2.0, math.frexp(bound)[1])  # no term is as large
    finer = unit / DIGIT
    while finer > 0.0:
        total *= DIGIT
        is_exact = True
        for i in range(3):
            for step in range(1, 3):
                sign = 1.0 if step == 1 else -1.0
                for xi in x[i]:
                    for yj in y[(i + step) % 3]:
                        for zk in z[(i + 2 * step) % 3]:
                            if xi == 0.0 or yj == 0.0 or zk == 0.0:
                                continue
                            for term in _terms(sign * xi, yj, zk):
                                rest = np.fmod(term, unit) if abs(term) >= unit else term
                                digit = np.trunc(rest / finer)
                                total += digit
                                is_exact &= digit * finer == rest
        if is_exact or abs(total) >= N_TERMS:
            break
        unit = finer
        finer /= DIGIT
    return 1 if total > 0.0 else -1 if total < 0.0 else 0


@part
def _size(column):
    """The sum of the heads of a column, which bounds its entries but for rounding."""
    return abs(column[0][0]) + abs(column[1][0]) + abs(column[2][0])


@part
def _difference(a, b):
    """The difference a - b as a rounded number and its error (Knuth's two-sum)."""
    head = a - b
    b_part = a - head
    a_part = head + b_part
    return head, (a - a_part) + (b_part - b)


@part
def _terms(a, b, c):
    """The product abc as the sum of four terms."""
    head, tail = _product(a, b)
    first, second = _product(head, c)
    third, fourth = _product(tail, c)
    return first, second, third, fourth


@part
def _product(a, b):
    """The product ab as a rounded number and its error (Dekker's two-product)."""
    head = a * b
    a_high, b_high = SPLITTER * a, SPLITTER * b
    a_high, b_high = a_high - (a_high - a), b_high - (b_high - b)
    a_low, b_low = a - a_high, b - b_high
    tail = a_low * b_low - (((head - a_high * b_high) - a_low * b_high) - a_high * b_low)
    return head, tail
