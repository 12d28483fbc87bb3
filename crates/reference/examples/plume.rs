use std::ops::ControlFlow;
use tyndall_reference::{Options, render};
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, World, assets::Directory};
fn main() {
    let text = r#"
[camera]
position = [POS]
target = [TGT]
fov = 40
[film]
size = [160, 120]
[lights.sun.directional]
direction = [1, -1, -0.5]
irradiance = 3
[lights.sky.constant]
radiance = 0.3
[media.smoke.density.grid]
file = "smoke.vdb"
name = "density"
[media.smoke.optics.coefficients]
sigma_s = SIG
sigma_a = 0.02
phase = { hg = { g = 0.5 } }
"#;
    let args: Vec<String> = std::env::args().collect();
    let text = text.replace("POS", &args[1]).replace("TGT", &args[2]).replace("SIG", &args[3]);
    let scene = Document::new("plume.toml", text).parse().unwrap();
    let t = std::time::Instant::now();
    let world = World::load(scene, &Directory("/work/shared/data".into()), Budget(1 << 31)).unwrap();
    let volume = &world.volumes[0];
    println!(
        "load {:?} box {} {}",
        t.elapsed(),
        volume.world_from_unit.transform_point3(glam::Vec3::ZERO),
        volume.world_from_unit.transform_point3(glam::Vec3::ONE)
    );
    if let tyndall_scene::Field::Grid(g) = &volume.field {
        println!("{:?} {}", g.dims, matches!(g.voxels, tyndall_scene::volume::Voxels::F16(_)));
    }
    let t = std::time::Instant::now();
    tyndall_reference::Tracer::new(&world).unwrap();
    println!("prepare {:?}", t.elapsed());
    let depth = args.get(4).and_then(|d| d.parse().ok());
    let mut last = None;
    let image = render(&world, &Options { samples: Some(128), depth, ..Default::default() }, None, &mut |p| {
        last = Some(*p);
        ControlFlow::Continue(())
    })
    .unwrap();
    let mean: f64 = image.pixels.iter().flatten().map(|x| f64::from(*x)).sum::<f64>() / image.pixels.len() as f64 / 3.0;
    println!("{:?} mean {mean}", last.unwrap());
}
