r"""Vertices moved so that the surface is nearer to samples of another one.

One linearisation of the energy of Hoppe, DeRose, Duchamp, McDonald and Stuetzle (Mesh optimization,
SIGGRAPH 1993, https://doi.org/10.1145/166117.166119) with the faces as they are. A sample, see
samples.py, is above the point with barycentric coordinates l of its nearest face, with the normal
n, at the height r. When the corners j of that face move by d_j, the height becomes r - sum of
l_j n.d_j. So what is minimised is

    sum over faces of w * sum over samples of (r - sum over j of l_j n.d_j)^2  +  mu w |d - g|^2

and all that is needed of the samples of a face are ten sums: of l l', of l r and of r^2. The weight
w is one over the square root of the root mean squared height of the face: between least squares
and least distances, so that faces that fit already hold what they have. g pulls a vertex towards
the middle of its neighbours, in the surface, which keeps the triangles well shaped.

The solution is the best for the samples, not for the surface between them: where these are few and
high, above all at tips, a vertex would go out farther than the surface is. So a step is cut short
at right angles to the surface, where it is longer than most of the heights around. That makes the
largest distance less, and the mean too.

All lengths are those of a frame in which the surface has a size of about one.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.corners import behind, face_of, others
from tetsimplify.kernels.geometry import edge_vector
from tetsimplify.kernels.jit import kernel_in_place, part

TINY = 1e-300  # in place of zero as a divisor
MOST_FLAT = 1e6  # times as stiff a spring may become
EASED = 0.5  # of what the highest sample is higher than others on the other side
LEAST_EASED = 0.1  # of its height: less is not worth it
LEAST_CERTAINTY = 0.3  # of vertices that are moved for a single sample
LEAST_LEVER = 0.1  # how much a sample moves with its face, at least

# Columns of the sums of a face: of l l for each corner, of l l' for each and the one ahead, of l r;
# how many samples, of r^2, and the weight of all. The first nine are weighted. The normal is there
# too, so that one line of a cache has all that is solved with, and the largest r^2.
SQUARE, PRODUCT, RIGHT, COUNT, R2, WEIGHT, NORMAL, MOST2 = 0, 3, 6, 9, 10, 11, 12, 15
N_COLUMNS = 16  # a line of a cache


class Solver(NamedTuple):
    """What says how far vertices go."""

    stiffness: float  # mu
    pull: float  # part of the way to the middle of the neighbours at which the spring is at rest
    exact2: float  # squared height of what is as good as exact
    flat2: float  # of squared edges: squared height of faces that hold what they have
    reach2: float  # squared, in rms heights: how far a vertex may go
    lift2: float  # the same at right angles to the surface
    doubt: float  # so many more samples without height are thought of there


@kernel_in_place
def enter_frame(vertices, origin, scale, first, last, places):
    """Put the vertices from `first` to `last` into the frame."""
    for v in range(first, last):
        for axis in range(3):
            places[v, axis] = (vertices[v, axis] - origin[axis]) * scale


@kernel_in_place
def leave_frame(vertices, origin, scale, first, last, places, moved):
    """Move the vertices from `first` to `last` as their places have; others keep every bit.

    Parameters
    ----------
    vertices : float64 (n, 3)
    origin : float64 (3,)
    scale : float
    first, last : int
    places : float64 (n, 3)
    moved : float64 (n, 3), out
    """
    for v in range(first, last):
        for axis in range(3):
            step = places[v, axis] - (vertices[v, axis] - origin[axis]) * scale
            moved[v, axis] = vertices[v, axis]
            if step != 0.0:
                moved[v, axis] += step / scale


@kernel_in_place
def hold_features(links, normals, cosine, first, last, held):
    """Hold those of the vertices from `first` to `last` where faces side by side turn by more.

    Parameters
    ----------
    links : tuple
        `first_corner`, int32 (n,), and `next_corner`, int32 (3 m,), the corner table, in order.
    normals : float64 (m, 4)
    cosine : float
        Of the angle.
    first, last : int
    held : uint8 (n,)
    """
    first_corner, next_corner = links
    for v in range(first, last):
        corner = first_corner[v]
        while corner >= 0:
            here, there = normals[face_of(corner)], normals[face_of(next_corner[corner])]
            if here[0] * there[0] + here[1] * there[1] + here[2] * there[2] < cosine:
                held[v] = 1
            corner = next_corner[corner]
            if corner == first_corner[v]:
                break


@kernel_in_place
def sum_samples(samples, ends, normals, group, first, last, exact2, sums):
    """Add up the samples of a group of faces, from `first` to `last`, and weight the sums.

    Returns the sum of r^2, how many samples there are, and the largest r^2.

    Parameters
    ----------
    samples : Samples
    ends : int64 (n_parts, n_groups + 1)
        Where the samples of each group begin in each part.
    normals : float64 (m, 4)
    group : int
    first, last : int
    exact2 : float
        Squared height of what is as good as exact.
    sums : float32 (m, N_COLUMNS), out
    """
    r2 = count = most2 = 0.0
    sums[first:last] = 0.0
    for k in range(len(ends)):
        for i in range(ends[k, group], ends[k, group + 1]):
            _add_sample(samples.foot[i], sums[samples.face[i]])
    for f in range(first, last):
        of_face = sums[f]
        for axis in range(3):
            of_face[NORMAL + axis] = normals[f, axis]
        if of_face[COUNT] > 0.0:
            mean2 = np.float64(of_face[R2]) / of_face[COUNT] + exact2
            weight = np.float32(1.0 / np.sqrt(np.sqrt(mean2)))
            for column in range(COUNT):
                of_face[column] *= weight
            of_face[WEIGHT] = weight * of_face[COUNT]
            r2 += of_face[R2]
            count += of_face[COUNT]
            most2 = max(most2, np.float64(of_face[MOST2]))
    return r2, count, most2


@part
def _add_sample(foot, of_face):
    """Add a sample to the sums of its face."""
    a, b, r = foot[0], foot[1], foot[2]
    c = np.float32(1.0) - a - b
    of_face[SQUARE] += a * a
    of_face[SQUARE + 1] += b * b
    of_face[SQUARE + 2] += c * c
    of_face[PRODUCT] += a * b
    of_face[PRODUCT + 1] += b * c
    of_face[PRODUCT + 2] += c * a
    of_face[RIGHT] += a * r
    of_face[RIGHT + 1] += b * r
    of_face[RIGHT + 2] += c * r
    of_face[COUNT] += np.float32(1.0)
    of_face[R2] += r * r
    of_face[MOST2] = max(of_face[MOST2], r * r)


@kernel_in_place
def solve(places, corner_vertex, links, sums, held, solver, first, last, before, steps):
    """One step of Gauss and Seidel for the vertices from `first` to `last`.

    Others, and those after a vertex, count with the steps that they had before: so ranges may be
    worked on side by side.

    Parameters
    ----------
    places : float64 (n, 3)
    corner_vertex : int32 (3 m,)
    links : tuple
        As of `hold_features`.
    sums : float32 (m, N_COLUMNS)
    held : uint8 (n,)
        Which vertices stay.
    solver : Solver
    first, last : int
    before : float64 (n, 3)
        The steps before.
    steps : float64 (n, 3), out
    """
    first_corner, next_corner = links
    for v in range(first, last):
        steps[v, 0] = steps[v, 1] = steps[v, 2] = 0.0
        if held[v] or first_corner[v] < 0:
            continue
        xx = xy = xz = yy = yz = zz = gx = gy = gz = 0.0
        weight = r2 = count = around = 0.0
        mx = my = mz = ox = oy = oz = far2 = 0.0
        exactest = np.inf
        corner = first_corner[v]
        while True:
            f = face_of(corner)
            p, q = others(corner_vertex, corner)
            of_face = sums[f]
            nx = np.float64(of_face[NORMAL])
            ny = np.float64(of_face[NORMAL + 1])
            nz = np.float64(of_face[NORMAL + 2])
            k = corner - 3 * f
            own, right = np.float64(of_face[SQUARE + k]), np.float64(of_face[RIGHT + k])
            with_p, with_q = of_face[PRODUCT + k], of_face[PRODUCT + behind(corner) - 3 * f]
            to_p = steps if first <= p < v else before
            to_q = steps if first <= q < v else before
            right -= with_p * (nx * to_p[p, 0] + ny * to_p[p, 1] + nz * to_p[p, 2])
            right -= with_q * (nx * to_q[q, 0] + ny * to_q[q, 1] + nz * to_q[q, 2])
            sx, sy, sz = own * nx, own * ny, own * nz
            xx += sx * nx
            xy += sx * ny
            xz += sx * nz
            yy += sy * ny
            yz += sy * nz
            zz += sz * nz
            gx += right * nx
            gy += right * ny
            gz += right * nz
            weight += of_face[WEIGHT]
            r2 += of_face[R2]
            count += of_face[COUNT]
            if of_face[COUNT] > 0.0:
                exactest = min(exactest, np.float64(of_face[R2]) / of_face[COUNT])
            ux, uy, uz = edge_vector(places, v, p)
            wx, wy, wz = edge_vector(places, v, q)
            mx += ux + wx
            my += uy + wy
            mz += uz + wz
            far2 += ux * ux + uy * uy + uz * uz + wx * wx + wy * wy + wz * wz
            ox += nx
            oy += ny
            oz += nz
            around += 2.0
            corner = next_corner[corner]
            if corner == first_corner[v]:
                break
        if not r2 > solver.exact2 * count:  # nothing to be nearer to, or as near as can be
            continue
        # Beside a face that fits, others come nearer at its expense only: there the spring is
        # stiffer, and at rest where the vertex is.
        flat = min(solver.flat2 * far2 / around / max(exactest, TINY), MOST_FLAT)
        pull = solver.stiffness * weight * solver.pull / (1.0 + flat) / around
        spring = solver.stiffness * weight * (1.0 + flat)
        xx += spring
        yy += spring
        zz += spring
        oo = ox * ox + oy * oy + oz * oz
        out = (mx * ox + my * oy + mz * oz) / oo if oo > 0.0 else 0.0
        gx += pull * (mx - out * ox)
        gy += pull * (my - out * oy)
        gz += pull * (mz - out * oz)
        ixx, ixy, ixz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
        iyy, iyz, izz = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
        s = 1.0 / (xx * ixx + xy * ixy + xz * ixz)
        x = s * (ixx * gx + ixy * gy + ixz * gz)
        y = s * (ixy * gx + iyy * gy + iyz * gz)
        z = s * (ixz * gx + iyz * gy + izz * gz)
        # Where the faces turn, which of them is nearest is less certain.
        certainty = max(8.0 * oo / (around * around) - 1.0, 0.0)
        length2, most2 = x * x + y * y + z * z, certainty * solver.reach2 * r2 / count
        s = np.sqrt(most2 / length2) if length2 > most2 else 1.0
        x, y, z = s * x, s * y, s * z
        # Where a few samples want it far out it would stick out of the surface there.
        out, most2 = x * ox + y * oy + z * oz, solver.lift2 * r2 / (count + solver.doubt)
        if out * out > most2 * oo:
            s = (np.sqrt(most2 * oo) / abs(out) - 1.0) * out / oo
            x, y, z = x + s * ox, y + s * oy, z + s * oz
        steps[v, 0], steps[v, 1], steps[v, 2] = x, y, z


@kernel_in_place
def ease_highest(order, corner_vertex, links, sums, held, limit, exact2, busy, steps):
    """Lower the highest samples by more than the solution does; return for how many faces.

    The steps of the corners of such a face change so that the sample comes nearer by half of what
    it is higher than others around that come to be higher by that. Where it is on the face is not
    known any more: the mean over the heights of all samples tells it. Corners where the surface
    turns are left alone, and those of faces that fit exactly.

    Parameters
    ----------
    order : int64 (k,)
        The faces, the highest first. Around each that was eased no other one is.
    corner_vertex : int32 (3 m,)
    links : tuple
        As of `hold_features`.
    sums : float32 (m, N_COLUMNS)
    held : uint8 (n,)
        Which vertices stay.
    limit : float
        Height that is not too high.
    exact2 : float
        Squared height of what is as good as exact.
    busy : uint8 (n,)
        Zeros; the vertices around faces that were eased are marked.
    steps : float64 (n, 3)
    """
    n_eased = 0
    for f in order:
        of_face = sums[f]
        nx, ny, nz = of_face[NORMAL], of_face[NORMAL + 1], of_face[NORMAL + 2]
        sign, total, lever = _side(of_face), 0.0, 0.0
        for k in range(3):
            total += max(sign * of_face[RIGHT + k], 0.0)
        if not total > 0.0:
            continue
        r = np.sqrt(np.float64(of_face[MOST2]))
        against, is_free = 0.0, True
        for k in range(3):
            corner = 3 * np.int64(f) + k
            v = corner_vertex[corner]
            share = max(sign * of_face[RIGHT + k], 0.0) / total
            r -= sign * share * (nx * steps[v, 0] + ny * steps[v, 1] + nz * steps[v, 2])
            lever += 0.0 if held[v] else share * share
            is_free &= not busy[v]
            if is_free:
                most, is_certain = _most_against(links, sums, v, sign, exact2)
                against = max(against, most)
                is_free &= is_certain
        ease = EASED * (r - against)
        if not (is_free and r > limit and lever > LEAST_LEVER and ease > LEAST_EASED * r):
            continue
        for k in range(3):
            v = corner_vertex[3 * np.int64(f) + k]
            if not held[v]:
                by = sign * ease / lever * max(sign * of_face[RIGHT + k], 0.0) / total
                steps[v, 0] += by * nx
                steps[v, 1] += by * ny
                steps[v, 2] += by * nz
            _mark_around(corner_vertex, links, v, busy)
        n_eased += 1
    return n_eased


@part
def _side(of_face):
    """1 where the samples of a face are above it on the whole, else -1."""
    return np.copysign(1.0, of_face[RIGHT] + of_face[RIGHT + 1] + of_face[RIGHT + 2])


@part
def _most_against(links, sums, v, sign, exact2):
    """The largest height on the other side around a vertex, and whether it may be moved."""
    first_corner, next_corner = links
    most = ox = oy = oz = around = 0.0
    is_inexact = True
    corner = first_corner[v]
    while True:
        of_face = sums[face_of(corner)]
        if _side(of_face) != sign:
            most = max(most, np.sqrt(np.float64(of_face[MOST2])))
        is_inexact &= of_face[COUNT] == 0.0 or of_face[R2] > exact2 * of_face[COUNT]
        ox += of_face[NORMAL]
        oy += of_face[NORMAL + 1]
        oz += of_face[NORMAL + 2]
        around += 1.0
        corner = next_corner[corner]
        if corner == first_corner[v]:
            break
    certainty = 2.0 * (ox * ox + oy * oy + oz * oz) / (around * around) - 1.0
    return most, is_inexact and certainty > LEAST_CERTAINTY


@part
def _mark_around(corner_vertex, links, v, marked):
    """Mark the vertices of all faces around a vertex."""
    first_corner, next_corner = links
    marked[v] = 1
    corner = first_corner[v]
    while True:
        p, q = others(corner_vertex, corner)
        marked[p] = marked[q] = 1
        corner = next_corner[corner]
        if corner == first_corner[v]:
            break


@kernel_in_place
def find_harmed(places, faces, normals, steps, cosine, stale, first, last, harmed):
    """Mark the vertices of faces that steps turn too far or make too small.

    Parameters
    ----------
    places : float64 (n, 3)
    faces : int32 (m, 3)
    normals : float64 (m, 4)
        As they were.
    steps : float64 (n, 3)
    cosine : float
        Of the largest angle by which a face may turn.
    stale : uint8 (n,)
        Only faces with a vertex that is marked here are looked at.
    first, last : int
        Range of faces.
    harmed : uint8 (n,)
        Marked with 1.
    """
    for f in range(first, last):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if not (stale[a] | stale[b] | stale[c]):
            continue
        ax, ay, az = (
            places[a, 0] + steps[a, 0],
            places[a, 1] + steps[a, 1],
            places[a, 2] + steps[a, 2],
        )
        ux, uy, uz = (
            places[b, 0] + steps[b, 0] - ax,
            places[b, 1] + steps[b, 1] - ay,
            places[b, 2] + steps[b, 2] - az,
        )
        wx, wy, wz = (
            places[c, 0] + steps[c, 0] - ax,
            places[c, 1] + steps[c, 1] - ay,
            places[c, 2] + steps[c, 2] - az,
        )
        x, y, z = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        length = np.sqrt(x * x + y * y + z * z)
        along = x * normals[f, 0] + y * normals[f, 1] + z * normals[f, 2]
        if not (along > cosine * length and length >= normals[f, 3]):  # twice the area, and half
            harmed[a] = harmed[b] = harmed[c] = 1


@kernel_in_place
def take_back(first, last, steps, harmed, stale):
    """Take back the steps of marked vertices from `first` to `last`; return how many.

    Those are then marked as `stale`, and nothing is as `harmed`.
    """
    n = 0
    for v in range(first, last):
        moves = steps[v, 0] != 0.0 or steps[v, 1] != 0.0 or steps[v, 2] != 0.0
        stale[v] = harmed[v] != 0 and moves
        harmed[v] = 0
        if stale[v]:
            steps[v, 0] = steps[v, 1] = steps[v, 2] = 0.0
            n += 1
    return n


@kernel_in_place
def move(first, last, steps, places):
    """Move the vertices from `first` to `last`."""
    for v in range(first, last):
        for axis in range(3):
            places[v, axis] += steps[v, axis]
