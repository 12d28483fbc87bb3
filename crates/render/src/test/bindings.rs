//! A pass that does not match its shader is an error that names pass and binding.

use super::gpu;
use crate::RenderError;
use crate::graph::{BindingError, Graph, Shader, Tile, shader};

static PHASE: Shader = shader!("test/probes/phase");

fn binding_error(result: Result<(), RenderError>) -> BindingError {
    match result {
        Err(RenderError::Binding(error)) => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn names_are_held_against_the_shader() {
    let Some(gpu) = gpu() else { return };
    let mut graph = Graph::new(&gpu);
    let [a, b] = ["a", "b"].map(|name| gpu.buffer(name, &vec![glam::Vec4::ZERO]));
    let sampler = gpu.device.create_sampler(&Default::default());

    let pass = graph.compute("p", &PHASE).read("input", &a).write("outptu", &b);
    let error = binding_error(pollster::block_on(pass.over_film(1)));
    assert_eq!(error.to_string(), "pass \"p\" binds \"outptu\", which its shader does not have; it has: input, output");

    let pass = graph.compute("p", &PHASE).read("input", &a);
    let error = binding_error(pollster::block_on(pass.over_film(1)));
    assert_eq!(error.to_string(), "pass \"p\" does not bind \"output\", which its shader needs");

    let pass = graph.compute("p", &PHASE).read("input", &a).read("input", &a).write("output", &b);
    let error = binding_error(pollster::block_on(pass.over_film(1)));
    assert_eq!(error, BindingError::Twice { pass: "p", name: "input" });

    let pass = graph.compute("p", &PHASE).read("input", &sampler).write("output", &b);
    let error = binding_error(pollster::block_on(pass.over_film(1)));
    assert!(error.to_string().contains("binds a sampler as \"input\""), "{error}");

    let pass = graph.compute("p", &PHASE).read("input", &a).read("output", &b);
    let error = binding_error(pollster::block_on(pass.over_film(1)));
    assert!(error.to_string().contains("binds a read buffer of 16 bytes as \"output\""), "{error}");
}

#[test]
fn what_the_device_refuses_names_the_pass() {
    let Some(gpu) = gpu() else { return };
    let mut graph = Graph::new(&gpu);
    let a = gpu.buffer("a", &vec![glam::Vec4::ZERO]);
    // One buffer read and written in one dispatch: the device's validation, not the names, refuses it.
    let pass = graph.compute("alias", &PHASE).constant("NO_SUCH_OVERRIDE", 1.0).read("input", &a).write("output", &a);
    match pollster::block_on(pass.over_film(1)) {
        Err(RenderError::Pass { pass, message }) => {
            assert_eq!(pass, "alias");
            assert!(!message.is_empty());
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_recorded_pass_runs_in_rounds() {
    let Some(gpu) = gpu() else { return };
    let mut graph = Graph::new(&gpu);
    let [a, b] = ["a", "b"].map(|name| gpu.buffer(name, &vec![glam::Vec4::ZERO; 64]));
    pollster::block_on(graph.compute("p", &PHASE).read("input", &a).write("output", &b).over_film(3)).unwrap();
    let mut profiler = wgpu_profiler::GpuProfiler::new(&gpu.device, Default::default()).unwrap();
    graph.submit(Tile { size: glam::UVec2::ONE, ..Default::default() }, &mut profiler);
    profiler.end_frame().unwrap();
    gpu.wait().unwrap();
    let frames = profiler.process_finished_frame(gpu.queue.get_timestamp_period()).unwrap();
    assert_eq!(frames.len(), 3, "a submission a round");
}

#[test]
fn a_dispatch_runs_once_a_frame() {
    let Some(gpu) = gpu() else { return };
    let mut graph = Graph::new(&gpu);
    let [a, b] = ["a", "b"].map(|name| gpu.buffer(name, &vec![glam::Vec4::ZERO; 64]));
    let pass = graph.compute("p", &PHASE).read("input", &a).write("output", &b);
    pollster::block_on(pass.dispatch([1, 1, 1], 2)).unwrap();
    let mut profiler = wgpu_profiler::GpuProfiler::new(&gpu.device, Default::default()).unwrap();
    for x in [0, 64, 128] {
        graph.submit(Tile { origin: glam::uvec2(x, 0), size: glam::UVec2::ONE, ..Default::default() }, &mut profiler);
    }
    profiler.end_frame().unwrap();
    gpu.wait().unwrap();
    let frames = profiler.process_finished_frame(gpu.queue.get_timestamp_period()).unwrap();
    assert_eq!(frames.len(), 2, "two rounds, with the first of three tiles");
}
