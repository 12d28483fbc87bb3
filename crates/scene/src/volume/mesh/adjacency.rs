//! Which tetrahedra share a face.

use super::{NONE, malformed};
use crate::volume::VolumeError;

/// Bytes that a face takes while faces are sorted.
pub(super) const FACE: usize = size_of::<([u32; 3], u32)>();

/// The vertices of the faces of a positively oriented tetrahedron, opposite to each vertex, in order around each as seen
/// from within.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Of each tetrahedron, what lies across the face opposite to each of its vertices.
///
/// Errors: a face of more than two, and two on the same side of one. `cell_of` gives the numbers that messages name.
pub(super) fn neighbours(tetrahedra: &[[u32; 4]], cell_of: &[u32]) -> Result<Vec<[u32; 4]>, VolumeError> {
    let corners = |face: u32| FACES[face as usize % 4].map(|i| tetrahedra[face as usize / 4][i]);
    let mut faces: Vec<_> = (0..4 * tetrahedra.len() as u32)
        .map(|face| {
            let mut sorted = corners(face);
            sorted.sort_unstable();
            (sorted, face)
        })
        .collect();
    faces.sort_unstable();
    let mut neighbours = vec![[NONE; 4]; tetrahedra.len()];
    for shared in faces.chunk_by(|a, b| a.0 == b.0) {
        let cells = || shared.iter().map(|&(_, face)| cell_of[face as usize / 4]);
        match *shared {
            [_] => {}
            [(_, a), (_, b)] => {
                if is_even(corners(a)) == is_even(corners(b)) {
                    let [a, b] = [a, b].map(|face| cell_of[face as usize / 4]);
                    return Err(malformed(format!(
                        "cells {a} and {b} overlap: they lie on the same side of a face that they share"
                    )));
                }
                neighbours[a as usize / 4][a as usize % 4] = b / 4;
                neighbours[b as usize / 4][b as usize % 4] = a / 4;
            }
            _ => {
                let cells = cells().take(3).map(|cell| cell.to_string()).collect::<Vec<_>>().join(", ");
                return Err(malformed(format!("cells {cells} share a face; a face belongs to one cell or two")));
            }
        }
    }
    Ok(neighbours)
}

/// Whether an even permutation sorts three different numbers.
fn is_even([a, b, c]: [u32; 3]) -> bool {
    ((a < b) ^ (b < c)) ^ (a < c)
}
