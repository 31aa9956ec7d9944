"""Stand-ins for etendue's plugins that Mitsuba lacks. They replace these plugins in the nodes of a parsed scene.

- `plane` becomes a square. `triangle` and `kcply` become meshes. `cone`, `paraboloid`, `hyperboloid` and `quadric` become fine
  meshes
- `ellipsoid`, an ellipsoidal `quadric`, and a `sphere` or `cylinder` with unequal scales become instances of unit shapes. They
  are exact, except that Mitsuba intersects them in single precision: from a distance of d radii, the error is at most 3e-7 d^2
  radii. Those with an emitter become fine meshes, because Mitsuba cannot instance emitters
- `csg` becomes the surfaces of its operands, each masked where it does not bound the solid. It is as exact as its operands. No
  other surface may coincide with a masked one: a ray that passes the mask misses the other surface
- `absorption` of glass becomes a medium without scattering inside each of its shapes, rendered with volpathmis. Mitsuba derives
  the medium from the last interface, so two cases are not supported: an absorbing medium around glass, and a camera in a medium
- `allow_open` is removed: in Mitsuba, glass may be open
- `normals` becomes an emitter; `phong`, `metal` and `schlick` are BSDFs of mitsuba_bsdfs
- `photonmapper` becomes `path`, an unbiased estimator of the same image. `path` misses the caustics of `point`, `spot` and
  `directional` lights. For these lights, `ptracer` can be the stand-in: it finds their caustics, but mirrors and glass look black
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import solids
import surfaces
from solids import Operation, Primitive, Test
from surfaces import Array, Quadric, Surface
from user_error import UserError

BSDFS = ("phong", "metal", "schlick")
GLASS = ("dielectric", "schlick")

# The possible stand-ins for `photonmapper`, and how PROVENANCE.toml describes them.
FOR_PHOTONS = {"path": "path", "ptracer": "ptracer, which shows mirrors and glass black"}
# The parameters that all of them have.
INTEGRATOR_PARAMETERS = ("max_depth", "rr_depth", "hide_emitters")


@dataclass
class Tree:
    """The nodes of a parsed scene, identified by their indices, because adding a node moves the others in memory."""

    mi: ModuleType
    state: Any

    def props(self, node: int) -> Any:
        return self.state.nodes[node].props

    def plugin(self, node: int) -> str:
        return self.props(node).plugin_name()

    def every(self, kind: str, *plugins: str) -> Iterator[int]:
        """The nodes of a kind (Shape, BSDF, ...); if plugins are given, only the nodes of these plugins."""
        wanted = getattr(self.mi.ObjectType, kind)
        for node in range(len(self.state.nodes)):
            if self.state.nodes[node].type == wanted and (not plugins or self.plugin(node) in plugins):
                yield node

    def children(self, node: int, kind: str) -> list[tuple[str, int]]:
        """The property name and the index of each child of a kind, in document order."""
        props = self.props(node)
        names = [name for name in props if props.type(name) == self.mi.Properties.Type.ResolvedReference]
        found = [(name, props[name].index()) for name in names]
        return [(name, child) for name, child in found if self.state.nodes[child].type == getattr(self.mi.ObjectType, kind)]

    def add(self, like: int, kind: str, plugin: str) -> int:
        """Add a node without properties; errors are reported at the location of the node `like`."""
        node = self.mi.parser.SceneNode(self.state.nodes[like])
        node.type, node.props = getattr(self.mi.ObjectType, kind), self.mi.Properties(plugin)
        self.state.nodes.append(node)
        return len(self.state.nodes) - 1

    def copy(self, node: int) -> int:
        """Add a node with the same properties and children, but without an id."""
        self.state.nodes.append(self.mi.parser.SceneNode(self.state.nodes[node]))
        self.props(len(self.state.nodes) - 1).set_id("")
        return len(self.state.nodes) - 1

    def refer(self, node: int, name: str, child: int) -> None:
        self.props(node)[name] = self.mi.Properties.ResolvedReference(child)

    def take(self, node: int, name: str, default: Any) -> Any:
        """Remove a property and return its value."""
        props = self.props(node)
        if name not in props:
            return default
        value = props[name]
        del props[name]
        return value

    def take_vector(self, node: int, name: str, default: Any) -> Array:
        return np.array(self.take(node, name, default), dtype=np.float64)

    def take_matrix(self, node: int) -> Array:
        """Remove to_world and return its matrix."""
        to_world = self.take(node, "to_world", None)
        return np.eye(4) if to_world is None else np.array(to_world.matrix, dtype=np.float64)

    def set_matrix(self, node: int, matrix: Array) -> None:
        self.props(node)["to_world"] = self.mi.ScalarTransform4d(matrix)

    @contextmanager
    def restored(self, node: int) -> Iterator[None]:
        """Restore the properties of a node at the end."""
        saved = self.mi.Properties(self.props(node))
        yield
        self.state.nodes[node].props = saved

    @contextmanager
    def faults_at(self, node: int) -> Iterator[None]:
        """Turn a ValueError into an error at the location of a node."""
        try:
            yield
        except ValueError as error:
            raise self.error(node, str(error)) from error

    def error(self, node: int, text: str) -> UserError:
        place = self.mi.parser.file_location(self.state, self.state.nodes[node])
        return UserError(f"{place}: {self.plugin(node)}: {text}")


@dataclass
class StandIns:
    """Inserts stand-ins. `used` lists them, `folder` receives their meshes, `beside` is the folder of the scene."""

    tree: Tree
    beside: Path
    folder: Path
    used: dict[str, None] = field(default_factory=dict)

    def note(self, plugin: str, stand_in: str) -> None:
        self.used[f"{plugin}: {stand_in}"] = None

    # --- one shape ---

    def shape(self, node: int) -> None:
        """Replace one shape that Mitsuba lacks by one of Mitsuba's with the same children."""
        replace = {
            "plane": self.plane,
            "triangle": self.triangle,
            "kcply": self.kcply,
            "ellipsoid": self.ellipsoid,
            "sphere": self.sphere,
            "cylinder": self.cylinder,
            "cone": self.revolved,
            "paraboloid": self.revolved,
            "hyperboloid": self.revolved,
            "quadric": self.quadric,
        }.get(self.tree.plugin(node))
        if replace:
            with self.tree.faults_at(node):
                replace(node)

    def mesh(self, node: int, surface: Surface) -> None:
        """Turn a shape into a mesh in its local coordinates, which its to_world maps to the world."""
        path = self.folder / f"{node}.ply"
        surfaces.write_ply(path, surface)
        props = self.tree.props(node)
        props.set_plugin_name("ply")
        props["filename"] = str(path)

    def world_mesh(self, node: int, surface: Surface, matrix: Array) -> None:
        """Turn a shape into a mesh under an affine map, and note its number of triangles if it is fine."""
        if len(surface.faces) > 1000:
            self.note(self.tree.plugin(node), f"mesh of {len(surface.faces)} triangles")
            self.tree.props(0)["embree_use_robust_intersections"] = True
        self.mesh(node, surface.transformed(matrix))

    def plane(self, node: int) -> None:
        if self.tree.children(node, "Emitter"):
            raise self.tree.error(node, "no stand-in for an infinite area light")
        self.note("plane", f"square of half-size {surfaces.PLANE_HALF_SIZE:g}")
        self.world_mesh(node, surfaces.plane(), self.tree.take_matrix(node))

    def triangle(self, node: int) -> None:
        corners, normals = ([self.tree.take(node, f"{letter}{k}", None) for k in range(3)] for letter in "pn")
        if any(p is None for p in corners) or len({n is None for n in normals}) > 1:
            raise self.tree.error(node, "needs p0, p1 and p2, and either all or none of n0, n1 and n2")
        flat = normals[0] is None
        surface = surfaces.triangle(np.array(corners, dtype=np.float64), None if flat else np.array(normals, dtype=np.float64))
        self.note("triangle", "mesh")
        self.mesh(node, surface)
        self.tree.props(node)["face_normals"] = flat

    def kcply(self, node: int) -> None:
        name = self.tree.take(node, "filename", None)
        if name is None:
            raise self.tree.error(node, "needs a filename")
        surface = surfaces.read_kcply(self.beside / name, self.tree.take(node, "index_base", "auto"))
        self.note("kcply", "mesh")
        self.mesh(node, surface)

    def ellipsoid(self, node: int) -> None:
        self.affine(node, "sphere", self.unit_map(node), surfaces.sphere)

    def sphere(self, node: int) -> None:
        props = self.tree.props(node)
        to_world = np.array(props["to_world"].matrix) if "to_world" in props else np.eye(4)
        if not _is_similarity(to_world):
            self.affine(node, "sphere", self.unit_map(node), surfaces.sphere)

    def cylinder(self, node: int) -> None:
        with self.tree.restored(node):
            is_round = _is_round(self.unit_map(node))
        if not is_round:
            self.affine(node, "cylinder", self.unit_map(node), surfaces.cylinder)

    def affine(self, node: int, unit: str, matrix: Array, tessellated: Callable[[], Surface]) -> None:
        """Turn a shape into the image of Mitsuba's unit sphere or cylinder under an affine map."""
        tree, props = self.tree, self.tree.props(node)
        if unit == "sphere" and _is_similarity(matrix):
            self.note(tree.plugin(node), "sphere")
            props.set_plugin_name(unit)
            tree.set_matrix(node, matrix)
        elif tree.children(node, "Emitter"):
            self.world_mesh(node, tessellated(), matrix)
        else:
            self.note(tree.plugin(node), f"instance of a {unit}")
            inner, group = tree.copy(node), tree.add(node, "Shape", "shapegroup")
            tree.props(inner).set_plugin_name(unit)
            tree.refer(group, "shape", inner)
            # Mitsuba needs the group as a child of the scene, too.
            tree.refer(0, f"group_{group}", group)
            tree.state.nodes[node].props = tree.mi.Properties("instance")
            tree.refer(node, "group", group)
            tree.set_matrix(node, matrix)

    def revolved(self, node: int) -> None:
        plugin, parameters = self.tree.plugin(node), self.parameters(node)
        self.world_mesh(node, getattr(surfaces, plugin)(*parameters), self.tree.take_matrix(node))

    def quadric(self, node: int) -> None:
        shape, low, high = self.quadric_parameters(node)
        matrix, ellipsoid = self.tree.take_matrix(node), shape.ellipsoid()
        if ellipsoid is not None and surfaces.within(ellipsoid, low, high):
            self.affine(node, "sphere", matrix @ ellipsoid, surfaces.sphere)
        else:
            self.world_mesh(node, surfaces.quadric(shape, low, high), matrix)

    # --- parameters: each is removed from its node ---

    def unit_map(self, node: int) -> Array:
        """The affine map of the unit shape onto a sphere, ellipsoid, cylinder, cube or plane."""
        tree, plugin, local = self.tree, self.tree.plugin(node), np.eye(4)
        if plugin in ("sphere", "ellipsoid"):
            local[:3, 3] = tree.take_vector(node, "center", np.zeros(3))
            radii = tree.take_vector(node, "radii", np.full(3, tree.take(node, "radius", 1.0)))
            if (radii <= 0.0).any():
                raise tree.error(node, "a radius is not positive")
            local[:3, :3] = np.diag(radii)
        elif plugin == "cylinder":
            p0, p1 = tree.take_vector(node, "p0", np.zeros(3)), tree.take_vector(node, "p1", [0.0, 0.0, 1.0])
            axis = p1 - p0
            across = np.linalg.svd(axis[None, :])[2][1]
            sides = np.column_stack([across, np.cross(axis, across) / np.linalg.norm(axis)])
            local[:3, :2], local[:3, 2], local[:3, 3] = tree.take(node, "radius", 1.0) * sides, axis, p0
        return tree.take_matrix(node) @ local

    def parameters(self, node: int) -> list[Any]:
        """The parameters of a cone, paraboloid or hyperboloid, in the order of the functions in surfaces and solids."""
        tree, plugin = self.tree, self.tree.plugin(node)
        found = [tree.take(node, "radius", 1.0), tree.take(node, "axis" if plugin == "hyperboloid" else "height", 1.0)]
        if min(found) <= 0.0:
            raise tree.error(node, "a length is not positive")
        if plugin == "hyperboloid":
            found += [tree.take(node, "z_min", -1.0), tree.take(node, "z_max", 1.0), tree.take(node, "sheets", 1)]
            if found[2] >= found[3] or found[4] not in (1, 2):
                raise tree.error(node, "needs z_min < z_max and 1 or 2 sheets")
        return found

    def quadric_parameters(self, node: int) -> tuple[Quadric, Array, Array]:
        tree = self.tree
        text = tree.take(node, "coefficients", "")
        with tree.faults_at(node):
            coefficients = [float(word) for word in text.replace(",", " ").split()]
        corners = [tree.take(node, name, None) for name in ("bbox_min", "bbox_max")]
        if len(coefficients) != 10 or any(corner is None for corner in corners):
            raise tree.error(node, "needs ten coefficients, bbox_min and bbox_max")
        low, high = np.array(corners, dtype=np.float64)
        return Quadric.of(coefficients), low, high

    # --- csg ---

    def csg(self, node: int) -> None:
        """Replace a csg that is a child of the scene by the masked surfaces of its operands."""
        root = self.tree.props(0)
        names = [name for name, child in self.tree.children(0, "Shape") if child == node]
        if not names:
            raise self.tree.error(node, "must be a child of the scene or of a csg")
        del root[names[0]]
        parts: list[_Part] = []
        solid = self.operation(node, np.eye(4), None, False, parts)
        for part in parts:
            self.masked(part, solid)
        self.note("csg", "surfaces of its operands, masked where they do not bound it")

    def operation(self, node: int, outer: Array, bsdf: int | None, flipped: bool, parts: list["_Part"]) -> Operation:
        tree = self.tree
        matrix = outer @ tree.take_matrix(node)
        name, flipped = tree.take(node, "operation", ""), flipped ^ tree.take(node, "flip_normals", False)
        if name not in ("union", "intersection", "difference"):
            raise tree.error(node, f"unknown operation {name!r}; known: union, intersection, difference")
        for _, own in tree.children(node, "BSDF"):
            bsdf = own
        operands: list[Primitive | Operation] = []
        children = tree.children(node, "Shape")
        if not children or len(list(tree.props(node))) != len(children) + len(tree.children(node, "BSDF")):
            raise tree.error(node, "may contain only shapes, an operation, to_world, flip_normals and a bsdf")
        for k, (_, child) in enumerate(children):
            subtracted = flipped ^ (name == "difference" and k > 0)
            if tree.plugin(child) == "csg":
                operands.append(self.operation(child, matrix, bsdf, subtracted, parts))
            else:
                operands.append(self.primitive(child, matrix, bsdf, subtracted, parts))
        return Operation(name, operands)

    def primitive(self, node: int, outer: Array, bsdf: int | None, flipped: bool, parts: list["_Part"]) -> Primitive:
        """The solid of an operand. Its surfaces are added to `parts`: its own surface, and the caps that close it."""
        tree, mantle = self.tree, self.tree.copy(node)
        if tree.children(node, "Emitter"):
            raise tree.error(node, "no stand-in for an operand with an emitter")
        for _, own in tree.children(node, "BSDF"):
            bsdf = own
        if bsdf is None:
            bsdf = tree.add(node, "BSDF", "diffuse")
        for name, _ in tree.children(mantle, "BSDF"):
            del tree.props(mantle)[name]
        tree.set_matrix(mantle, outer @ tree.take_matrix(mantle))
        with tree.restored(mantle):
            test, matrix, caps, box = self.solid(mantle)
        with tree.faults_at(node):
            primitive = Primitive(test, np.linalg.inv(matrix))
        flipped ^= tree.take(mantle, "flip_normals", False)
        parts.append(_Part(primitive, mantle, bsdf, flipped, None))
        for z, radius, up in caps:
            disk = tree.add(node, "Shape", "disk")
            local = np.diag([radius, radius if up else -radius, 1.0 if up else -1.0, 1.0])
            local[2, 3] = z
            tree.set_matrix(disk, matrix @ local)
            parts.append(_Part(primitive, disk, bsdf, flipped, None))
        if box is not None:
            shape, low, high = box
            cube, local = tree.add(node, "Shape", "cube"), np.diag([*(high - low) / 2.0, 1.0])
            local[:3, 3] = (high + low) / 2.0
            tree.set_matrix(cube, matrix @ local)
            parts.append(_Part(primitive, cube, bsdf, flipped, solids.in_quadric(shape)))
        return primitive

    def solid(self, node: int) -> tuple[Test, Array, list[tuple[float, float, bool]], tuple[Quadric, Array, Array] | None]:
        """The membership test and the frame of an operand, and the surfaces that close it.

        Caps are (z, radius, whether +z is outside). A quadric has a box instead, given by two corners.
        """
        tree, plugin = self.tree, self.tree.plugin(node)
        simple = {
            "sphere": solids.in_sphere,
            "ellipsoid": solids.in_sphere,
            "cube": solids.in_cube,
            "cylinder": solids.in_cylinder,
            "plane": solids.below_plane,
        }
        if plugin in simple:
            caps = [(0.0, 1.0, False), (1.0, 1.0, True)] if plugin == "cylinder" else []
            return simple[plugin], self.unit_map(node), caps, None
        if plugin == "quadric":
            shape, low, high = self.quadric_parameters(node)
            inside, boxed = solids.in_quadric(shape), solids.in_box(low, high)
            return lambda x, y, z: inside(x, y, z) & boxed(x, y, z), tree.take_matrix(node), [], (shape, low, high)
        if plugin not in ("cone", "paraboloid", "hyperboloid"):
            raise tree.error(node, "has no stand-in as an operand of csg")
        parameters = self.parameters(node)
        matrix = tree.take_matrix(node)
        if plugin == "cone":
            return solids.in_cone(*parameters), matrix, [(0.0, parameters[0], False)], None
        if plugin == "paraboloid":
            return solids.in_paraboloid(*parameters), matrix, [(parameters[1], parameters[0], True)], None
        radius, axis, z_min, z_max, sheets = parameters
        squares = [((z / axis) ** 2 + (1.0 if sheets == 1 else -1.0), z, z == z_max) for z in (z_min, z_max)]
        caps = [(z, radius * float(np.sqrt(square)), up) for square, z, up in squares if square > 0.0]
        return solids.in_hyperboloid(*parameters), matrix, caps, None

    def masked(self, part: "_Part", solid: Operation) -> None:
        """Add one masked surface to the scene."""
        tree, node = self.tree, part.node
        kept = solids.kept_texture(tree.mi, solid, part.primitive, part.also)
        mask = tree.add(node, "BSDF", "mask")
        tree.props(mask)["opacity"] = kept
        tree.refer(mask, "bsdf", part.bsdf)
        tree.refer(node, "bsdf", mask)
        if tree.plugin(part.bsdf) == "normals":
            self.add_normals_emitter(node, kept)
        tree.props(node)["flip_normals"] = part.flipped
        self.shape(node)
        tree.refer(0, f"stand_in_{node}", node)

    # --- emitters, media and integrators ---

    def add_normals_emitter(self, node: int, kept: Any = None) -> None:
        """Let a shape emit the colour of its normals."""
        emitter = self.tree.add(node, "Emitter", "normals_emitter")
        if kept is not None:
            self.tree.props(emitter)["kept"] = kept
        self.tree.refer(node, "normals_emitter", emitter)

    def media(self, solids: set[int]) -> bool:
        """Put a medium inside each shape of absorbing glass; returns whether there is one.

        Raises UserError if one of these shapes is in `solids`, the csgs and their operands.
        """
        tree, absorbing = self.tree, {}
        for node in tree.every("BSDF", *GLASS):
            absorption = tree.take_vector(node, "absorption", np.zeros(3))
            if absorption.any():
                absorbing[node] = absorption
        for node in tree.every("BSDF"):
            if any(child in absorbing for _, child in tree.children(node, "BSDF")):
                raise tree.error(node, "no stand-in for absorbing glass inside another bsdf")
        for node in list(tree.every("Shape")):
            for _, bsdf in tree.children(node, "BSDF"):
                if bsdf in absorbing and node in solids:
                    raise tree.error(node, "no stand-in for absorbing glass in a csg")
                if bsdf in absorbing:
                    self.fill(node, absorbing[bsdf])
        return bool(absorbing)

    def fill(self, node: int, absorption: Array) -> None:
        """Put an absorbing medium inside a shape."""
        tree = self.tree
        medium, greatest = tree.add(node, "Medium", "homogeneous"), float(absorption.max())
        # Mitsuba accepts no colour above 1.
        tree.props(medium)["sigma_t"] = tree.mi.ScalarColor3f(absorption / greatest)
        tree.props(medium)["scale"] = greatest
        tree.props(medium)["albedo"] = 0.0
        tree.refer(node, "interior", medium)
        self.note("absorption", "homogeneous medium that does not scatter")

    def open_meshes(self) -> None:
        """Remove allow_open, which Mitsuba does not need."""
        for node in self.tree.every("Shape"):
            if self.tree.take(node, "allow_open", None) is not None:
                self.note("allow_open", "nothing")

    def photon_mappers(self, stand_in: str) -> None:
        """Replace each photon mapper by an integrator without photon maps and with the same path limits."""
        tree = self.tree
        for node in tree.every("Integrator", "photonmapper"):
            if stand_in not in FOR_PHOTONS:
                raise tree.error(node, f"unknown stand-in {stand_in!r}; known: {', '.join(FOR_PHOTONS)}")
            props = tree.props(node)
            for name in [name for name in props if name not in INTEGRATOR_PARAMETERS]:
                del props[name]
            props.set_plugin_name(stand_in)
            self.note("photonmapper", FOR_PHOTONS[stand_in])

    def integrators(self, masks: bool, normals: bool, media: bool) -> None:
        """Replace an integrator that does not support masks or media, and refuse one that cannot render the scene."""
        tree = self.tree
        for node in list(tree.every("Integrator")):
            plugin, props = tree.plugin(node), tree.props(node)
            if normals and props.get("hide_emitters", False):
                raise tree.error(node, "in Mitsuba, hide_emitters also hides the stand-in for the bsdf normals")
            if normals and plugin == "ptracer":
                raise tree.error(node, "does not trace light from the stand-in for the bsdf normals")
            if not (masks or media) or plugin in ("volpath", "volpathmis", "moment"):
                continue
            if plugin not in ("path", "direct"):
                raise tree.error(node, "does not support the masks and media of stand-ins; path, direct and moment do")
            if plugin == "direct":
                for name in ("shading_samples", "emitter_samples", "bsdf_samples"):
                    tree.take(node, name, None)
                props["max_depth"] = 2
            stand_in, reason = ("volpathmis", "absorption") if media else ("volpath", "through masks")
            props.set_plugin_name(stand_in)
            self.note(plugin, f"{stand_in}, which sees {reason}")


@dataclass(frozen=True)
class _Part:
    """A surface of an operand: its shape, its bsdf, whether its normals are flipped, and a further test that cuts it."""

    primitive: Primitive
    node: int
    bsdf: int
    flipped: bool
    also: Test | None


def put_in(mi: ModuleType, state: Any, beside: Path, folder: Path, for_photons: str = "path") -> list[str]:
    """Insert stand-ins into a parsed, upgraded and resolved scene; returns a description of each.

    `beside` is the folder of the scene. `folder` receives meshes, which Mitsuba reads when it instantiates the scene.
    `for_photons` is the stand-in for `photonmapper`.
    """
    tree = Tree(mi, state)
    stand_ins = StandIns(tree, beside, folder)
    for node in tree.every("BSDF", *BSDFS):
        stand_ins.note(tree.plugin(node), "Python BSDF")
    normals = list(tree.every("BSDF", "normals"))
    for node in tree.every("BSDF"):
        if any(child in normals for _, child in tree.children(node, "BSDF")):
            raise tree.error(node, "no stand-in for the bsdf normals inside another bsdf")
    nested = {child for node in tree.every("Shape", "csg") for _, child in tree.children(node, "Shape")}
    csgs = list(tree.every("Shape", "csg"))
    media = stand_ins.media(nested.union(csgs))
    stand_ins.open_meshes()
    others = [node for node in tree.every("Shape") if node not in nested and node not in csgs]
    for node in others:
        if any(child in normals for _, child in tree.children(node, "BSDF")):
            stand_ins.add_normals_emitter(node)
        stand_ins.shape(node)
    for node in csgs:
        if node not in nested:
            stand_ins.csg(node)
    for node in normals:
        stand_ins.note("normals", "Python emitter on a black surface")
        tree.props(node).set_plugin_name("diffuse")
        tree.props(node)["reflectance"] = 0.0
    stand_ins.photon_mappers(for_photons)
    stand_ins.integrators(bool(csgs), bool(normals), media)
    return list(stand_ins.used)


def _is_similarity(matrix: Array) -> bool:
    """Whether an affine map preserves angles, with or without a reflection."""
    square = matrix[:3, :3].T @ matrix[:3, :3]
    return bool(np.allclose(square, square[0, 0] * np.eye(3), rtol=0.0, atol=1e-5 * square[0, 0]))


def _is_round(matrix: Array) -> bool:
    """Whether an affine map turns the unit cylinder into a circular cylinder."""
    square = matrix[:3, :3].T @ matrix[:3, :3]
    lengths = np.sqrt(np.diag(square))
    cosines = square / np.outer(lengths, lengths)
    return abs(lengths[0] / lengths[1] - 1.0) < 1e-5 and bool(np.allclose(cosines, np.eye(3), atol=1e-5))
