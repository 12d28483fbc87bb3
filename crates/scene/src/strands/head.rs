//! A head of hair: strands that grow out of a sphere, bend down, curl, and gather to clumps.

use std::f32::consts::TAU;

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use super::{Knot, Strands};
use crate::description::Head;
use crate::field::pcg3d;
use crate::particles::{optical_depth, reserve};
use crate::volume::{Budget, VolumeError};

/// How far above the scalp hair lies on it, of the scalp's radius.
const LIFT: f32 = 0.02;

/// How much shorter or longer than the mean a strand is.
const VARIATION: f32 = 0.2;

/// Grows a head of hair.
///
/// # Errors
/// [`VolumeError::TooMany`] beyond the budget; [`VolumeError::Corrupt`] where a point leaves the range of numbers.
pub fn grow(head: &Head, budget: Budget) -> Result<Strands, VolumeError> {
    let points = u64::from(head.segments) + 1;
    let count = points * u64::from(head.number);
    let mut knots: Vec<Knot> = reserve("points of strands", count, Strands::BYTES, budget)?;
    let guides: Vec<_> = (0..head.clumps).map(|n| (root(head, n, 1), guide(head, n, 1))).collect();
    let strands = (0..head.number).into_par_iter().flat_map_iter(|n| {
        let root = root(head, n, 0);
        let clump = guides.iter().min_by(|a, b| a.0.distance_squared(root).total_cmp(&b.0.distance_squared(root)));
        let strand = guide(head, n, 0);
        let curled = curl(head, n, &strand);
        let last = head.segments as f32;
        let clump = clump.map_or(&strand, |(_, guide)| guide);
        // What a clump draws in is the way, not the curl.
        let knots: Vec<_> = (0..strand.len())
            .map(|i| {
                let share = i as f32 / last;
                let drawn = (clump[i] - strand[i]) * (head.clumping * share);
                let mix = |a: f32, b: f32| a + (b - a) * share;
                Knot {
                    position: curled[i] + drawn,
                    radius: mix(head.thickness, head.tip_thickness),
                    color: head.color.lerp(head.tip_color, share).clamp(Vec3::ZERO, Vec3::ONE),
                    depth: optical_depth(head.opacity),
                }
            })
            .collect();
        knots
    });
    knots.par_extend(strands);
    Strands::new(knots, &vec![points as u32; head.number as usize])
}

/// Three numbers from 0 to 1 of a strand; `kind` tells strands from clumps, and what they are for.
fn random(head: &Head, strand: u32, kind: u32) -> Vec3 {
    (pcg3d(UVec3::new(strand, head.seed, kind)) >> 8u32).as_vec3() * (1.0 / 16_777_216.0)
}

/// The direction from the centre of the scalp in which a strand grows: evenly distributed over a cap around the top.
fn root(head: &Head, strand: u32, kind: u32) -> Vec3 {
    let [u, v, _] = random(head, strand, kind).to_array();
    let y = 1.0 - u * (1.0 - head.extent.to_radians().cos());
    let across = (1.0 - y * y).max(0.0).sqrt();
    let (sin, cos) = (TAU * v).sin_cos();
    Vec3::new(across * cos, y, across * sin)
}

/// A strand without its curl: it starts along the normal and is turned down by its curvature, around the scalp.
fn guide(head: &Head, strand: u32, kind: u32) -> Vec<Vec3> {
    let normal = root(head, strand, kind);
    let length = head.length * (1.0 + VARIATION * (2.0 * random(head, strand, kind + 2).x - 1.0));
    let step = length / head.segments as f32;
    // The parting: hair falls to the side on which it grows, and at the very top does not stand up.
    let aside = Vec3::new(normal.x.signum() * 0.3, 0.0, 0.0);
    let (mut position, mut direction) = (head.center + head.radius * normal, (normal + aside).normalize());
    let mut points = vec![position];
    let lowest = head.radius * (1.0 + LIFT);
    for _ in 0..head.segments {
        position += direction * step;
        let offset = position - head.center;
        let height = offset.length();
        if height < lowest && height > 0.0 {
            position = head.center + offset * (lowest / height);
        }
        direction = (direction + Vec3::NEG_Y * (head.gravity * step)).try_normalize().unwrap_or(direction);
        points.push(position);
    }
    points
}

/// The strand wound around its own way, ever wider from the root on.
fn curl(head: &Head, strand: u32, way: &[Vec3]) -> Vec<Vec3> {
    if head.curl == 0.0 {
        return way.to_vec();
    }
    let phase = random(head, strand, 4).x * TAU;
    let mut across = Vec3::ZERO;
    let mut turn = 0.0;
    let place = |(i, &point): (usize, &Vec3)| {
        let (before, after) = (way[i.saturating_sub(1)], way[(i + 1).min(way.len() - 1)]);
        let along = (after - before).try_normalize().unwrap_or(Vec3::Y);
        // What was across goes on along the strand, without a turn of its own.
        across = (across - along * across.dot(along)).try_normalize().unwrap_or_else(|| along.any_orthonormal_vector());
        turn += if i > 0 { point.distance(before) / head.pitch } else { 0.0 };
        let (sin, cos) = (phase + TAU * turn).sin_cos();
        let share = i as f32 / (way.len() - 1) as f32;
        point + (across * cos + along.cross(across) * sin) * (head.curl * share)
    };
    way.iter().enumerate().map(place).collect()
}
