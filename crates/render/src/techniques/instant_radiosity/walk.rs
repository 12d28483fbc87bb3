//! The quasi-random walk of particles from the lights, and what each virtual point light is worth.
//!
//! # The energy, in one place
//!
//! N particles start; ⌊ρ̄N⌋ of them survive their first reflection, ⌊ρ̄²N⌋ the second, …, by their numbers and not by chance
//! [Keller97]. A particle carries a flux Φ [W] whose mean over particles is the power of all lights:
//!
//! | | Φ at the start | the light itself as a virtual light |
//! |---|---|---|
//! | area light | π·L_e·A/p | intensity L_e·A/p·cosθ |
//! | point, spot | I(ω)·Ω/p | itself, once, in full |
//! | directional | E·πR²/p | itself, once, in full |
//! | environment | L(ω)/p(ω)·πR²/p | parallel light of irradiance L(ω)/p(ω)/p |
//!
//! with p the light's share of the power, Ω the solid angle that it shines into, R the radius of a sphere around the scene. Where
//! a particle meets a surface whose normals are n_g (of the triangle) and n_s (for shading), a virtual light shines with intensity
//! Φ·f(ω_i, ω)·|ω·n_g|·|ω_i·n_s|/|ω_i·n_g| [Veach97, 5.3]; of a Lambertian surface and flat shading that is Φ·ρ/π·cosθ. The
//! particle goes on in a direction of density p(ω) with Φ·f(ω_i, ω)·|ω·n_g|·|ω_i·n_s|/|ω_i·n_g|/p(ω): Φ·ρ there. Nothing is
//! absorbed by chance: with w = ρ̄ʲN after j reflections, N/⌊w⌋ makes up for the particles that ended, and 1/N for all that
//! started. So the virtual lights of bounce j count 1/⌊ρ̄ʲN⌋ each. Light reflected so often that ⌊ρ̄ʲN⌋ = 0 is left out: less than
//! 1/N of what is emitted times 1/(1 − ρ̄). Between surfaces a flux is multiplied by the transmittance of media on its way.

use std::f64::consts::PI;

use glam::DVec3;
use tyndall_scene::surface::Bsdf;

use super::geometry::{Geometry, Mirror, Point};
use super::sequence::Sequence;
use super::sources::{Sources, around, towards};
use super::vpl::Vpl;
use crate::math::brdf::Brdf;

/// How many particles are left after each reflection: N, ⌊ρ̄N⌋, ⌊ρ̄²N⌋, …, down to the last that is not 0.
pub fn survivors(paths: u32, reflectivity: f64, bounces: u32) -> Vec<u32> {
    let mut w = f64::from(paths);
    let mut counts = vec![paths];
    while counts.len() <= bounces as usize {
        w *= reflectivity;
        if w < 1.0 {
            break;
        }
        counts.push(w as u32);
    }
    counts
}

/// The virtual lights of all paths: those of the light that is emitted, and of all that is reflected up to `bounces` times.
pub fn walk(geometry: &Geometry, sources: &Sources, sequence: &Sequence, counts: &[u32]) -> Vec<Vpl> {
    let mut all = if counts.is_empty() { Vec::new() } else { sources.lamps() };
    // [Keller97]: particles that end after `reflections` bounces.
    let mut end = counts.first().copied().unwrap_or(0);
    for reflections in 0..counts.len() {
        let start = counts.get(reflections + 1).copied().unwrap_or(0);
        for i in start..end {
            all.extend(path(geometry, sources, sequence, i, &counts[..=reflections]));
        }
        end = start;
    }
    all
}

/// The virtual lights of path i, which is reflected as often as `counts` goes on after its first.
pub fn path(geometry: &Geometry, sources: &Sources, sequence: &Sequence, i: u32, counts: &[u32]) -> Vec<Vpl> {
    let mut made = Vec::new();
    let pair = |k: usize| {
        let users = counts[k.min(counts.len() - 1)];
        [2 * k, 2 * k + 1].map(|dimension| sequence.at(i, dimension, users))
    };
    let Some(start) = sources.start(pair(0), pair(1), geometry) else { return made };
    let weighted = |vpl: Vpl, bounce: usize| Vpl {
        power: (vpl.power.as_dvec3() / f64::from(counts[bounce])).as_vec3(),
        bounce: bounce as u32,
        path: i,
        ..vpl
    };
    made.extend(start.vpl.map(|vpl| weighted(vpl, 0)));
    let (mut origin, mut direction, mut flux) = (start.origin, start.direction, start.flux);
    for bounce in 1..counts.len() {
        let Some(point) = geometry.trace(origin, direction) else { break };
        flux *= geometry.media.transmittance(origin, direction, (point.position - origin).length());
        let [normal, shading] = towards(&point, -direction);
        let brdf = geometry.brdf(&point);
        if brdf.kind < 2 && -direction.dot(shading) <= 0.0 {
            break;
        }
        made.extend(reflecting(&point, [normal, shading], -direction, flux, &brdf).map(|vpl| weighted(vpl, bounce)));
        let next = match brdf.kind {
            2 => Some((reflect(direction, normal), brdf.base)),
            3 => Some((through(geometry.bsdf(point.surface), &point, direction, pair(bounce + 1)[0]), DVec3::ONE)),
            _ => scattered(&brdf, [normal, shading], -direction, pair(bounce + 1)),
        };
        let Some((onward, factor)) = next else { break };
        // Through a dielectric the particle leaves on the other side.
        origin = point.position;
        (direction, flux) = (onward, flux * factor);
        if flux == DVec3::ZERO || !flux.is_finite() {
            break;
        }
    }
    made
}

/// The virtual light where a particle of this flux arrives from `incoming`.
fn reflecting(point: &Point, [normal, shading]: [DVec3; 2], incoming: DVec3, flux: DVec3, brdf: &Brdf) -> Option<Vpl> {
    let turned = flux * (incoming.dot(shading) / incoming.dot(normal).max(1e-6));
    match brdf.kind {
        0 => Some(Vpl::cosine(point.position, normal, turned * brdf.base / PI)),
        1 => Some(Vpl::lobe(point.position, [normal, shading], incoming, turned, brdf)),
        _ => None,
    }
    .filter(|vpl| vpl.power != glam::Vec3::ZERO)
}

/// Where a particle goes on, and what becomes of its flux: at a mirror-like coat or a diffuse base, chosen by how much they
/// reflect, with the whole BRDF over the density of both.
fn scattered(brdf: &Brdf, [normal, shading]: [DVec3; 2], incoming: DVec3, u: [f64; 2]) -> Option<(DVec3, DVec3)> {
    let cos = incoming.dot(shading);
    let grazing = (1.0 - cos).clamp(0.0, 1.0).powi(5);
    let [coat, base] = if brdf.kind == 0 {
        [0.0, 1.0]
    } else {
        let color = brdf.base.element_sum() / 3.0;
        let metal = color + (1.0 - color) * grazing;
        let f = 0.04 + 0.96 * grazing;
        [(1.0 - brdf.metallic) * f + brdf.metallic * metal, (1.0 - brdf.metallic) * (1.0 - f) * color]
    };
    let chance = if coat + base > 0.0 { coat / (coat + base) } else { return None };
    let onward = if u[0] < chance {
        // The facet's normal by the distribution D·cos. [Walter07 (35)]
        let x = u[0] / chance;
        let cos_h = ((1.0 - x) / (1.0 + (brdf.alpha * brdf.alpha - 1.0) * x)).max(0.0).sqrt();
        reflect(-incoming, around(shading, cos_h, u[1]))
    } else {
        around(shading, (1.0 - (u[0] - chance) / (1.0 - chance)).max(0.0).sqrt(), u[1])
    };
    let (n_l, g_l) = (onward.dot(shading), onward.dot(normal));
    if n_l <= 0.0 || g_l <= 0.0 {
        return None;
    }
    let h = (onward + incoming).normalize();
    let n_h = shading.dot(h);
    let squared = brdf.alpha * brdf.alpha;
    let d = squared / (PI * (n_h * n_h * (squared - 1.0) + 1.0).powi(2));
    let facets = if chance > 0.0 { chance * d * n_h / (4.0 * incoming.dot(h).max(1e-9)) } else { 0.0 };
    let density = facets + (1.0 - chance) * n_l / PI;
    let turned = incoming.dot(shading) / incoming.dot(normal).max(1e-6);
    let value = brdf.value(shading, onward, incoming) * (g_l * turned / density);
    value.is_finite().then_some((onward, value))
}

/// The direction that a mirror of this normal gives a ray.
pub(super) fn reflect(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

/// The way on at a smooth dielectric: reflected as often as Fresnel's equations say, else refracted.
pub(super) fn through(bsdf: &Bsdf, point: &Point, direction: DVec3, u: f64) -> DVec3 {
    let Bsdf::Dielectric { ior } = bsdf else { return direction };
    let entering = direction.dot(point.normal) < 0.0;
    let (normal, eta) = if entering { (point.normal, 1.0 / f64::from(*ior)) } else { (-point.normal, f64::from(*ior)) };
    let cos = -direction.dot(normal);
    let sin2 = eta * eta * (1.0 - cos * cos);
    if sin2 >= 1.0 {
        return reflect(direction, normal);
    }
    let cos_t = (1.0 - sin2).sqrt();
    let s = (eta * cos - cos_t) / (eta * cos + cos_t);
    let p = (cos - eta * cos_t) / (cos + eta * cos_t);
    if u < (s * s + p * p) / 2.0 {
        return reflect(direction, normal);
    }
    (eta * direction + (eta * cos - cos_t) * normal).normalize()
}

/// Virtual lights as planar mirrors show them, one for each light before each mirror.
pub fn mirrored(vpls: &[Vpl], mirrors: &[Mirror]) -> Vec<Vpl> {
    let mut images = Vec::new();
    for vpl in vpls {
        for &Mirror { normal, distance, surface, reflectance } in mirrors {
            images.push(Vpl {
                mirror: surface,
                power: vpl.power * reflectance.as_vec3(),
                plane: normal.extend(distance).as_vec4(),
                ..*vpl
            });
        }
    }
    images
}

/// In which of `groups`, of about the same size, each path's virtual lights are: each group has paths from all over the sequence.
pub fn groups(paths: u32, groups: u32) -> Vec<u32> {
    ranks(paths).into_iter().map(|rank| (u64::from(rank) * u64::from(groups) / u64::from(paths)) as u32).collect()
}

/// As [`groups`], for representatives, which lie beside each other where their numbers do: of so many in a row each is in another group.
pub fn groups_in_turn(count: u32, groups: u32) -> Vec<u32> {
    let ranks = ranks(groups);
    (0..count).map(|i| ranks[(i % groups) as usize]).collect()
}

/// Numbers in the order of multiples of the golden ratio.
fn ranks(count: u32) -> Vec<u32> {
    let golden = |number: &u32| (f64::from(*number) * 0.618_033_988_749_895).fract();
    let mut order: Vec<u32> = (0..count).collect();
    order.sort_by(|a, b| golden(a).total_cmp(&golden(b)));
    let mut ranks = vec![0; count as usize];
    (0..).zip(order).for_each(|(rank, number)| ranks[number as usize] = rank);
    ranks
}
