//! Mistakes in media.

use super::check;
use crate::{BOX, CAMERA};

#[test]
fn densities() {
    check(
        &format!("{CAMERA}[media.a]\noptics.coefficients = {{}}\n"),
        &[
            ("", "4:1: media.a: found no `density`; accepted: a table with `density`, which has no default"),
            (
                "density = 3",
                "6:11: media.a.density: found 3; accepted: one of `homogeneous`, `exponential`, `sphere`, `noise`, `expression`, `grid`, `mesh`, `particles`, `emitter`, `strands`, `head`",
            ),
            (
                "density.cube = {}",
                "6:9: media.a.density: found `cube`; accepted: one of `homogeneous`, `exponential`, `sphere`, `noise`, `expression`, `grid`, `mesh`, `particles`, `emitter`, `strands`, `head`",
            ),
            (
                "density.homogeneous = { min = [0, 0, 0], max = [1, 1, 0] }",
                "6:48: media.a.density.homogeneous.max: found [1.0, 1.0, 0.0] with min = [0.0, 0.0, 0.0]; accepted: a corner above `min` on every axis",
            ),
            (
                "density.homogeneous = { min = [0, 0, 0], max = [1, 1, 1], mx = 3 }",
                "6:59: media.a.density.homogeneous.mx: found unknown field `mx`; accepted: one of `min`, `max`",
            ),
            (
                "density.homogeneous.min = [0, 0, 0]",
                "6:9: media.a.density.homogeneous: found no `max`; accepted: a table with `max`, which has no default",
            ),
            (
                "density.exponential = { min = [0, 0, 0], max = [1, 1, 1], scale_height = 0 }",
                "6:74: media.a.density.exponential.scale_height: found 0; accepted: a finite number > 0",
            ),
            (
                "density.exponential = { min = [0, 0, 0], max = [-1, 1, 1], scale_height = 1 }",
                "6:48: media.a.density.exponential.max: found [-1.0, 1.0, 1.0] with min = [0.0, 0.0, 0.0]; accepted: a corner above `min` on every axis",
            ),
            (
                "density.exponential = { min = [0, 0, 0], max = [1, 1, 1], scale_height = 1, base = 100 }",
                "6:84: media.a.density.exponential.base: found 100.0, so that the density overflows at the box's bottom, y = 0.0; accepted: a base at most 88 scale heights above it",
            ),
            (
                "density.exponential = { min = [0, 0, 0], max = [1, 1e30, 1], scale_height = 1e-30 }",
                "6:77: media.a.density.exponential.scale_height: found 1e-30 for a box from y = 0.0 to 1e30; accepted: a height comparable to the box's",
            ),
            ("density.grid.file = 3", "6:21: media.a.density.grid.file: found 3; accepted: text in quotes"),
            (
                "density.grid = {}",
                "6:16: media.a.density.grid: found no `file`; accepted: a table with `file`, which has no default",
            ),
            (
                "density.grid = { file = \"a.vdb\", name = 3 }",
                "6:41: media.a.density.grid.name: found 3; accepted: text in quotes",
            ),
            (
                "density.grid = { file = \"a.nii\", name = \"density\" }",
                "6:41: media.a.density.grid.name: found \"density\"; accepted: no name with a NIfTI file, which holds one volume",
            ),
            (
                "density.grid = { file = \"a.raw\" }",
                "6:16: media.a.density.grid: found no `raw` with file = \"a.raw\"; accepted: `raw` with a file that has no header: its dims, type and spacing",
            ),
            (
                "density.grid = { file = \"a.npy\", raw = { dims = [1, 1, 1], type = \"u8\", spacing = 1 } }",
                "6:40: media.a.density.grid.raw: found `raw` with file = \"a.npy\"; accepted: `raw` only with a file that has no header: .raw, .bin or .dat",
            ),
            (
                "density.grid = { file = \"a.raw\", raw = { dims = [1, 1], type = \"u8\", spacing = 1 } }",
                "6:49: media.a.density.grid.raw.dims: found [1, 1]; accepted: [x, y, z] in voxels, each a whole number from 1 to 4294967295",
            ),
            (
                "density.grid = { file = \"a.raw\", raw = { dims = [1, 0, 1], type = \"u8\", spacing = 1 } }",
                "6:49: media.a.density.grid.raw.dims: found [1, 0, 1]; accepted: [x, y, z] in voxels, each a whole number from 1 to 4294967295",
            ),
            (
                "density.grid = { file = \"a.raw\", raw = { dims = [1, 1, 1], type = \"u7\", spacing = 1 } }",
                "6:67: media.a.density.grid.raw.type: found `u7`; accepted: one of `u8`, `i8`, `u16`, `i16`, `u32`, `i32`, `u64`, `i64`, `f16`, `f32`, `f64`",
            ),
            (
                "density.grid = { file = \"a.raw\", raw = { dims = [1, 1, 1], type = \"u8\", spacing = 0 } }",
                "6:83: media.a.density.grid.raw.spacing: found 0; accepted: a number > 0, or three of them [x, y, z]",
            ),
            (
                "density.grid = { file = \"a.raw\", raw = { dims = [1, 1, 1], type = \"u8\", spacing = 1, offset = -1 } }",
                "6:95: media.a.density.grid.raw.offset: found -1; accepted: a whole number of bytes",
            ),
            (
                "density.grid = { file = \"a.raw\", raw = { dims = [1, 1, 1], type = \"u8\", spacing = 1, big_endian = 1 } }",
                "6:99: media.a.density.grid.raw.big_endian: found 1; accepted: a boolean",
            ),
        ],
    );
}

#[test]
fn optics() {
    check(
        &format!("{CAMERA}{BOX}"),
        &[
            ("", "4:1: media.a: found no `optics`; accepted: a table with `optics`, which has no default"),
            (
                "optics = \"coefficients\"",
                "6:10: media.a.optics: found \"coefficients\"; accepted: a table `coefficients` with `sigma_s`, `sigma_a`, `emission`, `phase`",
            ),
            (
                "optics.coefficients.sigma_s = -1",
                "6:31: media.a.optics.coefficients.sigma_s: found -1; accepted: a number >= 0, or three of them [r, g, b]",
            ),
            (
                "optics.coefficients.sigma = 1",
                "6:21: media.a.optics.coefficients.sigma: found unknown field `sigma`; accepted: one of `sigma_s`, `sigma_a`, `emission`, `phase`",
            ),
            (
                "optics.coefficients.phase = 3",
                "6:29: media.a.optics.coefficients.phase: found 3; accepted: one of `isotropic`, `rayleigh`, `hg`, `cornette_shanks`, `draine`, `droplets`, `tabulated`, `mie`",
            ),
            (
                "optics.coefficients.phase = \"fog\"",
                "6:29: media.a.optics.coefficients.phase: found `fog`; accepted: one of `isotropic`, `rayleigh`, `hg`, `cornette_shanks`, `draine`, `droplets`, `tabulated`, `mie`",
            ),
            (
                "optics.coefficients.phase = \"hg\"",
                "6:29: media.a.optics.coefficients.phase: found \"hg\"; accepted: a table `hg` with `g`",
            ),
            (
                "optics.coefficients.phase.hg.g = 1",
                "6:34: media.a.optics.coefficients.phase.hg.g: found 1; accepted: a number between -0.999 and 0.999",
            ),
            (
                "optics.coefficients.phase.hg = {}",
                "6:32: media.a.optics.coefficients.phase.hg: found no `g`; accepted: a table with `g`, which has no default",
            ),
            (
                "optics.coefficients.phase.hg = { h = 3, g = 0 }",
                "6:34: media.a.optics.coefficients.phase.hg.h: found unknown field `h`; accepted: `g`",
            ),
            (
                "optics.coefficients.phase.isotropic = {}",
                "6:39: media.a.optics.coefficients.phase.isotropic: found {}; accepted: the word \"isotropic\" in place of the table",
            ),
            (
                "optics.coefficients = {}\ntransform = { scale = 0 }",
                "7:23: media.a.transform.scale: found 0; accepted: a number > 0, or three of them [x, y, z]",
            ),
            (
                "optics.coefficients = {}\ntransform.scale = [1, 2]",
                "7:19: media.a.transform.scale: found [1, 2]; accepted: a number > 0, or three of them [x, y, z]",
            ),
            (
                "optics.coefficients = {}\ntransform.rotate = 90",
                "7:20: media.a.transform.rotate: found 90; accepted: three finite numbers [x, y, z]",
            ),
            (
                "optics.coefficients = {}\ntransform.sale = 1",
                "7:11: media.a.transform.sale: found unknown field `sale`; accepted: one of `scale`, `rotate`, `translate`",
            ),
            (
                "optics.coefficients = {}\nphase = \"isotropic\"",
                "7:1: media.a.phase: found unknown field `phase`; accepted: one of `density`, `optics`, `transform`, `clip`, `temperature`, `color`",
            ),
        ],
    );
}

#[test]
fn phase_functions() {
    check(
        &format!("{CAMERA}{BOX}[media.a.optics.coefficients.phase]\n"),
        &[
            (
                "cornette_shanks = { g = 1 }",
                "7:25: media.a.optics.coefficients.phase.cornette_shanks.g: found 1; accepted: a number between -0.999 and 0.999",
            ),
            (
                "draine = { g = 0 }",
                "7:10: media.a.optics.coefficients.phase.draine: found no `alpha`; accepted: a table with `alpha`, which has no default",
            ),
            (
                "draine = { g = 0, alpha = -1 }",
                "7:27: media.a.optics.coefficients.phase.draine.alpha: found -1; accepted: a number from 0 to 1000",
            ),
            (
                "droplets = { diameter = 0 }",
                "7:25: media.a.optics.coefficients.phase.droplets.diameter: found 0; accepted: a diameter in micrometres > 0 and at most 50",
            ),
            (
                "droplets = { diameter = 60 }",
                "7:25: media.a.optics.coefficients.phase.droplets.diameter: found 60; accepted: a diameter in micrometres > 0 and at most 50",
            ),
            (
                "tabulated = { angles = [0], values = [1] }",
                "7:24: media.a.optics.coefficients.phase.tabulated.angles: found 1 of them; accepted: at least two angles",
            ),
            (
                "tabulated = { angles = [0, 90], values = [1] }",
                "7:42: media.a.optics.coefficients.phase.tabulated.values: found 1 of them for 2 angles; accepted: a value for each angle",
            ),
            (
                "tabulated = { angles = [0, 90, 90], values = [1, 1, 1] }",
                "7:32: media.a.optics.coefficients.phase.tabulated.angles.2: found 90 after 90; accepted: angles in ascending order",
            ),
            (
                "tabulated = { angles = [0, 190], values = [1, 1] }",
                "7:28: media.a.optics.coefficients.phase.tabulated.angles.1: found 190; accepted: an angle from 0 to 180 degrees",
            ),
            (
                "tabulated = { angles = [0, 180], values = [1, [1, 2]] }",
                "7:47: media.a.optics.coefficients.phase.tabulated.values.1: found [1, 2]; accepted: a number >= 0, or three of them [r, g, b]",
            ),
            (
                "tabulated = { angles = [0, 180], values = [1, -1] }",
                "7:47: media.a.optics.coefficients.phase.tabulated.values.1: found -1; accepted: a number >= 0, or three of them [r, g, b]",
            ),
            (
                "mie = { radius = 1 }",
                "7:7: media.a.optics.coefficients.phase.mie: found no `refractive_index`; accepted: a table with `refractive_index`, which has no default",
            ),
            (
                "mie = { refractive_index = [1.33], radius = 1 }",
                "7:28: media.a.optics.coefficients.phase.mie.refractive_index: found [1.33]; accepted: [n, k] with 0 < n <= 20 and 0 <= k <= 20",
            ),
            (
                "mie = { refractive_index = [1.33, 0, 0], radius = 1 }",
                "7:28: media.a.optics.coefficients.phase.mie.refractive_index: found [1.33, 0, 0]; accepted: [n, k] with 0 < n <= 20 and 0 <= k <= 20",
            ),
            (
                "mie = { refractive_index = 1.33, radius = 1 }",
                "7:28: media.a.optics.coefficients.phase.mie.refractive_index: found 1.33; accepted: [n, k] with 0 < n <= 20 and 0 <= k <= 20",
            ),
            (
                "mie = { refractive_index = [1.33, -1], radius = 1 }",
                "7:28: media.a.optics.coefficients.phase.mie.refractive_index: found [1.33, -1]; accepted: [n, k] with 0 < n <= 20 and 0 <= k <= 20",
            ),
            (
                "mie = { refractive_index = [1, 0], radius = 1 }",
                "7:28: media.a.optics.coefficients.phase.mie.refractive_index: found [1, 0]; accepted: an index other than that of the medium around, which does not scatter",
            ),
            (
                "mie = { refractive_index = [0, 1], radius = 1 }",
                "7:28: media.a.optics.coefficients.phase.mie.refractive_index: found [0, 1]; accepted: [n, k] with 0 < n <= 20 and 0 <= k <= 20",
            ),
            (
                "mie = { refractive_index = [1.33, 0], radius = 0 }",
                "7:48: media.a.optics.coefficients.phase.mie.radius: found 0; accepted: a radius from 0.001 to 1000 micrometres",
            ),
            (
                "mie = { refractive_index = [1.33, 0], radius = 1, spread = 0.5 }",
                "7:60: media.a.optics.coefficients.phase.mie.spread: found 0.5; accepted: a number from 1 to 4",
            ),
            (
                "mie = { refractive_index = [1.33, 0], radius = 30, spread = 1.5 }",
                "7:48: media.a.optics.coefficients.phase.mie.radius: found 30 µm with spread = 1.5: spheres up to 172.2814 µm, whose size parameter 2πr/λ is 2460 at 440 nm; accepted: size parameters up to 1000; for larger ones `droplets`",
            ),
            (
                "mie = { refractive_index = [1.33, 0], radius = 1, wavelengths = [0.7, 0.6, 0.5] }",
                "7:65: media.a.optics.coefficients.phase.mie.wavelengths: found [0.7, 0.6, 0.5]; accepted: three wavelengths [r, g, b] from 100 to 20000 nanometres",
            ),
        ],
    );
}

#[test]
fn transfer_functions() {
    check(
        &format!("{CAMERA}{BOX}[media.a.optics.transfer]\nunit_length = 1\n"),
        &[
            (
                "",
                "6:1: media.a.optics.transfer.stops: found none; accepted: at least one stop, a `window`, or `isosurfaces`",
            ),
            (
                "stops = []",
                "8:9: media.a.optics.transfer.stops: found none; accepted: at least one stop, a `window`, or `isosurfaces`",
            ),
            ("stops = 3", "8:9: media.a.optics.transfer.stops: found 3; accepted: a list [...]"),
            (
                "stops = [3]",
                "8:10: media.a.optics.transfer.stops.0: found 3; accepted: a table with `value`, `opacity`, `color`",
            ),
            (
                "stops = [{ value = 1, opacity = 1, color = 1 }, { value = 1, opacity = 1, color = 1 }]",
                "8:59: media.a.optics.transfer.stops.1.value: found 1 after 1; accepted: values in ascending order",
            ),
            (
                "stops = [{ value = 1, opacity = 2, color = 1 }]",
                "8:33: media.a.optics.transfer.stops.0.opacity: found 2; accepted: a number from 0 to 1",
            ),
            (
                "stops = [{ value = 1, opacity = 1 }]",
                "8:10: media.a.optics.transfer.stops.0: found no `color`; accepted: a table with `color`, or a `map` for all stops",
            ),
            (
                "stops = [{ value = 1, opacity = 1, color = 1, colour = 1 }]",
                "8:47: media.a.optics.transfer.stops.0.colour: found unknown field `colour`; accepted: one of `value`, `opacity`, `color`",
            ),
            (
                "radiance = 0\nstops = [{ value = 1, opacity = 1, color = 1 }]",
                "8:12: media.a.optics.transfer.radiance: found 0; accepted: a finite number > 0",
            ),
        ],
    );
}

#[test]
fn densities_that_are_functions() {
    check(
        &format!("{CAMERA}[media.a]\noptics.coefficients = {{}}\n"),
        &[
            (
                "density.sphere = { center = [0, 0, 0], radius = 0 }",
                "6:49: media.a.density.sphere.radius: found 0; accepted: a finite number > 0",
            ),
            (
                "density.sphere = { center = [0, 0, 0], radius = 1, falloff = 1.5 }",
                "6:62: media.a.density.sphere.falloff: found 1.5 with radius = 1.0; accepted: a length of at most the radius",
            ),
            (
                "density.sphere.radius = 1",
                "6:9: media.a.density.sphere: found no `center`; accepted: a table with `center`, which has no default",
            ),
            (
                "density.noise = { min = [0, 0, 0], max = [1, 0, 1], scale = 1 }",
                "6:42: media.a.density.noise.max: found [1.0, 0.0, 1.0] with min = [0.0, 0.0, 0.0]; accepted: a corner above `min` on every axis",
            ),
            (
                "density.noise = { min = [0, 0, 0], max = [1, 1, 1], scale = 1, octaves = 13 }",
                "6:74: media.a.density.noise.octaves: found 13; accepted: a whole number from 1 to 12",
            ),
            (
                "density.noise = { min = [0, 0, 0], max = [1, 1, 1], scale = 1, octaves = 2.5 }",
                "6:74: media.a.density.noise.octaves: found 2.5; accepted: a whole number from 1 to 12",
            ),
            (
                "density.noise = { min = [0, 0, 0], max = [1, 1, 1], scale = 1, gain = 1.5 }",
                "6:71: media.a.density.noise.gain: found 1.5; accepted: a number from 0 to 1",
            ),
            (
                "density.noise = { min = [0, 0, 0], max = [1, 1, 1], scale = 1, lacunarity = 0.5 }",
                "6:77: media.a.density.noise.lacunarity: found 0.5; accepted: a number from 1 to 8",
            ),
            (
                "density.noise = { min = [0, 0, 0], max = [1, 1, 1], scale = 1, seed = -1 }",
                "6:71: media.a.density.noise.seed: found -1; accepted: a whole number from 0 to 4294967295",
            ),
            (
                "density.noise = { min = [0, 0, -1000], max = [1, 1, 1], scale = 0.01, octaves = 12 }",
                "6:65: media.a.density.noise.scale: found 0.01, whose finest octave is 4.8828124e-6 m, in a box up to 1000.0 m; accepted: a scale whose finest octave is at least a 2^20th of that",
            ),
            (
                "density.expression = { min = [0, 0, 0], max = [1, 1, 1] }",
                "6:22: media.a.density.expression: found no `wgsl`; accepted: a table with `wgsl`, which has no default",
            ),
            (
                "density.expression = { min = [0, 0, 0], max = [0, 1, 1], wgsl = \"1.0\" }",
                "6:47: media.a.density.expression.max: found [0.0, 1.0, 1.0] with min = [0.0, 0.0, 0.0]; accepted: a corner above `min` on every axis",
            ),
            (
                "density.expression = { min = [0, 0, 0], max = [1, 1, 1], wgsl = \"1.0\", highest = 0 }",
                "6:82: media.a.density.expression.highest: found 0; accepted: a finite number > 0",
            ),
            (
                "density.expression = { min = [0, 0, 0], max = [1, 1, 1], wgsl = \"\"\"\np.x\n* q.x\"\"\" }",
                "6:65: media.a.density.expression.wgsl: found an error at line 2, column 3 of the expression: no definition in scope for identifier: `q`; accepted: one WGSL expression of type f32 of p: vec3f [m], of f32, bool and vectors of them, WGSL's functions of these, noise(p) and fbm(p, octaves)",
            ),
        ],
    );
}
