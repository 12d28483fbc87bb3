//! Formulas as scene files write them: one WGSL expression of the position p. naga reads it, here and on the GPU.

use std::error::Error;

use glam::Vec3;
use naga::Span;
use naga::front::wgsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};

use crate::FieldError;

use super::program::{Fault, Program};

/// The longest text of a formula [bytes].
pub const MAX_FORMULA: usize = 4096;

/// The most signs in a formula. naga needs stack in proportion to how deeply a text nests: with this many 1 MiB is enough.
const MOST_SIGNS: usize = 1024;

/// What may not stand in a formula: with none of these it cannot end the statement it is put into.
const FORBIDDEN: [char; 4] = [';', '{', '}', '@'];

/// The most characters of naga's words that a message quotes.
const QUOTED: usize = 160;

/// What a formula may call besides WGSL's own functions; only their signatures matter here.
const BEFORE: &str = "fn noise(p: vec3f) -> f32 { return p.x; }\n\
                      fn fbm(p: vec3f, octaves: u32) -> f32 { return p.x; }\n\
                      fn density(p: vec3f) -> f32 {\nlet value: f32 =\n";
const AFTER: &str = "\n;\nreturn value;\n}\n";

/// A WGSL expression of type `f32` of the position `p`, a `vec3f` in metres.
#[derive(Clone, Debug)]
pub struct Formula {
    text: String,
    program: Program,
}

/// Why a text is no formula.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an error at line {line}, column {column} of the expression: {message}")]
pub struct FormulaError {
    /// What is wrong.
    pub message: String,
    /// Line in the text, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl FormulaError {
    /// What a formula may be, in words.
    pub const ACCEPTED: &str = "one WGSL expression of type f32 of p: vec3f [m], of f32, bool and vectors of them, WGSL's \
                                functions of these, noise(p) and fbm(p, octaves)";

    /// The error of a medium's density.
    pub(crate) fn of(&self, medium: &str) -> FieldError {
        let path = format!("media.{medium}.density.expression.wgsl");
        FieldError { path, found: self.to_string(), accepted: Self::ACCEPTED.into() }
    }

    fn new(text: &str, at: usize, message: impl AsRef<str>) -> Self {
        let before = text.get(..at).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        let plain = |c: char| if c.is_control() { ' ' } else { c };
        let mut message: String = message.as_ref().chars().map(plain).take(QUOTED + 1).collect();
        if let Some((cut, _)) = message.char_indices().nth(QUOTED) {
            message.replace_range(cut.., "…");
        }
        let line = before.matches('\n').count() + 1;
        Self { message, line, column: before[line_start..].chars().count() + 1 }
    }
}

impl Formula {
    /// Reads a formula.
    ///
    /// # Errors
    /// What is not a WGSL expression of type `f32`, what is longer than [`MAX_FORMULA`], and what needs integers, matrices,
    /// arrays or functions that have no meaning here.
    pub fn parse(text: &str) -> Result<Self, FormulaError> {
        if text.len() > MAX_FORMULA {
            let message = format!("more than {MAX_FORMULA} bytes");
            return Err(FormulaError::new(text, text.floor_char_boundary(MAX_FORMULA), message));
        }
        if let Some((at, character)) = text.char_indices().find(|(_, c)| FORBIDDEN.contains(c)) {
            return Err(FormulaError::new(text, at, format!("`{character}`")));
        }
        if let Some((at, _)) = text.match_indices(|c: char| c.is_ascii_punctuation()).nth(MOST_SIGNS) {
            return Err(FormulaError::new(text, at, format!("more than {MOST_SIGNS} signs")));
        }
        let source = format!("{BEFORE}{text}{AFTER}");
        let fault = |span: Option<Span>, message: String| {
            let at = span.and_then(Span::to_range).map_or(0, |range| range.start.saturating_sub(BEFORE.len()));
            FormulaError::new(text, at.min(text.len()), message)
        };
        let module = wgsl::parse_str(&source)
            .map_err(|error| fault(error.labels().next().map(|(span, _)| span), error.message().into()))?;
        Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).map_err(|error| {
            let span = error.spans().next().map(|&(span, _)| span);
            let mut words = error.as_inner().to_string();
            let mut cause = error.as_inner().source();
            while let Some(error) = cause {
                words = error.to_string();
                cause = error.source();
            }
            fault(span, words)
        })?;
        let program = Program::of(&module).map_err(|Fault { span, message }| fault(Some(span), message))?;
        Ok(Self { text: text.into(), program })
    }

    /// The text that it was read from.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The value at a position [m], in single precision; what WGSL leaves undefined is NaN or infinite.
    pub fn value(&self, p: Vec3) -> f32 {
        self.program.run(p)
    }
}
