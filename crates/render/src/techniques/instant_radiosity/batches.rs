//! The virtual lights in groups, one a camera ray, and the rounds in which they are gathered.

use glam::Vec2;

use super::geometry::Mirror;
use super::sequence::radical_inverse;
use super::vpl::Vpl;
use super::walk;

/// What a camera ray gathers in one round: two texels of `batches`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Batch {
    pub(super) offset: Vec2,
    pub(super) begin: u32,
    pub(super) end: u32,
    pub(super) emission: f32,
    pub(super) ray: u32,
    pub(super) first_map: u32,
}

impl Batch {
    fn texels(&self) -> [[u32; 4]; 2] {
        let Self { offset, begin, end, emission, ray, first_map } = *self;
        [[offset.x.to_bits(), offset.y.to_bits(), begin, end], [emission.to_bits(), ray, first_map, 0]]
    }
}

/// The texels of some batches.
pub(super) fn batch_texels(batches: &[Batch]) -> Vec<[u32; 4]> {
    batches.iter().flat_map(Batch::texels).collect()
}

/// Virtual lights in the groups that camera rays gather, with their images in mirrors; and where each group begins and ends.
/// Lamps, of which there is one each, are shared by all groups.
pub(super) fn grouped(vpls: &[Vpl], groups: &[u32], mirrors: &[Mirror]) -> (Vec<Vpl>, Vec<[u32; 2]>) {
    let count = groups.iter().max().map_or(1, |last| last + 1);
    let mut list: Vec<Vec<Vpl>> = vec![Vec::new(); count as usize];
    for &vpl in vpls {
        if vpl.is_lamp() {
            let share = Vpl { power: vpl.power / count as f32, ..vpl };
            list.iter_mut().for_each(|group| group.push(share));
        } else {
            list[groups[vpl.path as usize] as usize].push(vpl);
        }
    }
    let (mut all, mut ranges) = (Vec::new(), Vec::new());
    for group in list {
        let begin = all.len() as u32;
        let images = walk::mirrored(&group, mirrors);
        all.extend(group);
        all.extend(images);
        ranges.push([begin, all.len() as u32]);
    }
    (all, ranges)
}

/// The place in the pixel where the camera ray of a group goes through: Hammersley's points, one alone in the middle.
pub(super) fn pixel_offset(group: u32, count: u32) -> Vec2 {
    let middle = 0.5 / f64::from(count);
    let y = (radical_inverse(2, group) + middle).fract();
    Vec2::new((f64::from(group) / f64::from(count) + middle) as f32, y as f32)
}

/// The rounds of all groups, of so many virtual lights each.
pub(super) fn batches(groups: &[[u32; 2]], at_once: u32) -> Vec<Batch> {
    let count = groups.len() as u32;
    let mut batches = Vec::new();
    for (number, &[begin, end]) in (0..).zip(groups) {
        let offset = pixel_offset(number, count);
        let mut next = begin;
        loop {
            let stop = end.min(next + at_once);
            let emission = if next == begin { 1.0 / count as f32 } else { 0.0 };
            batches.push(Batch { offset, begin: next, end: stop, emission, ray: number, first_map: 0 });
            next = stop;
            if next >= end {
                break;
            }
        }
    }
    batches
}
