"""Writes the sparse clouds of `cargo xtask bench volumes` as OpenVDB files.

    python cloud.py OUT.vdb --voxels N [--occupancy SHARE]

Needs OpenVDB's Python module (Debian: python3-openvdb). N x N x N voxels over a box of 1 m around the origin, half floats.
With p the position over [-1, 1]^3, the density is the sum over 40 balls, the n-th with its centre c_n at 0.75 (0.55 for
every second) on a Fibonacci sphere and all of one radius r such that the balls fill the occupancy, of

    (1 - d / r) (0.75 + 0.25 sin(60 x) sin(60 y) sin(60 z)) where d = |p - c_n| < r

The file holds nothing where it is 0. Prints the share of voxels that are not.
"""

import argparse

import numpy as np

try:
    import openvdb
except ImportError:
    import pyopenvdb as openvdb

BALLS = 40
# Voxels along a side of what is in memory at once.
BLOCK = 64


def centres():
    """The balls' centres."""
    for n in range(BALLS):
        height, angle = 1 - (2 * n + 1) / BALLS, n * np.pi * (3 - np.sqrt(5))
        ring = np.sqrt(1 - height * height)
        yield (0.75 if n % 2 else 0.55) * np.array([ring * np.cos(angle), height, ring * np.sin(angle)])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out")
    parser.add_argument("--voxels", type=int, required=True)
    parser.add_argument("--occupancy", type=float, default=0.02)
    arguments = parser.parse_args()
    voxels = arguments.voxels
    radius = (8 * arguments.occupancy / (BALLS * 4 / 3 * np.pi)) ** (1 / 3)
    grid = openvdb.FloatGrid()
    grid.name = "density"
    grid.saveFloatAsHalf = True
    grid.transform = openvdb.createLinearTransform(voxelSize=1 / voxels)
    balls, occupied = list(centres()), 0
    for block in np.ndindex((-(-voxels // BLOCK),) * 3):
        low = np.array(block) * BLOCK
        middle = (low + BLOCK / 2) * 2 / voxels - 1
        near = [c for c in balls if np.linalg.norm(c - middle) < radius + np.sqrt(3) * BLOCK / voxels]
        if not near:
            continue
        axes = [(np.arange(a, min(a + BLOCK, voxels), dtype=np.float32) + 0.5) * 2 / voxels - 1 for a in low]
        x, y, z = np.meshgrid(*axes, indexing="ij", sparse=True)
        distances = (np.sqrt((x - c[0]) ** 2 + (y - c[1]) ** 2 + (z - c[2]) ** 2) for c in near)
        density = sum(np.maximum(1 - distance / radius, 0) for distance in distances)
        density *= 0.75 + 0.25 * np.sin(60 * x) * np.sin(60 * y) * np.sin(60 * z)
        grid.copyFromArray(density.astype(np.float32), ijk=tuple(int(n) - voxels // 2 for n in low))
        occupied += int(np.count_nonzero(density))
    openvdb.write(arguments.out, grids=[grid])
    print(occupied / voxels**3)


if __name__ == "__main__":
    main()
