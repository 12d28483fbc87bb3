//! Particles and strands in scene files.

use tyndall_scene::assets::Embedded;
use tyndall_scene::description::Density;
use tyndall_scene::glam::Vec3;
use tyndall_scene::particles::{Emission, optical_depth};
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, Field, World};

use crate::{CAMERA, SCENES};

const BUDGET: Budget = Budget(64 << 20);

const SMOKE: &[u8] = b"x,y,z,radius,opacity\n0,0,0,0.5,0.5\n2,0,0,0.25,1\n";

fn load(medium: &str) -> Result<World, String> {
    let document = Document::new("s.toml", format!("{CAMERA}[media.a]\n{medium}\n"));
    let scene = document.parse().map_err(|error| error.to_string())?;
    let assets = Embedded(vec![("smoke.csv", SMOKE), ("braid.txt", b"0 0 0 0.1 0.5\n1 0 0 0.1 0.5")]);
    World::load(scene, &assets, BUDGET).map_err(|error| error.locate(&document).to_string())
}

const GREY: &str = "optics.coefficients = { sigma_s = 0.75, sigma_a = 0.25 }\n";

/// A ball of radius 1 m about (0, 3, 1) in the world, and what it does to light at its centre: 15/16 ln 2 m⁻¹.
#[test]
fn a_transform_moves_bodies_and_keeps_opacities() {
    let transform = "transform = { scale = 2, rotate = [0, 0, 90], translate = [0, 3, 1] }\n";
    let world = load(&format!("density.particles.file = \"smoke.csv\"\n{GREY}{transform}")).unwrap();
    let Field::Particles(particles) = &world.volumes[0].field else { panic!() };
    let [first, second] = particles.list() else { panic!() };
    assert!(first.position.abs_diff_eq(Vec3::new(0.0, 3.0, 1.0), 1e-6));
    assert!(second.position.abs_diff_eq(Vec3::new(0.0, 7.0, 1.0), 1e-5));
    assert_eq!((first.radius, second.radius, second.depth), (1.0, 0.5, 10.0));
    let here = world.volumes[0].coefficients(first.position).unwrap();
    let density = 15.0 / 16.0 * optical_depth(0.5);
    assert!((here.sigma_t() - density).abs().max_element() < 1e-5 && (here.sigma_a - 0.25 * density).x.abs() < 1e-5);
    // The field over the unit cube is the same, and nothing sticks out of it.
    let unit = world.volumes[0].unit_from_world.transform_point3(first.position);
    assert!((world.volumes[0].field.value(unit) - density).abs() < 1e-5);
    let corner = world.volumes[0].unit_from_world.transform_point3(Vec3::new(-1.0, 7.5, 2.0));
    assert!(corner.cmpge(Vec3::ZERO).all() && corner.cmple(Vec3::ONE).all());

    let world = load(&format!("density.strands = {{ file = \"braid.txt\", radius = 0.2 }}\n{GREY}")).unwrap();
    let here = world.volumes[0].coefficients(Vec3::new(0.5, 0.15, 0.0)).unwrap();
    assert!((here.sigma_t().x - optical_depth(0.5) / 0.4).abs() < 1e-5);
}

#[test]
fn refusals_know_their_line() {
    let of = |medium: &str| load(medium).unwrap_err();
    let particles = format!("density.particles.file = \"smoke.csv\"\n{GREY}");
    assert_eq!(
        of(&format!("{particles}transform.scale = [1, 2, 1]")),
        "s.toml:7:19: media.a.transform.scale: found [1.0, 2.0, 1.0] with density.particles; accepted: the same factor on every axis"
    );
    let far = of(&format!("{particles}transform.scale = 1e9"));
    assert!(far.contains("media.a.transform: found the radius of particle 0 is 500000000.0"), "{far}");
    assert!(
        of(&format!("{particles}color = {{ file = \"c.vdb\", names = [\"r\", \"g\", \"b\"] }}"))
            .contains("media.a.color: found it with density.particles")
    );
    let transfer = "optics.transfer = { unit_length = 1, stops = [{ value = 0, opacity = 0.5, color = [1, 1, 1] }] }";
    assert!(of(&format!("density.emitter = {{}}\n{transfer}")).contains("accepted: optics.coefficients"));
    assert!(
        of(&format!("density.particles.file = \"none.ply\"\n{GREY}"))
            .contains("5:26: media.a.density.particles.file: cannot read \"none.ply\"")
    );
    assert_eq!(
        of(&format!("density.emitter = {{ number = 2, time = 0.1, velocity = [1e20, 0, 0] }}\n{GREY}"))
            .split_once(": found the position")
            .map(|(at, said)| (at.to_owned(), said.split_once("; ").unwrap_or_default().1.to_owned())),
        Some(("s.toml:5:19: media.a.density.emitter".into(), "accepted: at most 1e9 m from the origin".into()))
    );
    assert!(of(&format!("density.strands.file = \"smoke.csv\"\n{GREY}")).contains("accepted: .hair, .txt"));
    assert!(
        of(&format!("density.particles = {{ file = \"smoke.csv\", opacity = 2 }}\n{GREY}"))
            .contains("a number from 0 to 1")
    );
    assert!(
        of(&format!("density.particles = {{ file = \"smoke.csv\", radius = -1 }}\n{GREY}"))
            .contains("a radius from 1e-7")
    );
    assert!(
        of(&format!("density.emitter = {{ number = 10000000 }}\n{GREY}"))
            .contains("media.a.density.emitter.number: found 10000001 particles need")
    );
    assert!(
        of(&format!("density.emitter = {{ frame_rate = 1e9 }}\n{GREY}")).contains("at most 10000 steps in a lifetime")
    );
    assert!(of(&format!("density.emitter = {{ time = 1e9 }}\n{GREY}")).contains("at most 10000 lifetimes"));
    assert!(
        of(&format!("density.emitter = {{ velocity = [1e30, 0, 0] }}\n{GREY}")).contains("the position of particle")
    );
    assert!(of(&format!("density.head = {{ number = 10000000 }}\n{GREY}")).contains("media.a.density.head.number"));
}

/// Another time is another world; in code the next picture is put into the same world.
#[test]
fn a_plume_at_another_time() {
    let (name, text) = SCENES.into_iter().find(|(name, _)| *name == "particles.toml").unwrap();
    let mut scene = Document::new(name, text).parse().unwrap();
    scene.set("media.plume.density.emitter.number", "500").unwrap();
    let mut later = scene.clone();
    later.set("media.plume.density.emitter.time", "6.5").unwrap();
    let [mut world, later] = [scene, later].map(|scene| World::load(scene, &Embedded::default(), BUDGET).unwrap());
    assert_ne!(world.hash, later.hash);
    let list = |world: &World| match &world.volumes[0].field {
        Field::Particles(particles) => particles.list().to_vec(),
        _ => panic!(),
    };
    assert_ne!(list(&world), list(&later));
    let Density::Emitter(emitter) = &world.scene.media["plume"].density else { panic!() };
    let next = Emission::new(emitter, BUDGET).unwrap().at(6.5).unwrap();
    world.volumes[0].set_bodies(Field::Particles(std::sync::Arc::new(next)));
    assert_eq!(list(&world), list(&later));
    assert_eq!(world.volumes[0].world_from_unit, later.volumes[0].world_from_unit);
    // Before the first particle has appeared there is a medium, of nothing.
    let early = load(&format!("density.emitter = {{ time = 0 }}\n{GREY}")).unwrap();
    assert_eq!(early.volumes[0].coefficients(Vec3::ZERO).unwrap().sigma_t(), Vec3::ZERO);
}
