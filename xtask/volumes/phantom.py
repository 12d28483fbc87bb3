"""Writes the volume of `cargo xtask bench volumes`, a phantom of a head in 8-bit voxels, and its two cases.

    python phantom.py FOLDER [--voxels N] [--size WxH]

FOLDER/phantom.u8 holds N x N x N bytes, x fastest; FOLDER/unshaded.json and FOLDER/shaded.json are what vtk_render.py
reads. With (x, y, z) the position over [-1, 1]^3, y up, r = |(x / 0.78, y / 0.92, z / 0.86)| the radius in an
ellipsoid, and s(e, d) = 1 / (1 + exp(-d / e)) a smooth step of width e, the phantom is, of full scale,

    skin     0.30 s(0.012, 1 - r)
    skull    0.72 (s(0.010, 0.93 - r) - s(0.010, 0.86 - r)) (1 - s(0.02, min(x - 0.05, y - 0.15, z - 0.05)))
    brain    0.10 s(0.010, 0.82 - r) sin(19 x + 3 sin(9 y)) sin(17 y + 3 sin(9 z)) sin(18 z + 3 sin(9 x))
    nodules  0.18 s(0.010, radius - distance) each: 48 balls on a spiral around the middle
    hollows  all times 1 - s(0.010, 0.2 - distance): a sinus and an ear
    neck     all times s(0.012, y + 0.8)

and 0, 1 or 2 of 255 of noise, rounded to the nearest of 0..=255. Two thirds are air. Both 0 and 255 occur, since VTK
stretches its tables over the values that it finds.
"""

import argparse
import json
import os

import numpy as np


def step(width, distance):
    """A smooth step; 1 where the distance is above 0."""
    return 1.0 / (1.0 + np.exp(np.clip(-distance / width, -60.0, 60.0)))


def noise(k, voxels):
    """The noise of one slice, 0, 1 or 2: Wellons' integer hash (lowbias32) of the voxel's index."""
    h = np.arange(k * voxels * voxels, (k + 1) * voxels * voxels, dtype=np.uint32)
    h = (h ^ (h >> 16)) * np.uint32(0x7FEB352D)
    h = (h ^ (h >> 15)) * np.uint32(0x846CA68B)
    return ((h ^ (h >> 16)) % 3).reshape(voxels, voxels)


def ball(x, y, z, centre, radius):
    """1 in a ball, 0 outside."""
    return step(0.010, radius - np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2))


def slice_of(z, axis):
    """The phantom at one z over [-1, 1], of full scale."""
    x, y = axis[None, :], axis[:, None]
    r = np.sqrt((x / 0.78) ** 2 + (y / 0.92) ** 2 + (z / 0.86) ** 2)
    opening = step(0.02, np.minimum(np.minimum(x - 0.05, y - 0.15), z - 0.05))
    value = 0.30 * step(0.012, 1.0 - r)
    value += 0.72 * (step(0.010, 0.93 - r) - step(0.010, 0.86 - r)) * (1.0 - opening)
    folds = np.sin(19 * x + 3 * np.sin(9 * y)) * np.sin(17 * y + 3 * np.sin(9 * z)) * np.sin(18 * z + 3 * np.sin(9 * x))
    value += 0.10 * step(0.010, 0.82 - r) * folds
    for n in range(48):
        height, angle = 1 - (2 * n + 1) / 48, n * np.pi * (3 - np.sqrt(5))
        ring = np.sqrt(1 - height * height)
        centre = 0.58 * np.array([ring * np.cos(angle), height, ring * np.sin(angle)])
        value += 0.18 * ball(x, y, z, centre, 0.05 + 0.01 * (n % 6))
    for centre in [0.0, -0.35, 0.80], [0.74, -0.1, 0.0]:
        value *= 1.0 - ball(x, y, z, centre, 0.2)
    return value * step(0.012, y + 0.8)


def case(voxels, size, shading):
    """The skin a veil, the skull nearly opaque, nodules brighter than the brain."""
    middle = (voxels - 1) / 2
    return {
        "voxels": "phantom.u8",
        "dims": [voxels] * 3,
        "size": size,
        "camera": {
            "position": [middle + 1.35 * voxels, middle + 0.45 * voxels, middle + 1.9 * voxels],
            "target": [middle] * 3,
            "up": [0, 1, 0],
            "fov": 25,
        },
        # value, then opacity over one voxel's edge and colour; linear in between
        "transfer": [
            [0, 0.0, [0.8, 0.5, 0.4]],
            [20, 0.0, [0.8, 0.5, 0.4]],
            [45, 0.012, [0.8, 0.5, 0.4]],
            [70, 0.0, [0.8, 0.3, 0.3]],
            [95, 0.02, [0.85, 0.2, 0.2]],
            [135, 0.12, [0.95, 0.6, 0.2]],
            [170, 0.03, [0.9, 0.8, 0.6]],
            [255, 0.25, [1.0, 0.97, 0.9]],
        ],
        "step": 0.5,
        "shading": shading,
    }


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder")
    parser.add_argument("--voxels", type=int, default=256)
    parser.add_argument("--size", default="1280x720")
    arguments = parser.parse_args()
    axis = np.linspace(-1.0, 1.0, arguments.voxels)
    with open(os.path.join(arguments.folder, "phantom.u8"), "wb") as file:
        for k, z in enumerate(axis):
            levels = 255.0 * slice_of(z, axis) + noise(k, arguments.voxels)
            file.write(np.clip(np.rint(levels), 0, 255).astype(np.uint8).tobytes())
    size = [int(n) for n in arguments.size.split("x")]
    shading = {"direction": [-0.2, -0.5, -0.8], "ambient": 0.2, "diffuse": 0.8, "specular": 0.3, "power": 40}
    for name, of in {"unshaded": None, "shaded": shading}.items():
        with open(os.path.join(arguments.folder, name + ".json"), "w") as file:
            json.dump(case(arguments.voxels, size, of), file, indent=2)


if __name__ == "__main__":
    main()
