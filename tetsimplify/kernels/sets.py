"""Disjoint sets in an array of parents; a representative is its own parent."""

from tetsimplify.kernels.jit import part


@part
def find(parent, item):
    """Representative of the set of `item`, halving the path to it."""
    while parent[item] != item:
        parent[item] = parent[parent[item]]
        item = parent[item]
    return item


@part
def unite(parent, a, b):
    """Unite the sets of `a` and `b`; the smaller representative stays."""
    a, b = find(parent, a), find(parent, b)
    if a < b:
        parent[b] = a
    elif b < a:
        parent[a] = b
