"""Solids as inequalities: whether a point lies in a sphere, a cone, ..., or in a union, intersection or difference of solids."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from surfaces import Array, Quadric

# Whether the point (x, y, z) lies in a solid; coordinates are numbers, or arrays of numpy or Dr.Jit.
Test = Callable[[Any, Any, Any], Any]


@dataclass(frozen=True, eq=False)
class Primitive:
    """A solid given by a test in its own frame."""

    test: Test
    to_local: Array

    def contains(self, p: Any) -> Any:
        m = self.to_local.tolist()
        return self.test(*(m[k][0] * p[0] + m[k][1] * p[1] + m[k][2] * p[2] + m[k][3] for k in range(3)))


@dataclass(frozen=True, eq=False)
class Operation:
    """A union, an intersection, or a difference, which is the first operand without all others."""

    name: str
    operands: Sequence["Primitive | Operation"]


def contains(solid: Primitive | Operation, p: Any, primitive: Primitive, inside: bool) -> Any:
    """Whether a point lies in a solid, assuming that `inside` is its membership in `primitive`."""
    if isinstance(solid, Primitive):
        return inside if solid is primitive else solid.contains(p)
    first, *others = (contains(operand, p, primitive, inside) for operand in solid.operands)
    for other in others:
        if solid.name == "union":
            first = first | other
        elif solid.name == "intersection":
            first = first & other
        else:
            first = first & (other ^ True)
    return first


def bounds(solid: Primitive | Operation, p: Any, primitive: Primitive) -> Any:
    """Whether a point on the surface of `primitive` is on the surface of the solid.

    This is the case if its membership in the solid depends on its membership in `primitive`.
    """
    return contains(solid, p, primitive, True) ^ contains(solid, p, primitive, False)


def kept_texture(mi: ModuleType, solid: Primitive | Operation, primitive: Primitive, also: Test | None) -> Any:
    """A texture that is 1 where the surface of `primitive` bounds the solid, else 0.

    If `also` is given, it must hold too, in the frame of the primitive.
    """
    import drjit as dr

    class Kept(mi.Texture):
        def __init__(self) -> None:
            mi.Texture.__init__(self, mi.Properties("kept"))

        def eval_1(self, si: Any, active: Any = True) -> Any:
            kept = bounds(solid, si.p, primitive)
            if also is not None:
                kept &= Primitive(also, primitive.to_local).contains(si.p)
            return dr.select(kept, mi.Float(1.0), mi.Float(0.0))

        def is_spatially_varying(self) -> bool:
            return True

        def to_string(self) -> str:
            return "Kept[]"

    return Kept()


# --- tests ---------------------------------------------------------------------------------------------------------------


def in_sphere(x: Any, y: Any, z: Any) -> Any:
    """Inside the unit sphere."""
    return x * x + y * y + z * z < 1.0


def in_cube(x: Any, y: Any, z: Any) -> Any:
    """Inside the cube from -1 to 1."""
    return (abs(x) < 1.0) & (abs(y) < 1.0) & (abs(z) < 1.0)


def in_cylinder(x: Any, y: Any, z: Any) -> Any:
    """Inside the cylinder of radius 1 around the z axis, for 0 < z < 1."""
    return (x * x + y * y < 1.0) & (z > 0.0) & (z < 1.0)


def below_plane(x: Any, y: Any, z: Any) -> Any:
    """In the half-space below z = 0."""
    return z < 0.0


def in_cone(radius: float, height: float) -> Test:
    """Inside the solid cone of surfaces.cone."""
    steepness = (radius / height) ** 2
    return lambda x, y, z: (x * x + y * y < steepness * (height - z) * (height - z)) & (z > 0.0) & (z < height)


def in_paraboloid(radius: float, height: float) -> Test:
    """Inside the solid paraboloid of surfaces.paraboloid."""
    return lambda x, y, z: (x * x + y * y < radius * radius / height * z) & (z < height)


def in_hyperboloid(radius: float, axis: float, z_min: float, z_max: float, sheets: int) -> Test:
    """Inside the sheets of surfaces.hyperboloid, on the side of the z axis."""
    squared, waist = (radius / axis) ** 2, radius * radius * (1.0 if sheets == 1 else -1.0)
    return lambda x, y, z: (x * x + y * y < squared * z * z + waist) & (z > z_min) & (z < z_max)


def in_quadric(shape: Quadric) -> Test:
    """Where the value of the quadric is negative."""
    (a, d, e), (_, b, f), (_, _, c) = shape.matrix.tolist()
    g, h, i = shape.linear.tolist()
    return lambda x, y, z: (
        x * (a * x + 2.0 * d * y + 2.0 * e * z + g) + y * (b * y + 2.0 * f * z + h) + z * (c * z + i) + shape.constant < 0.0
    )


def in_box(low: Array, high: Array) -> Test:
    """Inside the box with two given corners."""
    (a, b, c), (d, e, f) = np.asarray(low).tolist(), np.asarray(high).tolist()
    return lambda x, y, z: (x > a) & (x < d) & (y > b) & (y < e) & (z > c) & (z < f)
