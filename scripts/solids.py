"""Solids as inequalities: which points lie in a sphere, a cone, ..., and in a union, intersection or difference of such."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from surfaces import Array, Quadric

# Coordinates x, y, z (numbers, or arrays of numpy or Dr.Jit) to a mask.
Test = Callable[[Any, Any, Any], Any]


@dataclass(frozen=True, eq=False)
class Leaf:
    """A solid by a test in a frame of its own."""

    test: Test
    to_local: Array

    def contains(self, p: Any) -> Any:
        m = self.to_local.tolist()
        return self.test(*(m[k][0] * p[0] + m[k][1] * p[1] + m[k][2] * p[2] + m[k][3] for k in range(3)))


@dataclass(frozen=True, eq=False)
class Operation:
    """A union, an intersection, or a difference: the first operand without all others."""

    name: str
    operands: Sequence["Leaf | Operation"]


def contains(solid: Leaf | Operation, p: Any, leaf: Leaf, inside: bool) -> Any:
    """Whether a point lies in a solid, if `inside` says whether it lies in `leaf`."""
    if isinstance(solid, Leaf):
        return inside if solid is leaf else solid.contains(p)
    first, *others = (contains(operand, p, leaf, inside) for operand in solid.operands)
    for other in others:
        if solid.name == "union":
            first = first | other
        elif solid.name == "intersection":
            first = first & other
        else:
            first = first & (other ^ True)
    return first


def bounds(solid: Leaf | Operation, p: Any, leaf: Leaf) -> Any:
    """Whether a point on the surface of `leaf` is on the surface of the solid: whether it matters on which side it lies."""
    return contains(solid, p, leaf, True) ^ contains(solid, p, leaf, False)


def kept_texture(mi: ModuleType, solid: Leaf | Operation, leaf: Leaf, also: Test | None) -> Any:
    """A texture that is 1 where the surface of `leaf` bounds the solid (and `also` holds in the frame of the leaf), else 0."""
    import drjit as dr

    class Kept(mi.Texture):
        def __init__(self) -> None:
            mi.Texture.__init__(self, mi.Properties("kept"))

        def eval_1(self, si: Any, active: Any = True) -> Any:
            kept = bounds(solid, si.p, leaf)
            if also is not None:
                kept &= Leaf(also, leaf.to_local).contains(si.p)
            return dr.select(kept, mi.Float(1.0), mi.Float(0.0))

        def is_spatially_varying(self) -> bool:
            return True

        def to_string(self) -> str:
            return "Kept[]"

    return Kept()


# --- tests ---------------------------------------------------------------------------------------------------------------


def in_sphere(x: Any, y: Any, z: Any) -> Any:
    """The unit ball."""
    return x * x + y * y + z * z < 1.0


def in_cube(x: Any, y: Any, z: Any) -> Any:
    """The cube from -1 to 1."""
    return (abs(x) < 1.0) & (abs(y) < 1.0) & (abs(z) < 1.0)


def in_cylinder(x: Any, y: Any, z: Any) -> Any:
    """Radius 1 around the z axis, from 0 to 1."""
    return (x * x + y * y < 1.0) & (z > 0.0) & (z < 1.0)


def below_plane(x: Any, y: Any, z: Any) -> Any:
    """The half-space below z = 0."""
    return z < 0.0


def in_cone(radius: float, height: float) -> Test:
    """See surfaces.cone."""
    steepness = (radius / height) ** 2
    return lambda x, y, z: (x * x + y * y < steepness * (height - z) * (height - z)) & (z > 0.0) & (z < height)


def in_paraboloid(radius: float, height: float) -> Test:
    """See surfaces.paraboloid."""
    return lambda x, y, z: (x * x + y * y < radius * radius / height * z) & (z < height)


def in_hyperboloid(radius: float, axis: float, z_min: float, z_max: float, sheets: int) -> Test:
    """See surfaces.hyperboloid: around the z axis, inside the sheets."""
    squared, waist = (radius / axis) ** 2, radius * radius * (1.0 if sheets == 1 else -1.0)
    return lambda x, y, z: (x * x + y * y < squared * z * z + waist) & (z > z_min) & (z < z_max)


def in_quadric(shape: Quadric) -> Test:
    """Where the quadric is negative."""
    (a, d, e), (_, b, f), (_, _, c) = shape.matrix.tolist()
    g, h, i = shape.linear.tolist()
    return lambda x, y, z: (
        x * (a * x + 2.0 * d * y + 2.0 * e * z + g) + y * (b * y + 2.0 * f * z + h) + z * (c * z + i) + shape.constant < 0.0
    )


def in_box(low: Array, high: Array) -> Test:
    """Between two corners."""
    (a, b, c), (d, e, f) = np.asarray(low).tolist(), np.asarray(high).tolist()
    return lambda x, y, z: (x > a) & (x < d) & (y > b) & (y < e) & (z > c) & (z < f)
