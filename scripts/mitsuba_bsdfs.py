"""etendue's BSDFs as Python plugins of Mitsuba: `phong`, `metal` and `schlick`; and the emission of `normals`, as an emitter.

`register` registers them with the current variant. Scene files then use them like Mitsuba's own plugins.
"""

import math
from types import ModuleType
from typing import Any

from user_error import UserError


def register(mi: ModuleType) -> None:
    """Register the plugins with Mitsuba's current variant."""
    for name, bsdf in (("phong", _phong(mi)), ("metal", _metal(mi)), ("schlick", _schlick(mi))):
        mi.register_bsdf(name, bsdf)
    mi.register_emitter("normals_emitter", _normals_emitter(mi))


def _phong(mi: ModuleType) -> Any:
    import drjit as dr

    class Phong(mi.BSDF):
        """Modified Phong: kd/pi + ks (n + 2)/(2 pi) cos^n(alpha), alpha from the mirror direction. The back is black."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            self.diffuse = props.get_texture("diffuse_reflectance", 0.5)
            self.specular = props.get_texture("specular_reflectance", 0.2)
            self.exponent = float(props.get("exponent", 30.0))
            if any(props.get("ambient", mi.ScalarColor3f(0.0))):
                raise UserError("phong: no stand-in for the ambient term")
            self.m_components = [
                mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide,
                mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide,
            ]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def diffuse_probability(self, si: Any, active: Any) -> Any:
            """The probability of sampling the diffuse component."""
            kd, ks = mi.luminance(self.diffuse.eval(si, active)), mi.luminance(self.specular.eval(si, active))
            return kd / dr.maximum(kd + ks, 1e-20)

        def lobe(self, wi: Any, wo: Any) -> Any:
            """The glossy lobe, cos^n(alpha)."""
            return dr.power(dr.maximum(dr.dot(mi.reflect(wi), wo), 0.0), self.exponent)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            p = self.diffuse_probability(si, active)
            is_diffuse = sample1 < p
            cosine = dr.power(sample2.x, 1.0 / (self.exponent + 1.0))
            sine = dr.safe_sqrt(1.0 - cosine * cosine)
            sin_phi, cos_phi = dr.sincos(2.0 * math.pi * sample2.y)
            around_mirror = mi.Frame3f(mi.reflect(si.wi)).to_world(mi.Vector3f(sine * cos_phi, sine * sin_phi, cosine))
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = dr.select(is_diffuse, mi.warp.square_to_cosine_hemisphere(sample2), around_mirror)
            bs.pdf = self.pdf(ctx, si, bs.wo, active)
            bs.eta = 1.0
            bs.sampled_component = dr.select(is_diffuse, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(
                is_diffuse, mi.UInt32(+mi.BSDFFlags.DiffuseReflection), mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            )
            return bs, self.eval(ctx, si, bs.wo, active) / dr.maximum(bs.pdf, 1e-20)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            active &= (si.wi.z > 0.0) & (wo.z > 0.0)
            specular = self.specular.eval(si, active) * (0.5 / math.pi * (self.exponent + 2.0) * self.lobe(si.wi, wo))
            return dr.select(active, (self.diffuse.eval(si, active) / math.pi + specular) * wo.z, 0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            active &= (si.wi.z > 0.0) & (wo.z > 0.0)
            p = self.diffuse_probability(si, active)
            specular = 0.5 / math.pi * (self.exponent + 1.0) * self.lobe(si.wi, wo)
            return dr.select(active, p * wo.z / math.pi + (1.0 - p) * specular, 0.0)

        def to_string(self) -> str:
            return f"Phong[exponent={self.exponent}]"

    return Phong


def _metal(mi: ModuleType) -> Any:
    import drjit as dr

    class Metal(mi.BSDF):
        """Reflects into the mirror direction plus roughness times a uniform point in the unit ball, normalized.

        Directions below the horizon are absorbed.
        """

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            self.reflectance = props.get_texture("reflectance", 1.0)
            self.roughness = float(props.get("roughness", 0.0))
            kind = mi.BSDFFlags.GlossyReflection if self.roughness > 0.0 else mi.BSDFFlags.DeltaReflection
            self.sampled = mi.UInt32(+kind)
            self.m_components = [kind | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            mirrored = mi.reflect(si.wi)
            inside = mi.warp.square_to_uniform_sphere(sample2) * dr.cbrt(sample1)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = dr.normalize(mirrored + self.roughness * inside) if self.roughness > 0.0 else mirrored
            bs.pdf = self.pdf_direction(si.wi, bs.wo) if self.roughness > 0.0 else mi.Float(1.0)
            bs.eta = 1.0
            bs.sampled_type = self.sampled
            active &= (si.wi.z > 0.0) & (bs.wo.z > 0.0) & (bs.pdf > 0.0)
            bs.pdf = dr.select(active, bs.pdf, 0.0)
            return bs, dr.select(active, self.reflectance.eval(si, active) * self.adjoint(ctx, si.wi, bs.wo), 0.0)

        def pdf_direction(self, wi: Any, wo: Any) -> Any:
            """The pdf per solid angle, a function of the cosine mu between wo and the mirror direction."""
            rho, mirrored = self.roughness, mi.reflect(wi)
            mu = dr.dot(mirrored, wo)
            # The root of rho^2 - 1 + mu^2, without cancellation.
            root = dr.safe_sqrt(rho * rho - dr.squared_norm(dr.cross(mirrored, wo)))
            if rho > 1.0:
                return (mu + root) ** 3 / (4.0 * math.pi * rho**3)
            return dr.select(mu > 0.0, root * (4.0 * mu * mu + rho * rho - 1.0) / (2.0 * math.pi * rho**3), 0.0)

        def adjoint(self, ctx: Any, wi: Any, wo: Any) -> Any:
            """The factor on the BSDF for importance transport; it is not 1, because the model is not reciprocal."""
            return wo.z / wi.z if ctx.mode == mi.TransportMode.Importance else mi.Float(1.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            value = self.reflectance.eval(si, active) * self.pdf(ctx, si, wo, active)
            return dr.select(value != 0.0, value * self.adjoint(ctx, si.wi, wo), 0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            if self.roughness == 0.0:
                return mi.Float(0.0)
            return dr.select(active & (si.wi.z > 0.0) & (wo.z > 0.0), self.pdf_direction(si.wi, wo), 0.0)

        def to_string(self) -> str:
            return f"Metal[roughness={self.roughness}]"

    return Metal


def _schlick(mi: ModuleType) -> Any:
    import drjit as dr

    class Schlick(mi.BSDF):
        """Smooth glass with Schlick's reflectance or none; total internal reflection is kept in both cases."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            # Mitsuba's own glass resolves the names and defaults of the indices of refraction.
            indices = {name: props[name] for name in ("int_ior", "ext_ior") if name in props}
            self.eta = float(mi.traverse(mi.load_dict({"type": "dielectric", **indices}))["eta"])
            self.model = props.get("reflectance_model", "schlick")
            if self.model not in ("schlick", "none"):
                raise UserError(f"schlick: unknown reflectance_model {self.model!r}; known: schlick, none")
            self.reflectance = props.get_texture("specular_reflectance", 1.0)
            self.transmittance = props.get_texture("specular_transmittance", 1.0)
            sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [
                mi.BSDFFlags.DeltaReflection | sides,
                mi.BSDFFlags.DeltaTransmission | sides | mi.BSDFFlags.NonSymmetric,
            ]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def fresnel(self, cosine: Any) -> tuple[Any, Any, Any]:
            """Reflectance, cosine of the refracted ray, and ratio of the indices.

            The refracted cosine has the opposite sign of `cosine`; it is 0 for total internal reflection.
            """
            _, refracted, ratio, _ = mi.fresnel(cosine, self.eta)
            normal = ((self.eta - 1.0) / (self.eta + 1.0)) ** 2
            rarer = dr.select(ratio > 1.0, dr.abs(cosine), dr.abs(refracted))
            partial = normal + (1.0 - normal) * (1.0 - rarer) ** 5 if self.model == "schlick" else mi.Float(0.0)
            return dr.select(refracted == 0.0, 1.0, partial), refracted, ratio

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            r, refracted, ratio = self.fresnel(si.wi.z)
            reflects = sample1 < r
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = dr.select(reflects, mi.reflect(si.wi), mi.refract(si.wi, refracted, 1.0 / ratio))
            bs.pdf = dr.select(active, dr.select(reflects, r, 1.0 - r), 0.0)
            bs.eta = dr.select(reflects, 1.0, ratio)
            bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(
                reflects, mi.UInt32(+mi.BSDFFlags.DeltaReflection), mi.UInt32(+mi.BSDFFlags.DeltaTransmission)
            )
            # Refraction scales radiance by the squared ratio of the indices, but not importance.
            scale = 1.0 / (ratio * ratio) if ctx.mode == mi.TransportMode.Radiance else mi.Float(1.0)
            weight = dr.select(reflects, self.reflectance.eval(si, active), self.transmittance.eval(si, active) * scale)
            return bs, dr.select(active & (bs.pdf > 0.0), weight, 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def to_string(self) -> str:
            return f"Schlick[eta={self.eta}, model={self.model}]"

    return Schlick


def _normals_emitter(mi: ModuleType) -> Any:
    import drjit as dr

    class NormalsEmitter(mi.Emitter):
        """Both sides of a surface emit the colour 0.5 (n + 1) of its shading normal.

        Emitter sampling never chooses it: only BSDF sampling finds its light.
        """

        def __init__(self, props: Any) -> None:
            mi.Emitter.__init__(self, props)
            # 1 where the surface exists, else 0: only a part of a csg operand's surface bounds the solid.
            self.kept = props.get_texture("kept", 1.0)
            self.m_flags = mi.EmitterFlags.Surface | mi.EmitterFlags.SpatiallyVarying

        def eval(self, si: Any, active: Any = True) -> Any:
            return dr.select(active, 0.5 * (mi.Color3f(si.sh_frame.n) + 1.0) * self.kept.eval_1(si, active), 0.0)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            # In the scalar variants, Dr.Jit cannot create zeros of this type.
            ds = dr.zeros(mi.DirectionSample3f) if dr.is_jit_v(mi.Float) else mi.DirectionSample3f()
            ds.pdf = 0.0
            return ds, mi.Color3f(0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0)

        def to_string(self) -> str:
            return "NormalsEmitter[]"

    return NormalsEmitter
