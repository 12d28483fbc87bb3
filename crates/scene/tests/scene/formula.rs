//! Formulas: what they give, what is refused, and what cannot harm.

use proptest::prelude::*;
use tyndall_scene::field::{Expression, Formula, Fractal, MAX_FORMULA, gradient_noise};
use tyndall_scene::glam::{UVec3, Vec3};

/// A formula and what it means.
type Case = (&'static str, fn(Vec3) -> f32);

const CASES: &[Case] = &[
    ("p.x", |p| p.x),
    ("2 * p.y - 1", |p| 2.0 * p.y - 1.0),
    ("-p.z / (1.0 + p.x * p.x)", |p| -p.z / (1.0 + p.x * p.x)),
    ("p.x % 0.75", |p| p.x % 0.75),
    ("exp(-4.0*dot(p,p)) * (0.5 + 0.5*sin(20.0*p.x))", |p| {
        (-4.0 * p.length_squared()).exp() * (0.5 + 0.5 * (20.0 * p.x).sin())
    }),
    ("(p * 2 + vec3f(1, 2, 3)).y", |p| p.y * 2.0 + 2.0),
    ("p.zyx[0] + p[1]", |p| p.z + p.y),
    ("dot(vec4(p.xy, vec2f(0.5)), vec4f(p, 1))", |p| p.x * p.x + p.y * p.y + 0.5 * p.z + 0.5),
    ("select(1.0, p.y, p.x > 0.5)", |p| if p.x > 0.5 { p.y } else { 1.0 }),
    ("dot(select(p, vec3f(), p < vec3f(0.2)), vec3f(1))", |p| {
        p.to_array().into_iter().map(|x| if x < 0.2 { 0.0 } else { x }).sum()
    }),
    ("f32(p.x > 0 && p.y > 0 || p.z > 0)", |p| f32::from(p.x > 0.0 && p.y > 0.0 || p.z > 0.0)),
    ("f32(!(p.x <= 0) & (p.y >= 0 | p.z != 0))", |p| f32::from(p.x > 0.0 && (p.y >= 0.0 || p.z != 0.0))),
    ("f32(all(p > vec3f(0)))", |p| f32::from(p.min_element() > 0.0)),
    ("f32(any(p > vec3f(0)))", |p| f32::from(p.max_element() > 0.0)),
    ("f32(bool(p.x)) + f32(p.y == p.y)", |p| f32::from(p.x != 0.0) + 1.0),
    ("length(p - 0.5) + distance(p, vec3f(1, 0, 0))", |p| (p - 0.5).length() + p.distance(Vec3::X)),
    ("normalize(p + 2).x", |p| (p + 2.0).normalize().x),
    ("cross(p, vec3f(1, 2, 3)).y", |p| p.cross(Vec3::new(1.0, 2.0, 3.0)).y),
    ("reflect(p, vec3f(0, 1, 0)).y", |p| -p.y),
    ("mix(p.x, p.y, 0.25)", |p| 0.75 * p.x + 0.25 * p.y),
    ("mix(p, vec3f(1), 0.25).z", |p| 0.75 * p.z + 0.25),
    ("clamp(p.x, -0.25, 0.5) + saturate(p.y)", |p| p.x.clamp(-0.25, 0.5) + p.y.clamp(0.0, 1.0)),
    ("smoothstep(-0.5, 0.5, p.x)", |p| {
        let t = (p.x + 0.5).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }),
    ("step(0.25, p.x) + sign(p.y)", |p| f32::from(p.x >= 0.25) + p.y.signum()),
    ("min(p.x, p.y) + max(p.y, p.z) + abs(p.z)", |p| p.x.min(p.y) + p.y.max(p.z) + p.z.abs()),
    ("pow(p.x + 2, 3) + sqrt(p.y + 2) + inverseSqrt(p.z + 2)", |p| {
        (p.x + 2.0).powi(3) + (p.y + 2.0).sqrt() + (p.z + 2.0).sqrt().recip()
    }),
    ("floor(3 * p.x) + ceil(3 * p.y) + fract(3 * p.z) + trunc(3 * p.x) + round(3 * p.y)", |p| {
        let q = 3.0 * p;
        q.x.floor() + q.y.ceil() + (q.z - q.z.floor()) + q.x.trunc() + q.y.round_ties_even()
    }),
    ("sin(p.x) + cos(p.y) + tan(p.z) + asin(p.x / 2) + acos(p.y / 2) + atan(p.z)", |p| {
        p.x.sin() + p.y.cos() + p.z.tan() + (p.x / 2.0).asin() + (p.y / 2.0).acos() + p.z.atan()
    }),
    ("sinh(p.x) + cosh(p.y) + tanh(p.z) + asinh(p.x) + acosh(p.y + 2) + atanh(p.z / 2)", |p| {
        p.x.sinh() + p.y.cosh() + p.z.tanh() + p.x.asinh() + (p.y + 2.0).acosh() + (p.z / 2.0).atanh()
    }),
    ("atan2(p.y, p.x) + radians(p.x) + degrees(p.y)", |p| p.y.atan2(p.x) + p.x.to_radians() + p.y.to_degrees()),
    ("log(p.x + 2) + log2(p.y + 2) + exp2(p.z) + fma(p.x, p.y, p.z)", |p| {
        (p.x + 2.0).ln() + (p.y + 2.0).log2() + p.z.exp2() + p.x * p.y + p.z
    }),
    ("noise(3 * p)", |p| gradient_noise(3.0 * p, UVec3::ZERO)),
    ("fbm(4 * p.zyx, 3)", |p| fbm(3).value(4.0 * Vec3::new(p.z, p.y, p.x))),
    ("1.0 // a comment", |_| 1.0),
    ("p.x /* and\n another */ +\n p.y", |p| p.x + p.y),
    ("0x10", |_| 16.0),
];

fn fbm(octaves: u32) -> Fractal {
    Fractal { octaves, gain: 0.5, lacunarity: 2.0, seed: 0 }
}

proptest! {
    /// A formula gives what Rust does, but for the order of some roundings.
    #[test]
    fn formulas_mean_what_they_say(p in prop::array::uniform3(-1.0f32..1.0)) {
        let p = Vec3::from(p);
        for (text, meaning) in CASES {
            let formula = Formula::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
            let (value, expected) = (formula.value(p), meaning(p));
            prop_assert!((value - expected).abs() <= 4e-6 * expected.abs().max(1.0), "{text}: {value} for {expected}");
        }
    }

    /// Any text is read or refused; a formula that is read gives a number wherever.
    #[test]
    fn any_text(text in "[-+*/%<>=!&|()\\[\\].,;{}@ \n0-9a-zé]{0,40}") {
        read(&text);
    }

    /// The same of texts that look like formulas.
    #[test]
    fn any_words(words in prop::collection::vec(prop::sample::select(&WORDS[..]), 0..24)) {
        read(&words.concat());
    }
}

const WORDS: [&str; 40] = [
    "p",
    "p.x",
    ".xy",
    "[0]",
    "[p]",
    "1",
    "1.0",
    "2u",
    "3i",
    "1e38",
    "1f",
    "true",
    "+",
    "-",
    "*",
    "/",
    "%",
    "(",
    ")",
    ",",
    "<",
    "==",
    "&&",
    "||",
    "&",
    "!",
    "vec3f(",
    "vec2<f32>(",
    "f32(",
    "i32(",
    "noise(",
    "fbm(",
    ", 4)",
    "sin(",
    "pow(",
    "select(",
    "dot(",
    "mat3x3f(",
    "density(",
    " ",
];

fn read(text: &str) {
    if let Ok(formula) = Formula::parse(text) {
        for p in [Vec3::ZERO, Vec3::splat(-1e30), Vec3::splat(f32::INFINITY), Vec3::NAN] {
            formula.value(p);
        }
    }
}

#[test]
fn refusals() {
    let cases = [
        ("", "1:1 expected expression, found \";\""),
        ("p", "1:1 the type of `value` is expected to be `f32`, but got `vec3<f32>`"),
        ("true", "1:1 the type of `value` is expected to be `f32`, but got `bool`"),
        ("p.x >", "1:6 expected expression, found \";\""),
        ("q.x", "1:1 no definition in scope for identifier: `q`"),
        ("é", "1:1 no definition in scope for identifier: `é`"),
        ("p.x\n  + nonsense(p)", "2:5 no definition in scope for identifier: `nonsense`"),
        ("volumes", "1:1 no definition in scope for identifier: `volumes`"),
        ("p.w", "1:3 invalid field accessor `w`"),
        ("p.x; p.y", "1:4 `;`"),
        ("1.0 } fn evil() -> f32 { return 1.0", "1:5 `}`"),
        ("@const 1.0", "1:1 `@`"),
        ("p.x)", "1:4 expected `;`, found \")\""),
        ("1.0) + (2.0", "1:4 expected `;`, found \")\""),
        ("p = p", "1:3 expected `;`, found \"=\""),
        ("&p", "1:1 the operand of the `&` operator must be a reference"),
        ("density(p)", "1:1 declaration of `density` is recursive"),
        ("textureLoad(p)", "1:1 wrong number of arguments: expected 2, found 1"),
        ("noise(1.0)", "1:7 automatic conversions cannot convert `{AbstractFloat}` to `vec3<f32>`"),
        ("1.0 / 0.0", "1:1 Divide operation overflowed"),
        ("f32(1e400)", "1:5 numeric literal not representable by target type: `1e400`"),
        ("f32(i32(p.x))", "1:5 an integer"),
        ("p[u32(p.x)]", "1:3 an integer"),
        ("f32(u32(3) << 2u) * p.x + f32(vec2u(p.xy).x)", "1:31 an integer"),
        ("(mat3x3f() * p).x", "1:2 a type other than f32, bool and vectors of them"),
        ("refract(p, p, 1.0).x", "1:1 a function of other types"),
        ("dpdx(p.x)", "1:1 what is no function of p alone"),
        ("fbm(p, 13)", "1:8 octaves that are no constant from 1 to 12"),
        ("fbm(p, 0)", "1:8 octaves that are no constant from 1 to 12"),
        ("fbm(p, u32(p.x))", "1:8 an integer"),
    ];
    let mut wrong = String::new();
    for (text, expected) in cases {
        let message = match Formula::parse(text) {
            Ok(_) => "accepted".into(),
            Err(error) => format!("{}:{} {}", error.line, error.column, error.message),
        };
        if message != expected {
            wrong += &format!("\n{text}\n  is        {message}\n  should be {expected}\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    let long = Formula::parse(&"x".repeat(MAX_FORMULA + 1)).unwrap_err();
    assert_eq!((long.message.as_str(), long.column), ("more than 4096 bytes", 4097));
    assert_eq!(Formula::parse(&"+".repeat(1025)).unwrap_err().message, "more than 1024 signs");
}

/// What has no finite value gives none; a density counts it as 0 and keeps to its bounds.
#[test]
fn bounded_values() {
    let density = |wgsl: &str| {
        let formula = Formula::parse(wgsl).unwrap();
        Expression { formula, min: Vec3::splat(-1.0), size: Vec3::splat(2.0), highest: 1.5 }
    };
    for (wgsl, value) in [
        ("0.25", 0.25),
        ("2.0", 1.5),
        ("-1.0", 0.0),
        ("1.0 / (p.x - p.x)", 0.0),
        ("-1.0 / (p.x - p.x)", 0.0),
        ("sqrt(p.x - 2)", 0.0),
        ("pow(p.x - 2, 2)", 0.0),
        ("exp(200 + p.x)", 0.0),
        ("p.x", 0.5),
        ("p.y", 0.0),
        ("p.z", 1.0),
    ] {
        assert_eq!(density(wgsl).value(Vec3::new(0.75, 0.25, 1.0)), value, "{wgsl}");
    }
}

/// Texts that nest, repeat or grow as much as their length allows are read or refused on a small stack, at once.
#[test]
fn hostile_texts() {
    let fill = |unit: &str, end: &str| unit.repeat((MAX_FORMULA - end.len()) / unit.len()) + end;
    let texts = [
        fill("(", "1"),
        fill("-", "1"),
        fill("!", "true"),
        fill("sin(", "1"),
        fill("1+", "1"),
        fill("p.x+", "p.x"),
        fill("p.x*", "1"),
        fill("f32(", "1"),
        fill("p[0]==", "1"),
        fill("true&&", "true"),
        fill("p.x>0&&", "true"),
        fill("(p.x>0&&", "true"),
        fill("p.xyz.", "x"),
        fill("vec3(", "1"),
        fill("[", "1"),
        fill("/*", ""),
        fill("a<", "1"),
        fill("p.x<", "1"),
        fill("vec3<", "f32>"),
        fill("normalize(p)+", "p"),
        fill("select(1,", "p.x"),
        fill("&", "p"),
        fill("1u<<", "1"),
        fill("p^", "p"),
        fill("noise(p)+", "1"),
        "x".repeat(1 << 20),
        fill("p\n", ""),
        fill("*", "p"),
        fill("- ", "1"),
        fill("~", "1"),
        fill(".x", "p"),
        format!("p{}", ".x".repeat(1000)),
        format!("p{}", "[0]".repeat(500)),
        format!("p{}", ".xyz".repeat(1000)),
        format!("{}p{}", "normalize(".repeat(190), ")".repeat(190)),
        format!("{}p.x{}", "(1+".repeat(190), ")".repeat(190)),
        format!("{}1{}", "-(".repeat(90), ")".repeat(90)),
    ];
    let read_all = move || texts.iter().for_each(|text| read(text));
    std::thread::Builder::new().stack_size(1 << 20).spawn(read_all).unwrap().join().unwrap();
}
