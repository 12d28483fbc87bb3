"""Renders a scene that `cargo xtask bench mitsuba` wrote down as JSON, with Mitsuba 3.

    python render.py SCENE.json OUT --batches N --spp N --seed N [--integrator I] [--variant V]
        [--max-depth D]

OUT.mean.f32 and OUT.variance.f32 hold, as raw little-endian float32, height x width x 3 values: the mean of all samples
and the unbiased variance of one sample, which comes from the spread of the batches' means. OUT.json holds the number of
samples a pixel, the seconds and CPU seconds spent in rendering without compilation, and the variant.
"""

import argparse
import json
import time

import mitsuba as mi
import numpy as np


def rgb(values):
    """A spectrum whose three values are meant as they are."""
    return {"type": "rgb", "value": list(values)}


def emitter(light):
    """A light of ours as Mitsuba's; both give irradiance, radiant intensity and radiance in the same units."""
    (kind, of), = light.items()
    if kind == "directional":
        return {"type": "directional", "direction": of["direction"], "irradiance": rgb(of["irradiance"])}
    if kind == "point":
        return {"type": "point", "position": of["position"], "intensity": rgb(of["intensity"])}
    if kind == "constant":
        return {"type": "constant", "radiance": rgb(of["radiance"])}
    if kind == "environment":
        # Mitsuba's first column is where ours is the middle, at -z; both turn about +y.
        turn = mi.ScalarTransform4f().rotate([0, 1, 0], of["rotate"] + 180)
        return {"type": "envmap", "filename": of["file"], "to_world": turn}
    raise SystemExit(f"Mitsuba has no light like {kind}")


def phase(of):
    """A phase function; Mitsuba's g is positive for forward scattering, too."""
    if of == "isotropic":
        return {"type": "isotropic"}
    if of == "rayleigh":
        return {"type": "rayleigh"}
    return {"type": "hg", "g": of["hg"]["g"]}


def medium(volume):
    """The box of a medium, its surface invisible."""
    sigma_s, sigma_a = np.array(volume["sigma_s"]), np.array(volume["sigma_a"])
    sigma_t = sigma_s + sigma_a
    albedo = sigma_s / sigma_t
    unit = mi.ScalarTransform4f(np.array(volume["world_from_unit"]))
    if volume["voxels"] is None:
        # Mitsuba takes colours up to 1; the rest goes to the scale.
        scale = float(sigma_t.max())
        interior = {"type": "homogeneous", "sigma_t": rgb(sigma_t / scale), "albedo": rgb(albedo), "scale": scale}
    else:
        if not np.all(sigma_t == sigma_t[0]):
            raise SystemExit("Mitsuba's heterogeneous media take one extinction for all channels")
        grid = {
            "type": "gridvolume",
            "filename": volume["voxels"],
            "filter_type": "trilinear",
            "wrap_mode": "clamp",
            "raw": True,
            "to_world": unit,
        }
        # `albedo` is of the type constvolume; `scale` multiplies the density to the extinction.
        interior = {"type": "heterogeneous", "sigma_t": grid, "albedo": rgb(albedo), "scale": float(sigma_t[0])}
    interior["phase"] = phase(volume["phase"])
    # Mitsuba's cube goes from -1 to 1.
    cube = unit @ mi.ScalarTransform4f().scale(0.5).translate([1, 1, 1])
    return {"type": "cube", "to_world": cube, "bsdf": {"type": "null"}, "interior": interior}


def surface(of):
    """Triangles; both sides reflect, and the front emits."""
    ((kind, value),) = of["bsdf"].items()
    if kind == "lambert":
        bsdf = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(value)}}
    elif kind == "mirror":
        mirror = {"type": "conductor", "material": "none", "specular_reflectance": rgb(value)}
        bsdf = {"type": "twosided", "bsdf": mirror}
    else:
        bsdf = {"type": "dielectric", "int_ior": value, "ext_ior": 1.0}
    result = {"type": "ply", "filename": of["file"], "bsdf": bsdf}
    if any(of["radiance"]):
        result["emitter"] = {"type": "area", "radiance": rgb(of["radiance"])}
    return result


def scene(description, integrator, max_depth):
    """The whole scene."""
    camera, (width, height) = description["camera"], description["size"]
    result = {
        "type": "scene",
        # No Russian roulette in media: that of volpathmis loses light. In closed rooms paths do not end without.
        "integrator": {"type": integrator, "max_depth": max_depth, "rr_depth": 5 if integrator == "path" else 2**30},
        "sensor": {
            "type": "perspective",
            "fov": camera["fov"],
            "fov_axis": "y",
            "near_clip": 1e-3,
            "far_clip": 1e4,
            "to_world": mi.ScalarTransform4f().look_at(camera["position"], camera["target"], camera["up"]),
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": "independent"},
        },
    }
    for i, light in enumerate(description["lights"]):
        result[f"light{i}"] = emitter(light)
    for i, volume in enumerate(description["media"]):
        result[f"medium{i}"] = medium(volume)
    for i, of in enumerate(description["surfaces"]):
        result[f"surface{i}"] = surface(of)
    return result


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("--batches", type=int, required=True)
    parser.add_argument("--spp", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--integrator", default="volpath")
    parser.add_argument("--variant", default="scalar_rgb")
    parser.add_argument("--max-depth", type=int, default=-1, help="2: light scatters once; -1: as often as it does")
    arguments = parser.parse_args()
    mi.set_variant(arguments.variant)
    with open(arguments.scene) as file:
        description = json.load(file)
    loaded = mi.load_dict(scene(description, arguments.integrator, arguments.max_depth))

    def batch(seed):
        return np.array(mi.render(loaded, spp=arguments.spp, seed=seed), dtype=np.float64)

    if not arguments.variant.startswith("scalar"):
        batch(2**31 - 1)  # compiles
    mean, squares, seconds, cpu = 0.0, 0.0, 0.0, 0.0
    for n in range(arguments.batches):
        begun, spent = time.perf_counter(), time.process_time()
        image = batch(arguments.seed * arguments.batches + n)
        seconds += time.perf_counter() - begun
        cpu += time.process_time() - spent
        delta = image - mean
        mean = mean + delta / (n + 1)
        squares = squares + delta * (image - mean)
    # The spread of means of spp samples is 1/spp that of single ones.
    variance = squares / (arguments.batches - 1) * arguments.spp
    np.asarray(mean, dtype="<f4").tofile(arguments.out + ".mean.f32")
    np.asarray(variance, dtype="<f4").tofile(arguments.out + ".variance.f32")
    report = {
        "samples": arguments.batches * arguments.spp,
        "seconds": seconds,
        "cpu_seconds": cpu,
        "variant": arguments.variant,
        "version": mi.__version__,
    }
    with open(arguments.out + ".json", "w") as file:
        json.dump(report, file)


if __name__ == "__main__":
    main()
