//! Free flight and transmittance through heterogeneous media, without bias: null-collision tracking.
//!
//! Where extinction is σ_t ≤ m, tentative collisions happen with density m [m⁻¹]; each is real with probability
//! σ_t/m, else "null": the path goes on as if nothing had happened [Woodcock65]. Here m is the sum over the media of
//! their majorants in the present cell.

use glam::DVec3;

use crate::Random;
use crate::march::{March, kept};
use crate::medium::{Local, Medium};

/// All media of a scene.
pub(crate) struct Media {
    pub media: Vec<Medium>,
    /// Which of them are particles or strands.
    pub bodies: Vec<usize>,
    /// Whether any of them scatters, and whether any glows.
    pub scatters: bool,
    pub glows: bool,
}

/// The way of a flight.
#[derive(Clone, Copy)]
struct Ray {
    origin: DVec3,
    direction: DVec3,
    /// Where it ends [m]; may be infinite.
    limit: f64,
}

/// What a path carries from collision to collision.
pub(crate) struct Flight {
    /// What the light collected from here on counts.
    pub weight: DVec3,
    /// What has been collected [W·sr⁻¹·m⁻²].
    pub radiance: DVec3,
    /// Collisions left before the path is given up.
    pub collisions: u32,
    /// The scattering media at the last collision.
    pub scatterers: Vec<Scatterer>,
    march: March,
}

/// A medium that may have been the one that scattered.
pub(crate) struct Scatterer {
    pub sigma_s: DVec3,
    /// Which of the media it is.
    pub medium: usize,
}

/// How a flight ends.
pub(crate) enum End {
    /// Beyond all media, or at its limit.
    Passed,
    /// Absorbed, or given up.
    Lost,
    /// Scattered after this distance [m]. The weight has been divided by density and probability of the event but not
    /// yet multiplied by σ_s, which is among the scatterers.
    Scattered(f64),
}

impl Flight {
    /// Collisions after which a path is given up, so that every path ends. A path of a white half-space has more with
    /// probability 1e-4, in other media it is never seen: what is lost is far below any noise. The same holds for the
    /// null collisions of a shadow ray.
    const MOST_COLLISIONS: u32 = 1 << 26;

    pub fn new() -> Self {
        Self {
            weight: DVec3::ONE,
            radiance: DVec3::ZERO,
            collisions: Self::MOST_COLLISIONS,
            scatterers: Vec::new(),
            march: March::default(),
        }
    }

    /// Below this weight a path survives only with a probability in proportion to its weight.
    const ROULETTE: f64 = 0.1;

    /// Ends a path of little weight at random; the weight of those that survive makes up for the others. False where it
    /// ends.
    #[inline]
    pub fn survives(&mut self, rng: &mut Random) -> bool {
        let most = self.weight.max_element();
        if most >= Self::ROULETTE {
            return true;
        }
        if rng.uniform() * Self::ROULETTE >= most {
            return false;
        }
        self.weight *= Self::ROULETTE / most;
        true
    }
}

impl Media {
    /// Follows a path from `origin` to its next scattering within `limit` [m], collecting emission on the way: spectral tracking, history
    /// aware [Kutz17]. At a tentative collision the weights of the channels decide between scattering and a null
    /// collision; absorption is left to the weights.
    /// With `scattering` false, scattered light counts as lost.
    pub fn fly(
        &self,
        origin: DVec3,
        direction: DVec3,
        limit: f64,
        scattering: bool,
        flight: &mut Flight,
        rng: &mut Random,
    ) -> End {
        let mut march = std::mem::take(&mut flight.march);
        march.start(&self.media, origin, direction, limit);
        let end = self.collide(Ray { origin, direction, limit }, &mut march, scattering, flight, rng);
        flight.march = march;
        end
    }

    fn collide(&self, ray: Ray, march: &mut March, scattering: bool, flight: &mut Flight, rng: &mut Random) -> End {
        let mut depth = rng.exponential();
        // Collisions with bodies come on top, as their density is no constant of a piece.
        let mut body = self.body(ray, 0.0, rng);
        while let Some((mut here, end)) = march.piece() {
            let cells = self.majorant(march);
            loop {
                let reach = cells * (end.min(body) - here);
                if depth >= reach {
                    depth -= reach;
                    if body >= end {
                        break;
                    }
                    here = body;
                    body = self.body(ray, here, rng);
                } else {
                    here += depth / cells;
                    depth = rng.exponential();
                }
                let point = ray.origin + ray.direction * here;
                let majorant = cells + self.body_rate(point);
                // On a body's surface rounding may find nothing.
                if majorant == 0.0 {
                    continue;
                }
                if flight.collisions == 0 {
                    return End::Lost;
                }
                flight.collisions -= 1;

                let (sigma_s, sigma_a) = self.look(march, point, here, majorant, flight);
                let null = (DVec3::splat(majorant) - sigma_s - sigma_a).max(DVec3::ZERO);
                let (real, passed) = (flight.weight.dot(sigma_s), flight.weight.dot(null));
                if scattering && real > 0.0 {
                    // P_s = w·σ_s / (w·σ_s + w·σ_n), sums over channels [Kutz17].
                    if rng.uniform() * (real + passed) < real {
                        flight.weight *= (real + passed) / (majorant * real);
                        return End::Scattered(here);
                    }
                    flight.weight *= null * ((real + passed) / (majorant * passed));
                } else {
                    flight.weight *= null / majorant;
                }
                if !flight.survives(rng) {
                    return End::Lost;
                }
            }
            march.advance(&self.media);
        }
        End::Passed
    }

    /// Upper bound of the extinction of all media on the present piece, of any channel [m⁻¹].
    #[inline]
    fn majorant(&self, march: &March) -> f64 {
        let mut majorant = 0.0;
        for cursor in march.cursors().iter().filter(|cursor| cursor.occupied()) {
            let medium = &self.media[cursor.medium];
            majorant += (medium.steepest * cursor.range[1]).max(medium.least);
        }
        majorant
    }

    /// σ_s and σ_a at a tentative collision [m⁻¹]; emission is collected, and scatterers are listed.
    #[inline]
    fn look(&self, march: &March, point: DVec3, distance: f64, majorant: f64, flight: &mut Flight) -> (DVec3, DVec3) {
        let (mut sigma_s, mut sigma_a, mut emission) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        flight.scatterers.clear();
        let mut add = |medium: usize, local: Local| {
            sigma_s += local.sigma_s;
            sigma_a += local.sigma_a;
            emission += local.emission;
            if local.sigma_s != DVec3::ZERO {
                flight.scatterers.push(Scatterer { sigma_s: local.sigma_s, medium });
            }
        };
        for cursor in march.cursors().iter().filter(|cursor| cursor.occupied()) {
            add(cursor.medium, self.media[cursor.medium].at(cursor.at(distance)));
        }
        for &index in &self.bodies {
            if let Some(unit) = self.media[index].place(point) {
                add(index, self.media[index].at(unit));
            }
        }
        flight.radiance += flight.weight * emission / majorant;
        (sigma_s, sigma_a)
    }

    /// The distance [m] along a ray of the next collision with a body, beyond `from`; infinite where there is none.
    fn body(&self, Ray { origin, direction, limit }: Ray, from: f64, rng: &mut Random) -> f64 {
        self.bodies.iter().fold(f64::INFINITY, |nearest, &index| {
            let medium = &self.media[index];
            let Some([enter, exit]) = kept(&medium.clip, origin, direction) else { return nearest };
            let Some(bodies) = &medium.bodies else { return nearest };
            let range = [from.max(enter), nearest.min(exit).min(limit)];
            nearest.min(bodies.collision(origin, direction, range, medium.rate(), rng))
        })
    }

    /// How many collisions with bodies a ray has at a point [m⁻¹].
    fn body_rate(&self, point: DVec3) -> f64 {
        let of = |&index: &usize| {
            let medium = &self.media[index];
            medium.place(point).map(|unit| medium.rate() * medium.strength(unit))
        };
        self.bodies.iter().filter_map(of).sum()
    }

    /// The optical depth of all bodies over a distance [m].
    fn body_depth(&self, origin: DVec3, direction: DVec3, distance: f64) -> DVec3 {
        let of = |&index: &usize| {
            let medium = &self.media[index];
            let [enter, exit] = kept(&medium.clip, origin, direction)?;
            let depth = medium.bodies.as_ref()?.depth(origin, direction, [enter, exit.min(distance)]);
            Some(medium.extinction * depth)
        };
        self.bodies.iter().filter_map(of).sum()
    }

    /// The media that scatter at a point.
    pub fn scatterers(&self, point: DVec3) -> Vec<Scatterer> {
        let at = |(index, medium): (usize, &Medium)| {
            let sigma_s = medium.at(medium.place(point)?).sigma_s;
            (sigma_s != DVec3::ZERO).then_some(Scatterer { sigma_s, medium: index })
        };
        self.media.iter().enumerate().filter_map(at).collect()
    }

    /// The transmittance over a distance [m] (infinite: to beyond all media): residual ratio tracking [Novak14]. What the
    /// lower bound of a cell takes is known exactly; only what may come on top is left to chance.
    ///
    /// It is deterministic in homogeneous media and those of bodies, and its mean is the transmittance in every other.
    pub fn transmittance(
        &self,
        origin: DVec3,
        direction: DVec3,
        distance: f64,
        march: &mut March,
        rng: &mut Random,
    ) -> DVec3 {
        if self.media.is_empty() {
            return DVec3::ONE;
        }
        march.start(&self.media, origin, direction, distance);
        let mut certain = self.body_depth(origin, direction, distance);
        let mut ratio = DVec3::ONE;
        let mut depth = rng.exponential();
        let mut collisions = Flight::MOST_COLLISIONS;
        while let Some((mut here, end)) = march.piece() {
            let (mut floor, mut majorant) = (DVec3::ZERO, 0.0);
            for cursor in march.cursors().iter().filter(|cursor| cursor.occupied()) {
                let medium = &self.media[cursor.medium];
                floor += medium.extinction * cursor.range[0];
                majorant += medium.steepest * (cursor.range[1] - cursor.range[0]);
            }
            certain += floor * (end - here);
            loop {
                let reach = majorant * (end - here);
                if depth >= reach {
                    depth -= reach;
                    break;
                }
                here += depth / majorant;
                depth = rng.exponential();
                if collisions == 0 {
                    return DVec3::ZERO;
                }
                collisions -= 1;
                let mut residual = DVec3::ZERO;
                for cursor in march.cursors().iter().filter(|cursor| cursor.occupied()) {
                    let medium = &self.media[cursor.medium];
                    let above = medium.strength(cursor.at(here)) - cursor.range[0];
                    residual += medium.extinction * above;
                }
                ratio *= (1.0 - residual / majorant).clamp(DVec3::ZERO, DVec3::ONE);
                // Roulette, as for paths; what is certain counts too.
                let most = (ratio * (-certain).exp()).max_element();
                if most < Flight::ROULETTE {
                    if rng.uniform() * Flight::ROULETTE >= most {
                        return DVec3::ZERO;
                    }
                    ratio *= Flight::ROULETTE / most;
                }
            }
            march.advance(&self.media);
        }
        ratio * (-certain).exp()
    }
}
