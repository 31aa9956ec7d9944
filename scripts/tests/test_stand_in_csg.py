"""The stand-ins for csg: rays cross a solid where its inequalities change, and masked surfaces do not change an image."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mitsuba_reference as ref
import surfaces
from stand_in_scenes import (
    FLIP,
    HEAD,
    LIT,
    MIRRORED,
    PANE,
    POINT,
    SADDLE,
    A,
    B,
    C,
    Load,
    Mask,
    between,
    boxed,
    crossings,
    csg_xml,
    matrix_of,
    quadric_xml,
    rays,
    sphere_xml,
)


def ball(p: np.ndarray, x: float, y: float, z: float, radius: float) -> Mask:
    return ((p - np.array([x, y, z])) ** 2).sum(axis=-1) < radius * radius


def around(p: np.ndarray) -> np.ndarray:
    """Squared distance from the z axis."""
    return p[..., 0] ** 2 + p[..., 1] ** 2


SOLIDS: dict[str, tuple[str, Callable[[np.ndarray], Mask]]] = {
    "union": (csg_xml("union", sphere_xml(*A), sphere_xml(*B)), lambda p: ball(p, *A) | ball(p, *B)),
    "intersection": (csg_xml("intersection", sphere_xml(*A), sphere_xml(*B)), lambda p: ball(p, *A) & ball(p, *B)),
    "difference": (
        csg_xml("difference", sphere_xml(*A), sphere_xml(*B), sphere_xml(*C)),
        lambda p: ball(p, *A) & ~ball(p, *B) & ~ball(p, *C),
    ),
    "difference of a difference": (
        csg_xml("difference", sphere_xml(*A), csg_xml("difference", sphere_xml(*B), sphere_xml(*C))),
        lambda p: ball(p, *A) & ~(ball(p, *B) & ~ball(p, *C)),
    ),
    "cut cube": (
        csg_xml("difference", '<shape type="cube"/>', '<shape type="plane"><transform name="to_world">'
                '<rotate y="1" angle="40"/><translate x="-0.3"/></transform></shape>'),
        lambda p: (np.abs(p) < 1.0).all(axis=-1)
        & ~((p[..., 0] + 0.3) * math.sin(math.radians(40)) + p[..., 2] * math.cos(math.radians(40)) < 0.0),
    ),
    "drilled ellipsoid": (
        csg_xml("difference", '<shape type="ellipsoid"><vector name="radii" value="1.2, 0.8, 0.6"/></shape>',
                '<shape type="cylinder"><point name="p0" value="-0.5, 0, -1"/><point name="p1" value="0.5, 0, 0.4"/>'
                '<float name="radius" value="0.3"/></shape>'),
        lambda p: (((p / (1.2, 0.8, 0.6)) ** 2).sum(axis=-1) < 1.0)
        & ~in_tube(p, np.array([-0.5, 0.0, -1.0]), np.array([0.5, 0.0, 0.4]), 0.3),
    ),
    "tube": (
        csg_xml("union", '<shape type="cylinder"><point name="p0" value="0, -1, 0"/><point name="p1" value="0.3, 1, 0.5"/>'
                '<float name="radius" value="0.5"/></shape>'),
        lambda p: in_tube(p, np.array([0.0, -1.0, 0.0]), np.array([0.3, 1.0, 0.5]), 0.5),
    ),
    "cone": (
        csg_xml("difference", '<shape type="cone"><float name="radius" value="0.8"/></shape>', sphere_xml(*C)),
        lambda p: (around(p) < (0.8 * (1.0 - p[..., 2])) ** 2) & between(0, 1)(p) & ~ball(p, *C),
    ),
    "paraboloid": (
        csg_xml("union", '<shape type="paraboloid"><float name="radius" value="0.8"/></shape>', sphere_xml(*C)),
        lambda p: ((around(p) < 0.64 * p[..., 2]) & (p[..., 2] < 1.0)) | ball(p, *C),
    ),
    "one sheet": (
        csg_xml("difference", '<shape type="hyperboloid"><float name="radius" value="0.5"/></shape>', sphere_xml(*C)),
        lambda p: (4.0 * around(p) < 1.0 + p[..., 2] ** 2) & between(-1, 1)(p) & ~ball(p, *C),
    ),
    "two sheets": (
        csg_xml("union", '<shape type="hyperboloid"><float name="axis" value="0.4"/><float name="radius" value="0.4"/>'
                '<integer name="sheets" value="2"/></shape>'),
        lambda p: (around(p) < p[..., 2] ** 2 - 0.16) & between(-1, 1)(p),
    ),
    "saddle": (
        csg_xml("intersection", f'<shape type="quadric">{quadric_xml(SADDLE)}</shape>', sphere_xml(*A)),
        lambda p: (surfaces.Quadric.of(SADDLE).value(p) < 0.0) & boxed(p) & ball(p, *A),
    ),
}


def in_tube(p: np.ndarray, a: np.ndarray, b: np.ndarray, radius: float) -> Mask:
    axis = b - a
    along = (p - a) @ axis / (axis @ axis)
    return (along > 0.0) & (along < 1.0) & ((((p - a) - along[..., None] * axis) ** 2).sum(axis=-1) < radius * radius)


def changes(inside: Callable[[np.ndarray], Mask], origins: np.ndarray, directions: np.ndarray, count: int) -> np.ndarray:
    """The distances (count, rays) up to 9 at which the membership changes along each ray; infinite where it does not."""
    steps = np.linspace(2.0, 9.0, 1401)
    samples = inside(origins[:, None] + steps[:, None] * directions[:, None])
    found = np.full((count, len(origins)), np.inf)
    ray, step = np.nonzero(samples[:, 1:] != samples[:, :-1])
    order = np.arange(len(ray)) - np.searchsorted(ray, ray)
    ray, step, order = (values[order < count] for values in (ray, step, order))
    low, high, before = steps[step], steps[step + 1], samples[ray, step]
    for _ in range(45):
        middle = (low + high) / 2.0
        same = inside(origins[ray] + middle[:, None] * directions[ray]) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    found[order, ray] = (low + high) / 2.0
    return found


def normals_at(inside: Callable[[np.ndarray], Mask], origins: np.ndarray, directions: np.ndarray, count: int) -> np.ndarray:
    """Unit normals (count, rays, 3) that face the ray, from the changes of membership along shifted rays."""
    across = np.cross(directions, np.roll(directions, 1, axis=1) + np.array([0.1, 0.2, 0.3]))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    shifts = [np.zeros_like(across), 1e-6 * across, 1e-6 * np.cross(directions, across)]
    points = [
        origins + shift + changes(inside, origins + shift, directions, count)[..., None] * directions for shift in shifts
    ]
    with np.errstate(invalid="ignore"):
        normals = np.cross(points[1] - points[0], points[2] - points[0])
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return -normals * np.sign(np.einsum("kni,ni->kn", normals, directions))[..., None]


@pytest.mark.parametrize("placing", ["", MIRRORED, FLIP], ids=["as is", "mirrored", "flipped"])
@pytest.mark.parametrize("name", SOLIDS)
def test_rays_cross_the_solid(load: Load, renderer: ref.Renderer, name: str, placing: str) -> None:
    """Compare the first two crossings of each ray, in and out, and their outward normals with the inequalities."""
    body, local = SOLIDS[name]
    scene = load(body[: -len("</shape>")] + placing + "</shape>")
    inverse = np.linalg.inv(matrix_of(True)) if placing == MIRRORED else np.eye(4)

    def inside(p: np.ndarray) -> Mask:
        return local(p @ inverse[:3, :3].T + inverse[:3, 3])

    origins, directions = rays(1500)
    expected, normals = changes(inside, origins, directions, 2), normals_at(inside, origins, directions, 2)
    found = crossings(renderer.mi, scene, origins, directions, 2)
    for k, crossing in enumerate(found):
        hit = np.isfinite(expected[k])
        assert hit.sum() > 75
        # Rays close to an edge or a silhouette may differ: the inequalities are evaluated in steps, hits in single precision.
        assert (hit != crossing["valid"]).mean() < 8e-3
        both = hit & crossing["valid"]
        same = both & (np.abs(expected[k] - crossing["t"]) < 2e-4)
        assert same.sum() > 0.99 * both.sum()
        outward = (1.0 if k == 0 else -1.0) * (-1.0 if placing == FLIP else 1.0)
        error = np.linalg.norm(outward * crossing["n"] - normals[k], axis=1)[same]
        assert (error < 2e-3).mean() > 0.985


def test_each_surface_has_its_own_bsdf_or_that_of_the_nearest_csg(load: Load, renderer: ref.Renderer) -> None:
    def paint(*rgb: float) -> str:
        return f'<bsdf type="diffuse"><rgb name="reflectance" value="{", ".join(map(str, rgb))}"/></bsdf>'

    red, green = (0.8, 0.1, 0.1), (0.1, 0.8, 0.1)
    inner = csg_xml("union", paint(*green), sphere_xml(-1.0, 0.0, 0.0, 0.3), sphere_xml(0.0, 0.0, 0.0, 0.3, paint(*red)))
    scene = load(csg_xml("union", inner, sphere_xml(1.0, 0.0, 0.0, 0.3)) + csg_xml("union", paint(*red), inner))
    origins = np.array([[-1.0, 0.0, 5.0], [0.0, 0.0, 5.0], [1.0, 0.0, 5.0]])
    found = crossings(renderer.mi, scene, origins, np.tile([0.0, 0.0, -1.0], (3, 1)), 1)[0]
    assert found["valid"].all()
    assert np.allclose(found["colour"], [green, red, (0.5, 0.5, 0.5)])


# An empty solid in front of the wall and the lights: all of its surfaces are masked.
EMPTY = csg_xml("intersection", sphere_xml(0.0, 0.0, 1.2, 1.0), sphere_xml(0.0, 0.0, 9.0, 1.0), PANE)


def means_of_images(renderer: ref.Renderer, scenes: list[Any], samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mean colours of the images of two scenes, and the standard error of their difference, from 8 batches of each."""
    means = []
    for k, scene in enumerate(scenes):
        batches = [np.array(renderer.mi.render(scene, spp=samples, seed=8 * k + seed))[..., :3] for seed in range(8)]
        means.append(np.array(batches).mean(axis=(1, 2)))
    a, b = (batches.mean(axis=0) for batches in means)
    return a, b, np.sqrt(sum(batches.var(axis=0, ddof=1) for batches in means) / 8)


@pytest.mark.parametrize("depth", [1, 2, 3, 4])
@pytest.mark.parametrize("hide", ["true", "false"])
def test_masked_surfaces_change_nothing(load: Load, renderer: ref.Renderer, depth: int, hide: str) -> None:
    """volpath does not count null interactions as depth, evaluates lights through them, and otherwise agrees with path."""
    end = 'value="3"/></integrator>'
    assert end in HEAD
    head = HEAD.replace(end, f'value="{depth}"/><boolean name="hide_emitters" value="{hide}"/></integrator>')
    scenes = [load(body, head) for body in (LIT + POINT, LIT + POINT + EMPTY)]
    a, b, error = means_of_images(renderer, scenes, 256)
    assert (np.abs(a - b) <= 5.0 * error + 1e-6 * a).all()
    assert (error <= 5e-3 * a).all()
    assert (a > 0.0).all() == (depth > 1 or hide == "false")


def test_direct_sees_direct_light_through_masks(load: Load, renderer: ref.Renderer) -> None:
    """The scene has no point light, because Mitsuba's direct adds its light once for each of its emitter_samples."""
    old, new = '"path"><integer name="max_depth" value="3"/>', '"direct"><integer name="emitter_samples" value="2"/>'
    assert old in HEAD
    direct = HEAD.replace(old, new)
    plain, masked = (np.array(renderer.mi.render(load(body, direct), spp=2048)) for body in (LIT, LIT + EMPTY))
    deeper = np.array(renderer.mi.render(load(LIT), spp=2048))
    assert np.median(masked / plain) == pytest.approx(1.0, abs=4e-3)
    assert np.percentile(masked / plain, 95) < 1.02 < np.percentile(deeper / plain, 95)


GLASS = '<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>'


def test_a_masked_surface_inside_glass_changes_nothing(load: Load, renderer: ref.Renderer) -> None:
    """A glass ball, and the union of the same ball with a smaller one inside it."""
    head = HEAD.replace('value="3"/></integrator>', 'value="8"/></integrator>')
    plain = sphere_xml(0.0, 0.0, 1.2, 0.9, GLASS)
    joined = csg_xml("union", GLASS, sphere_xml(0.0, 0.0, 1.2, 0.9), sphere_xml(0.1, 0.0, 1.2, 0.5))
    scenes = [load(body, head) for body in (LIT + plain, LIT + joined)]
    a, b, error = means_of_images(renderer, scenes, 512)
    assert (np.abs(a - b) <= 5.0 * error).all()
    assert (error <= 1e-2 * a).all()


TUBE = '<shape type="cylinder"><point name="p0" value="-2, 0, 0"/><point name="p1" value="2, 0, 0.5"/></shape>'
TUBE = TUBE.replace("/></shape>", '/><float name="radius" value="0.3"/></shape>')
LENS = [sphere_xml(x, 0.0, 0.0, 1.0) for x in (-0.5, 0.5)]


@pytest.mark.parametrize(
    "solid",
    [
        csg_xml("intersection", GLASS.replace("dielectric", "schlick"), *LENS),
        csg_xml("difference", GLASS, '<shape type="ellipsoid"><vector name="radii" value="1, 0.6, 0.8"/></shape>', TUBE),
        csg_xml("intersection", GLASS, '<shape type="hyperboloid"><float name="radius" value="0.5"/></shape>', LENS[0]),
    ],
    ids=["lens", "drilled ellipsoid", "cut hyperboloid"],
)
def test_glass_is_invisible_in_a_constant_environment(load: Load, renderer: ref.Renderer, solid: str) -> None:
    """The glass would be visible if a surface were missing, doubled, or turned inside out."""
    head = HEAD.replace('value="3"/></integrator>', 'value="100"/><integer name="rr_depth" value="200"/></integrator>')
    image = np.array(renderer.mi.render(load('<emitter type="constant"/>' + solid, head), spp=256))
    assert np.abs(image.mean() - 1.0) < 5e-4
    assert np.median(np.abs(image - 1.0)) < 1e-5
