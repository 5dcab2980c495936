"""The filters of tetsimplify among those of PyMeshLab: called, listed and told as these."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np
from tetsimplify.plugins.pymeshlab_filters import (
    FILTERS,
    ISOSURFACE,
    SIMPLIFY,
    Parameter,
    apply,
    checked,
)
from tetsimplify.plugins.pymeshlab_in_place import apply_filter, filter_parameter_values

from tetsimplify.adapters import needs
from tetsimplify.options import DEFAULT_REMOVAL_LIMIT

with needs("pymeshlab"):
    import pymeshlab
    from pymeshlab import PercentageValue

_native: dict[str, Callable[..., Any]] = {
    "apply_filter": apply_filter,
    "filter_parameter_values": filter_parameter_values,
    "filter_list": pymeshlab.filter_list,
    "print_filter_list": pymeshlab.print_filter_list,
    "print_filter_parameter_list": pymeshlab.print_filter_parameter_list,
    "search": pymeshlab.search,
}


def add_filters() -> None:
    """Add the filters to every ``MeshSet``, and to the lists of filters and parameters."""
    pymeshlab.MeshSet.apply_filter = _apply_filter
    pymeshlab.MeshSet.filter_parameter_values = _filter_parameter_values
    for name in FILTERS:
        setattr(pymeshlab.MeshSet, name, pymeshlab.bind_function(name))
    for function in (_filter_list, _print_filter_list, _print_filter_parameter_list, _search):
        setattr(pymeshlab, function.__name__, function)


def remove_filters() -> None:
    """Leave PyMeshLab as it was before :func:`add_filters`."""
    pymeshlab.MeshSet.apply_filter = _native["apply_filter"]
    pymeshlab.MeshSet.filter_parameter_values = _native["filter_parameter_values"]
    for name in FILTERS:
        if hasattr(pymeshlab.MeshSet, name):
            delattr(pymeshlab.MeshSet, name)
    for name in ("filter_list", "print_filter_list", "print_filter_parameter_list", "search"):
        setattr(pymeshlab, name, _native[name])


@wraps(_native["apply_filter"])
def _apply_filter(self: pymeshlab.MeshSet, *args: Any, **parameters: Any) -> dict[str, Any]:
    name = args[0] if args else parameters.get("filter_name")
    if name in FILTERS and len(args) < 2:
        parameters.pop("filter_name", None)
        return apply(self, name, parameters)
    result: dict[str, Any] = _native["apply_filter"](self, *args, **parameters)
    return result


@wraps(_native["filter_parameter_values"])
def _filter_parameter_values(self: pymeshlab.MeshSet, name: str, **given: Any) -> dict[str, Any]:
    if name not in FILTERS:
        native: dict[str, Any] = _native["filter_parameter_values"](self, name, **given)
        return native
    values = checked(self, name, {"volume": (), **given} if name == ISOSURFACE else given)
    if name == SIMPLIFY and values["removallimit"] is None and values["maxedgelength"]:
        values["removallimit"] = DEFAULT_REMOVAL_LIMIT * values["maxedgelength"]
    return values


@wraps(_native["filter_list"])
def _filter_list() -> list[str]:
    return sorted([*_native["filter_list"](), *FILTERS])


@wraps(_native["print_filter_list"])
def _print_filter_list() -> None:
    _native["print_filter_list"]()
    print(*FILTERS, sep="\n")


@wraps(_native["print_filter_parameter_list"])
def _print_filter_parameter_list(filter_name: str) -> None:
    if filter_name not in FILTERS:
        _native["print_filter_parameter_list"](filter_name)
        return
    print(f"{filter_name} filter - list of parameter names:")
    for name, parameter in FILTERS[filter_name].live.items():
        print(f"\t{name} : {_described(parameter)}")


def _described(parameter: Parameter) -> str:
    """The type and the default of a parameter, as PyMeshLab prints them."""
    default = parameter.default
    text = repr(default) if isinstance(default, str) else str(default)
    if isinstance(default, PercentageValue):
        text = f"{default.value():g}%"
    elif isinstance(default, float):
        text = f"{default:g}"
    elif default is None:
        text = parameter.note
    choices = f" [{', '.join(map(repr, parameter.choices))}]" if parameter.choices else ""
    kind = "numpy.ndarray" if parameter.kind is np.ndarray else parameter.kind.__name__
    return f"{kind} = {text}{choices}"


@wraps(_native["search"])
def _search(keyword: str) -> None:
    _native["search"](keyword)
    print(*(name for name in FILTERS if keyword in name), sep="\n")
