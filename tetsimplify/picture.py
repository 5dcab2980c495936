"""Two surfaces side by side, each with a lens that shows its edges."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import MissingExtraError
from tetsimplify.io.files import replacing
from tetsimplify.mesh import Mesh
from tetsimplify.render import View, draw, point_seen_at

INCHES = (13.0, 5.6)
DOTS_PER_INCH = 150
PANEL_SIZE = (0.476, 0.885)  # of a surface, in parts of the picture
PANEL_LEFTS = (0.012, 0.512)
TITLE_HEIGHT, CAPTION_HEIGHT = 0.975, 0.912
LENS_CENTRE = (0.195, 0.2)  # in widths of the panel, from its left lower corner
LENS_RADIUS = 0.19
EDGE_WIDTH = 1.2  # in pixels
INK, GREY = "#26304a", "#55607a"

Point = NDArray[np.float64]


@dataclass(frozen=True)
class Lens:
    """What to look at more closely.

    Attributes
    ----------
    place : two floats
        Of the spot in the panel, in parts of its width and height, from its left upper
        corner.
    width : float
        Of the spot, in the units of the mesh.
    """

    place: tuple[float, float]
    width: float


@dataclass(frozen=True)
class Side:
    """A surface with the words above it."""

    mesh: Mesh
    title: str
    caption: str


def require() -> ModuleType:
    """Import matplotlib, or say how to install it."""
    try:
        import matplotlib
    except ImportError as error:
        raise MissingExtraError("drawing a picture", "matplotlib", "demo") from error
    return matplotlib


def save_side_by_side(
    path: str | os.PathLike[str], sides: tuple[Side, Side], view: View, lens: Lens
) -> None:
    """Draw two surfaces side by side, each with a lens that shows its edges.

    Parameters
    ----------
    path : path-like
        A .png file; it is replaced once the new one is complete.
    sides : two Side
        The surfaces, left and right.
    view : View
        Where both are seen from.
    lens : Lens
        The spot to enlarge; the point of the left surface seen there is the middle of both
        lenses.

    Raises
    ------
    FileError
        When the file cannot be written.
    MissingExtraError
        When matplotlib is not installed.
    """
    require()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(INCHES, dpi=DOTS_PER_INCH, facecolor="white")
    size = tuple(
        round(inches * DOTS_PER_INCH * part)
        for inches, part in zip(INCHES, PANEL_SIZE, strict=True)
    )
    target = point_seen_at(sides[0].mesh, view, size, lens.place)
    close_view = view.moved_to(target, lens.width)
    for side, left in zip(sides, PANEL_LEFTS, strict=True):
        axes = figure.add_axes((left, 0.0, *PANEL_SIZE), xlim=(0, size[0]), ylim=(0, size[1]))
        axes.set_axis_off()
        axes.imshow(_on_white(draw(side.mesh, view, size)), extent=(0, size[0], 0, size[1]))
        _add_lens(axes, side.mesh, close_view, lens, size, view.width)
        middle: dict[str, Any] = {"x": left + PANEL_SIZE[0] / 2, "ha": "center", "va": "top"}
        figure.text(y=TITLE_HEIGHT, s=side.title, size=17, weight="bold", color=INK, **middle)
        figure.text(y=CAPTION_HEIGHT, s=side.caption, size=12.5, color=GREY, **middle)
    with replacing(path) as temporary:
        FigureCanvasAgg(figure).print_png(temporary)


def _on_white(image: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.clip(image[..., :3] + 1 - image[..., 3:], 0, 1)


def _add_lens(
    axes: Any, mesh: Mesh, close_view: View, lens: Lens, size: tuple[int, ...], width: float
) -> None:
    from matplotlib.patches import Circle

    (x, y), radius = (part * size[0] for part in LENS_CENTRE), LENS_RADIUS * size[0]
    spot = (lens.place[0] * size[0], (1 - lens.place[1]) * size[1])
    spot_radius = lens.width / width * size[0] / 2
    for ends in _tangents(np.array(spot), spot_radius, np.array([x, y]), radius):
        axes.plot(*ends.T, color=INK, linewidth=1.0, alpha=0.8)
    axes.add_patch(Circle(spot, spot_radius, fill=False, edgecolor=INK, linewidth=1.3))

    n_pixels = 2 * round(radius)
    close = _on_white(draw(mesh, close_view, (n_pixels, n_pixels), edge_width=EDGE_WIDTH))
    axes.add_patch(Circle((x, y), radius, facecolor="white", zorder=3))
    image = axes.imshow(close, extent=(x - radius, x + radius, y - radius, y + radius), zorder=4)
    image.set_clip_path(Circle((x, y), radius, transform=axes.transData))
    axes.add_patch(Circle((x, y), radius, fill=False, edgecolor=INK, linewidth=2.2, zorder=5))


def _tangents(a: Point, a_radius: float, b: Point, b_radius: float) -> Iterator[Point]:
    """The two outer common tangents of two circles, each as its two ends."""
    distance = np.linalg.norm(b - a)
    along = (b - a) / distance
    across = np.array([-along[1], along[0]])
    cosine = (a_radius - b_radius) / distance
    sine = np.sqrt(1 - cosine**2)
    for side in (1, -1):
        normal = cosine * along + side * sine * across
        yield np.array([a + a_radius * normal, b + b_radius * normal])
