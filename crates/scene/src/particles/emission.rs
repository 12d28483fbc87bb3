//! A source of particles: born one after the other, carried by a mean flow and turbulence, growing and fading with age.

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use super::{Particle, Particles, optical_depth, reserve};
use crate::description::Emitter;
use crate::field::{Curl, pcg3d};
use crate::volume::{Budget, VolumeError};

/// The share of its life in which a particle appears.
const APPEARING: f32 = 0.05;

/// How much of the mean velocity eddies move with. Particles pass through them, and no two take the same way.
const DRIFT: f32 = 0.5;

/// An emitter that remembers where its particles are. Pictures in the order of time take a step or so each; the particles at
/// a time are the same, whatever times were asked for before.
#[derive(Clone, Debug)]
pub struct Emission {
    emitter: Emitter,
    /// When the last picture was taken [s].
    time: f64,
    /// The number of the first of `flights`.
    first: u64,
    flights: Vec<Flight>,
}

/// A particle under way.
#[derive(Clone, Copy, Debug)]
struct Flight {
    position: Vec3,
    /// Whole steps since its birth.
    steps: u32,
}

impl Emission {
    /// An emitter before its first picture.
    ///
    /// # Errors
    /// [`VolumeError::TooMany`] where the particles would not fit into the budget.
    pub fn new(emitter: &Emitter, budget: Budget) -> Result<Self, VolumeError> {
        let bytes = Particles::BYTES + size_of::<Flight>() as u64;
        let flights = reserve("particles", u64::from(emitter.number) + 1, bytes, budget)?;
        Ok(Self { emitter: emitter.clone(), time: 0.0, first: 0, flights })
    }

    /// The particles in the emitter's space at a time since the birth of the first, 0 or more [s].
    ///
    /// # Errors
    /// [`VolumeError::Corrupt`] where a particle leaves the range of numbers.
    pub fn at(&mut self, time: f64) -> Result<Particles, VolumeError> {
        let Emitter { lifetime, number, .. } = self.emitter;
        let interval = f64::from(lifetime) / f64::from(number);
        // Born at n·interval; of the last that was born at time 0 there is one.
        let end = (time / interval).floor() as u64 + 1;
        let begin = end.saturating_sub(number.into());
        let keep = begin.saturating_sub(self.first).min(self.flights.len() as u64) as usize;
        if time < self.time {
            self.flights.clear();
        } else {
            self.flights.drain(..keep);
        }
        (self.time, self.first) = (time, begin);
        let (source, known) = (&self.emitter, self.flights.len() as u64);
        self.flights.extend((begin + known..end).map(|n| Flight { position: born(source, n), steps: 0 }));
        let curl = Curl { octaves: source.octaves, seed: source.seed };
        let of = |(i, flight): (usize, &mut Flight)| {
            let birth = (begin + i as u64) as f64 * interval;
            flight.particle(source, &curl, birth, time)
        };
        Particles::new(self.flights.par_iter_mut().enumerate().map(of).collect())
    }
}

/// Where a particle is born, in the ball of the emitter.
fn born(emitter: &Emitter, number: u64) -> Vec3 {
    let random = |k| (pcg3d(UVec3::new(number as u32, emitter.seed, k)) >> 8u32).as_vec3() * (1.0 / 16_777_216.0);
    // By rejection; of 32 points in a cube one at least is in its ball.
    let inside = (0..32).map(|k| 2.0 * random(k) - 1.0).find(|point| point.length_squared() <= 1.0);
    emitter.position + emitter.size * inside.unwrap_or_default()
}

impl Flight {
    /// Moves on to `time` and gives the particle there. Whole steps are kept, so that it does not matter how time went by.
    fn particle(&mut self, emitter: &Emitter, curl: &Curl, birth: f64, time: f64) -> Particle {
        let age = (time - birth).max(0.0);
        let step = 1.0 / f64::from(emitter.frame_rate);
        let whole = (age / step) as u32;
        while self.steps < whole {
            let now = birth + f64::from(self.steps) * step;
            self.position = moved(emitter, curl, self.position, now, step as f32);
            self.steps += 1;
        }
        let now = birth + f64::from(whole) * step;
        let position = moved(emitter, curl, self.position, now, (time - now) as f32);
        let share = (age / f64::from(emitter.lifetime)).clamp(0.0, 1.0) as f32;
        let t = (share / APPEARING).min(1.0);
        let opacity = emitter.opacity + (emitter.end_opacity - emitter.opacity) * share;
        Particle {
            position,
            radius: emitter.radius + (emitter.end_radius - emitter.radius) * share,
            color: emitter.color.lerp(emitter.end_color, share).clamp(Vec3::ZERO, Vec3::ONE),
            depth: optical_depth(opacity * t * t * (3.0 - 2.0 * t)),
        }
    }
}

/// A step by the midpoint rule, whose error is of third order.
fn moved(emitter: &Emitter, curl: &Curl, from: Vec3, time: f64, step: f32) -> Vec3 {
    let velocity = |x: Vec3, time: f64| {
        let eddies = x - emitter.velocity * (DRIFT * time as f32);
        emitter.velocity + emitter.turbulence * curl.value(eddies / emitter.scale)
    };
    let middle = from + velocity(from, time) * (0.5 * step);
    from + velocity(middle, time + 0.5 * f64::from(step)) * step
}
