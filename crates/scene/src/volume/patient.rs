//! Where a patient is: the space that medical files share. Ours has x to the right, y to the front (anterior), z up
//! (superior), in metres; most files have millimetres, and many have x to the left and y to the back.

use glam::DVec3;

/// From left-posterior-superior, the space of DICOM and of ITK.
pub(super) const RAS_FROM_LPS: DVec3 = DVec3::new(-1.0, -1.0, 1.0);

/// A millimetre \[m\].
pub(super) const MILLIMETRE: f64 = 1e-3;
