"""etendue's BSDFs in Mitsuba, compared with Mitsuba's chi-square test, closed forms, and Mitsuba's glass."""

import math
from typing import Any

import numpy as np
import pytest

import mitsuba_reference as ref
from helpers import need_wavefront

INCIDENCES = [0.0, 35.0, 70.0, 88.0]
PHONG = [(5.0, 0.3, 0.6), (60.0, 0.0, 1.0), (60.0, 0.5, 0.2), (1.0, 0.0, 0.9)]
METAL = [0.15, 0.3, 0.9, 1.0, 1.7]
CHI2_TESTS = len(INCIDENCES) * (len(PHONG) + len(METAL))


@pytest.fixture(scope="module")
def mi(renderer: ref.Renderer) -> Any:
    return renderer.mi


def phong(mi: Any, exponent: float, diffuse: float, specular: float) -> Any:
    return mi.load_dict(
        {"type": "phong", "exponent": exponent, "diffuse_reflectance": diffuse, "specular_reflectance": specular}
    )


def metal(mi: Any, roughness: float, reflectance: float = 1.0) -> Any:
    return mi.load_dict({"type": "metal", "roughness": roughness, "reflectance": reflectance})


def schlick(mi: Any, **parameters: Any) -> Any:
    return mi.load_dict({"type": "schlick", "int_ior": 1.5, "ext_ior": 1.0, **parameters})


def direction(degrees: float, azimuth: float = 0.0) -> list[float]:
    """The unit direction at an angle from the normal."""
    theta, phi = math.radians(degrees), math.radians(azimuth)
    return [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]


def arriving(mi: Any, wi: list[float]) -> Any:
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(wi)
    si.t = 1.0
    return si


def chi2_p_value(mi: Any, kind: str, parameters: str, wi: list[float], res: int) -> float:
    need_wavefront(mi)
    from mitsuba.chi2 import BSDFAdapter, ChiSquareTest, SphericalDomain

    sample, pdf = BSDFAdapter(kind, parameters, wi=wi)
    test = ChiSquareTest(SphericalDomain(), sample, pdf, 3, sample_count=1_000_000, res=res, ires=16, seed=7)
    test.run(test_count=CHI2_TESTS, quiet=True)
    assert not test.fail, test.messages
    return test.p_value


def threshold() -> float:
    """The level of one test, Šidák-corrected to 1 % over all tests."""
    return 1.0 - 0.99 ** (1.0 / CHI2_TESTS)


@pytest.mark.parametrize("incidence", INCIDENCES)
@pytest.mark.parametrize(("exponent", "diffuse", "specular"), PHONG)
def test_phong_samples_its_pdf(mi: Any, exponent: float, diffuse: float, specular: float, incidence: float) -> None:
    parameters = (
        f'<float name="exponent" value="{exponent}"/><float name="diffuse_reflectance" value="{diffuse}"/>'
        f'<float name="specular_reflectance" value="{specular}"/>'
    )
    assert chi2_p_value(mi, "phong", parameters, direction(incidence, 20.0), 101) > threshold()


@pytest.mark.parametrize("incidence", INCIDENCES)
@pytest.mark.parametrize("roughness", METAL)
def test_metal_samples_its_pdf(mi: Any, roughness: float, incidence: float) -> None:
    parameters = f'<float name="roughness" value="{roughness}"/>'
    # The pdf ends with a vertical tangent, so the trapezoid rule of the test needs small cells.
    assert chi2_p_value(mi, "metal", parameters, direction(incidence, 20.0), 301 if roughness < 0.5 else 101) > threshold()


def estimated_albedo(mi: Any, bsdf: Any, incidence: float, count: int = 4_000_000) -> tuple[float, float]:
    """Mean and standard error of the albedo from cosine-weighted directions, which are not sampled by the BSDF itself."""
    need_wavefront(mi)
    rng = np.random.default_rng(5)
    u, v = (rng.random(count) for _ in range(2))
    wo = np.stack([np.sqrt(u) * np.cos(2 * np.pi * v), np.sqrt(u) * np.sin(2 * np.pi * v), np.sqrt(1 - u)])
    values = np.array(bsdf.eval(mi.BSDFContext(), arriving(mi, direction(incidence)), mi.Vector3f(wo)))[0] / wo[2] * np.pi
    return float(values.mean()), float(values.std() / math.sqrt(count))


@pytest.mark.parametrize(("incidence", "albedo"), [(0.0, 1.0), (30.0, 0.8660285253), (60.0, 0.5047359467), (80.0, 0.2280562925)])
def test_phong_has_the_albedo_of_the_closed_form(mi: Any, incidence: float, albedo: float) -> None:
    mean, error = estimated_albedo(mi, phong(mi, 10.0, 0.0, 1.0), incidence)
    assert abs(mean - albedo) < 4.0 * error < 0.02


def test_phong_equals_its_formula(mi: Any) -> None:
    """wo at 50 degrees, the mirror of wi at 30 degrees: alpha = 20 degrees."""
    bsdf, si = phong(mi, 10.0, 0.3, 0.4), arriving(mi, direction(30.0))
    expected = (0.3 / math.pi + 0.4 * 12.0 / (2.0 * math.pi) * math.cos(math.radians(20.0)) ** 10) * math.cos(math.radians(50.0))
    value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(direction(50.0, 180.0)))
    assert np.allclose(np.ravel(value), expected, rtol=1e-5)
    assert np.all(np.ravel(bsdf.eval(mi.BSDFContext(), si, -mi.Vector3f(direction(50.0)))) == 0.0)
    assert np.all(np.ravel(bsdf.eval(mi.BSDFContext(), arriving(mi, direction(150.0)), mi.Vector3f(direction(50.0)))) == 0.0)


@pytest.mark.parametrize(
    ("roughness", "mu", "pdf"),
    [(0.3, 0.98, 3.8795052929), (0.7, 0.9, 0.6938239482), (1.0, 0.5, 0.0795774715), (1.5, -0.5, 0.008975772), (0.3, 0.95, 0.0)],
)
def test_metal_has_the_pdf_of_the_closed_form(mi: Any, roughness: float, mu: float, pdf: float) -> None:
    """The reflectance is 0.5. wi is chosen so that a wo above the horizon has the angle acos(mu) to the mirror direction."""
    away = math.degrees(math.acos(mu))
    incidence = min(85.0, away)
    si, wo = arriving(mi, direction(incidence)), mi.Vector3f(direction(incidence - away, 180.0))
    bsdf = metal(mi, roughness, 0.5)
    assert np.ravel(bsdf.pdf(mi.BSDFContext(), si, wo))[0] == pytest.approx(pdf, rel=2e-5)
    assert np.ravel(bsdf.eval(mi.BSDFContext(), si, wo))[0] == pytest.approx(0.5 * pdf, rel=2e-5)


@pytest.mark.parametrize(
    ("roughness", "incidence", "albedo"), [(0.3, 80.0, 0.885638), (0.3, 89.0, 0.543582), (1.0, 60.0, 0.843750)]
)
def test_metal_absorbs_directions_below_the_horizon(mi: Any, roughness: float, incidence: float, albedo: float) -> None:
    mean, error = estimated_albedo(mi, metal(mi, roughness), incidence)
    assert abs(mean - albedo) < 4.0 * error < 0.03


def test_metal_is_not_reciprocal_and_has_an_adjoint(mi: Any) -> None:
    a, b = direction(20.0), direction(55.0, 180.0)
    particles = mi.BSDFContext(mi.TransportMode.Importance)
    bsdf = metal(mi, 0.8)
    radiance = np.ravel(bsdf.eval(mi.BSDFContext(), arriving(mi, b), mi.Vector3f(a)))[0] / a[2]
    importance = np.ravel(bsdf.eval(particles, arriving(mi, a), mi.Vector3f(b)))[0] / b[2]
    assert importance == pytest.approx(radiance, rel=1e-5)
    assert importance != pytest.approx(np.ravel(bsdf.eval(mi.BSDFContext(), arriving(mi, a), mi.Vector3f(b)))[0] / b[2], rel=0.1)


def test_smooth_metal_is_a_mirror(mi: Any) -> None:
    bsdf, si = metal(mi, 0.0, 0.7), arriving(mi, direction(40.0))
    bs, weight = bsdf.sample(mi.BSDFContext(), si, 0.3, mi.Point2f(0.4, 0.6))
    assert np.allclose(np.ravel(bs.wo), direction(40.0, 180.0), atol=1e-6)
    assert np.allclose(np.ravel(weight), 0.7)
    assert mi.has_flag(bsdf.flags(), mi.BSDFFlags.DeltaReflection) and not mi.has_flag(bsdf.flags(), mi.BSDFFlags.Glossy)
    assert np.ravel(bs.sampled_type)[0] == +mi.BSDFFlags.DeltaReflection


def reflected(mi: Any, bsdf: Any, degrees: float) -> float:
    """The reflectance: the pdf of a reflected sample, or 0 if no sample is reflected."""
    bs, _ = bsdf.sample(mi.BSDFContext(), arriving(mi, direction(degrees)), 0.0, mi.Point2f(0.5, 0.5))
    pdf, kind = np.ravel(bs.pdf)[0], np.ravel(bs.sampled_type)[0]
    return float(pdf) if kind == +mi.BSDFFlags.DeltaReflection else 0.0


def test_schlick_has_the_reflectance_of_the_closed_form(mi: Any) -> None:
    glass = schlick(mi)
    assert reflected(mi, glass, 0.0) == pytest.approx(0.04, rel=1e-5)
    assert reflected(mi, glass, 84.975) == pytest.approx(0.647021, rel=5e-5)
    # From inside, at the angle that is refracted to 84.975 degrees.
    inside = 180.0 - math.degrees(math.asin(math.sin(math.radians(84.975)) / 1.5))
    assert reflected(mi, glass, inside) == pytest.approx(0.647021, rel=2e-4)
    assert reflected(mi, glass, 180.0 - 41.9) == 1.0


def test_schlick_without_reflectance_keeps_total_internal_reflection(mi: Any) -> None:
    glass = schlick(mi, reflectance_model="none")
    assert [reflected(mi, glass, degrees) for degrees in (0.0, 85.0, 180.0 - 41.7, 180.0 - 41.9)] == [0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize("degrees", [0.0, 50.0, 150.0, 178.0])
@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("indices", [{}, {"int_ior": "diamond", "ext_ior": 1.2}, {"int_ior": 1.0, "ext_ior": "water"}])
def test_schlick_refracts_like_the_glass_of_mitsuba(mi: Any, degrees: float, mode: str, indices: dict[str, Any]) -> None:
    """Directions, weights, flags and indices agree for reflection and refraction; only the pdfs may differ."""
    context = mi.BSDFContext(getattr(mi.TransportMode, mode))
    rest = {"specular_reflectance": 0.9, "specular_transmittance": 0.8, **indices}
    ours, theirs = (mi.load_dict({"type": kind, **rest}) for kind in ("schlick", "dielectric"))
    assert ours.flags() == theirs.flags()
    si, anywhere = arriving(mi, direction(degrees, 10.0)), mi.Point2f(0.5, 0.5)
    for sample in (0.0, 0.9999):
        a, b = (bsdf.sample(context, si, sample, anywhere) for bsdf in (ours, theirs))
        for name in ("wo", "eta", "sampled_type", "sampled_component"):
            assert np.allclose(np.ravel(getattr(a[0], name)), np.ravel(getattr(b[0], name)), atol=1e-6), name
        assert np.allclose(np.ravel(a[1]), np.ravel(b[1]), rtol=1e-5)


@pytest.mark.parametrize(
    ("bsdf", "message"),
    [
        ({"type": "phong", "ambient": {"type": "rgb", "value": [0.1, 0.0, 0.0]}}, "ambient"),
        ({"type": "schlick", "reflectance_model": "fresnel"}, "unknown reflectance_model 'fresnel'"),
    ],
)
def test_parameters_without_a_stand_in_are_errors(mi: Any, bsdf: dict[str, Any], message: str) -> None:
    with pytest.raises(Exception, match=message):
        mi.load_dict(bsdf)


def test_each_works_inside_the_bsdfs_of_mitsuba(mi: Any) -> None:
    """Inside twosided, blendbsdf and mask, and with two integrators: in a white environment, a rectangle shows its albedo."""
    blend = {"type": "blendbsdf", "weight": 0.25, "a": {"type": "metal", "roughness": 0.4}, "b": {"type": "phong"}}
    for integrator in ("path", "volpath"):
        scene = {
            "type": "scene",
            "integrator": {"type": integrator, "max_depth": 2},
            "environment": {"type": "constant"},
            "mirror": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 180),
                "bsdf": {"type": "mask", "opacity": 1.0, "inner": {"type": "twosided", "inner": blend}},
            },
            "sensor": {
                "type": "perspective",
                "fov": 5.0,
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8},
            },
        }
        image = np.array(mi.render(mi.load_dict(scene), spp=1024))
        # At normal incidence, the metal reflects everything, and Phong (n = 30) reflects 0.5 + 0.2.
        assert image.mean() == pytest.approx(0.75 + 0.25 * 0.7, rel=4e-3)
