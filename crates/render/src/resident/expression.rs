//! Densities that are expressions, as shaders evaluate them: the scene's own text, put into the shader.

use std::fmt::Write as _;

use tyndall_scene::{Field, Volume};

/// How the function begins that [`Expressions::splice`] replaces. A shader declares it with a body without braces:
/// `fn expression(i: u32, p: vec3f) -> f32 { return 0.0; }`, the density of medium i at p, in the medium's own space [m].
const MARKER: &str = "fn expression(";

/// What expressions may call.
const NOISE: &str = include_str!("../math/noise.wesl");

/// Bounds a value as `tyndall_scene::field::Expression` does. Compilers may take it that no value is infinite or NaN: so
/// the exponent's bits are looked at.
const BOUNDED: &str = "
fn expression_bounded(value: f32, highest: f32) -> f32 {
    let finite = (bitcast<u32>(value) & 0x7f800000u) != 0x7f800000u;
    return select(0.0, clamp(value, 0.0, highest), finite);
}
";

/// The expressions of a world, as WGSL.
#[derive(Clone, Debug)]
pub struct Expressions(String);

impl Expressions {
    /// Those of a world; `None` where it has none.
    pub fn new(volumes: &[Volume]) -> Option<Self> {
        let (mut cases, mut functions) = (String::new(), String::new());
        for (i, volume) in volumes.iter().enumerate() {
            if let Field::Expression(expression) = &volume.field {
                let (text, highest) = (expression.formula.text(), expression.highest);
                // Writing to a string does not fail.
                let _ = writeln!(cases, "case {i}u: {{ return expression_bounded(expression_{i}(p), {highest:?}); }}");
                let _ = writeln!(
                    functions,
                    "fn expression_{i}(p: vec3f) -> f32 {{\nlet value: f32 =\n{text}\n;\nreturn value;\n}}"
                );
            }
        }
        let switch = format!(
            "fn expression(i: u32, p: vec3f) -> f32 {{\nswitch i {{\n{cases}default: {{ return 0.0; }}\n}}\n}}"
        );
        (!functions.is_empty()).then_some(Self(switch + BOUNDED + &functions))
    }

    /// A shader's linked WGSL with these in place of its marker function; `None` where it has none.
    ///
    /// The result is valid WGSL if the shader is, as the expressions were validated when they were read.
    pub fn splice(&self, shader: &str) -> Option<String> {
        let start = shader.find(MARKER)?;
        let end = start + shader[start..].find('}')? + 1;
        // What of the noise the shader has itself already is not declared twice.
        let missing = |function: &&str| {
            let name = function.split('(').next().unwrap_or_default();
            !shader.contains(&format!("fn {name}("))
        };
        let functions = NOISE.split("\nfn ").skip(1).filter(missing).map(|function| format!("\nfn {function}\n"));
        Some([&shader[..start], &self.0, &functions.collect::<String>(), &shader[end..]].concat())
    }
}
