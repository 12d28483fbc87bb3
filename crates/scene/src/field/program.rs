//! A formula as a list of scalar operations, made from naga's intermediate representation.
//!
//! Every value is a list of single-precision scalars, one unless it is a vector; a bool is 0 or 1. Swizzles, compositions
//! and the like then cost nothing, and vector functions come down to sums and products.

use std::collections::HashMap;

use glam::{UVec3, Vec3};
use naga::{
    Block, Expression, Function, Handle, Literal, LocalVariable, Module, RelationalFunction, ScalarKind, Span,
    Statement, TypeInner,
};

use super::functions;
use super::noise::{Fractal, MAX_OCTAVES, gradient_noise};

/// The most operations of a program.
const MOST_OPERATIONS: usize = 4096;

/// Scalar operations in order; each gives the next value, and the last gives the result.
#[derive(Clone, Debug)]
pub(super) struct Program(Vec<Operation>);

/// A value, by its number.
pub(super) type Scalar = usize;

/// A vector's components, or one scalar.
pub(super) type Value = Vec<Scalar>;

#[derive(Clone, Copy, Debug)]
pub(super) enum Operation {
    Constant(f32),
    /// A component of p.
    Position(usize),
    Unary(fn(f32) -> f32, Scalar),
    Binary(fn(f32, f32) -> f32, [Scalar; 2]),
    /// The second where the first is true, else the third.
    Select([Scalar; 3]),
    Noise([Scalar; 3]),
    Fbm([Scalar; 3], u32),
}

/// Why a module is no program, and where it says so.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    pub span: Span,
    pub message: String,
}

impl Program {
    /// The function `density` of a valid module.
    pub fn of(module: &Module) -> Result<Self, Fault> {
        let none = || Fault { span: Span::UNDEFINED, message: "no function `density`".into() };
        let named = |f: &&Function| f.name.as_deref() == Some("density");
        let function = module.functions.iter().map(|(_, function)| function).find(named).ok_or_else(none)?;
        let mut builder =
            Builder { module, function, operations: Vec::new(), values: HashMap::new(), locals: HashMap::new() };
        let result = builder.block(&function.body)?.ok_or_else(none)?;
        let [result] = result[..] else { return Err(none()) };
        // The result is the last value.
        builder.operations.push(Operation::Unary(|x| x, result));
        Ok(Self(builder.operations))
    }

    /// The value at a position [m].
    pub fn run(&self, p: Vec3) -> f32 {
        let mut values: Vec<f32> = Vec::with_capacity(self.0.len());
        for operation in &self.0 {
            let point = |of: [Scalar; 3]| Vec3::from(of.map(|i| values[i]));
            let value = match *operation {
                Operation::Constant(value) => value,
                Operation::Position(axis) => p[axis],
                Operation::Unary(f, a) => f(values[a]),
                Operation::Binary(f, [a, b]) => f(values[a], values[b]),
                Operation::Select([condition, a, b]) => values[if values[condition] != 0.0 { a } else { b }],
                Operation::Noise(at) => gradient_noise(point(at), UVec3::ZERO),
                Operation::Fbm(at, octaves) => {
                    Fractal { octaves, gain: 0.5, lacunarity: 2.0, seed: 0 }.value(point(at))
                }
            };
            values.push(value);
        }
        values.last().copied().unwrap_or(f32::NAN)
    }
}

/// Lowers a function, statement by statement.
pub(super) struct Builder<'a> {
    module: &'a Module,
    function: &'a Function,
    operations: Vec<Operation>,
    values: HashMap<Handle<Expression>, Value>,
    /// Variables, which naga makes of `&&` and `||`.
    locals: HashMap<Handle<LocalVariable>, Value>,
}

impl Builder<'_> {
    /// Lowers statements; the value that they return, if any.
    fn block(&mut self, block: &Block) -> Result<Option<Value>, Fault> {
        for (statement, &span) in block.span_iter() {
            match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        let value = self.lower(handle)?;
                        self.values.insert(handle, value);
                    }
                }
                Statement::Call { function, arguments, result: Some(result) } => {
                    let name = self.module.functions[*function].name.as_deref().unwrap_or_default();
                    let value = self.call(name, arguments, span)?;
                    self.values.insert(*result, value);
                }
                Statement::Store { pointer, value } => {
                    let Expression::LocalVariable(local) = self.function.expressions[*pointer] else {
                        return Err(unsupported(span, "a pointer"));
                    };
                    let value = self.value(*value)?;
                    self.locals.insert(local, value);
                }
                Statement::If { condition, accept, reject } => {
                    let [condition] = self.value(*condition)?[..] else { return Err(unsupported(span, "a vector")) };
                    let before = self.locals.clone();
                    self.block(accept)?;
                    let accepted = std::mem::replace(&mut self.locals, before);
                    self.block(reject)?;
                    for (local, accepted) in accepted {
                        let value = match self.locals.get(&local).cloned() {
                            Some(rejected) => self.select(&[condition], &accepted, &rejected),
                            None => accepted,
                        };
                        self.locals.insert(local, value);
                    }
                }
                Statement::Block(block) => {
                    self.block(block)?;
                }
                Statement::Return { value: Some(value) } => return self.value(*value).map(Some),
                _ => return Err(unsupported(span, "a statement")),
            }
            if self.operations.len() > MOST_OPERATIONS {
                return Err(Fault { span, message: format!("more than {MOST_OPERATIONS} operations") });
            }
        }
        Ok(None)
    }

    fn call(&mut self, name: &str, arguments: &[Handle<Expression>], span: Span) -> Result<Value, Fault> {
        let Some(Ok(at)) = arguments.first().map(|p| self.value(*p)) else { return Err(unsupported(span, "a call")) };
        let &[x, y, z] = &at[..] else { return Err(unsupported(span, "a call")) };
        let operation = match arguments {
            [_] if name == "noise" => Operation::Noise([x, y, z]),
            [_, octaves] if name == "fbm" => {
                let accepted = 1..=MAX_OCTAVES;
                match self.function.expressions[*octaves] {
                    Expression::Literal(Literal::U32(octaves)) if accepted.contains(&octaves) => {
                        Operation::Fbm([x, y, z], octaves)
                    }
                    _ => {
                        let message = format!("octaves that are no constant from 1 to {MAX_OCTAVES}");
                        return Err(Fault { span: self.span(*octaves), message });
                    }
                }
            }
            _ => return Err(unsupported(span, "a call")),
        };
        Ok(vec![self.push(operation)])
    }

    /// The value of an expression: as it was emitted, or that of a constant or an argument.
    pub fn value(&mut self, handle: Handle<Expression>) -> Result<Value, Fault> {
        match self.values.get(&handle) {
            Some(value) => Ok(value.clone()),
            None => self.lower(handle),
        }
    }

    fn lower(&mut self, handle: Handle<Expression>) -> Result<Value, Fault> {
        let no = |what: &str| Err(unsupported(self.function.expressions.get_span(handle), what));
        Ok(match &self.function.expressions[handle] {
            Expression::Literal(Literal::F32(value)) => vec![self.constant(*value)],
            Expression::Literal(Literal::Bool(value)) => vec![self.constant(f32::from(*value))],
            Expression::Literal(_) => return no("an integer"),
            Expression::ZeroValue(ty) => match self.components(*ty) {
                Some(n) => vec![self.constant(0.0); n],
                None => return no("a type other than f32, bool and vectors of them"),
            },
            Expression::Compose { ty, components } => {
                if self.components(*ty).is_none() {
                    return no("a type other than f32, bool and vectors of them");
                }
                let components: Result<Vec<_>, _> = components.iter().map(|handle| self.value(*handle)).collect();
                components?.concat()
            }
            Expression::AccessIndex { base, index } => match self.value(*base)?.get(*index as usize) {
                Some(&component) => vec![component],
                None => return no("an index"),
            },
            Expression::Splat { size, value } => self.value(*value)?.repeat(*size as usize),
            Expression::Swizzle { size, vector, pattern } => {
                let vector = self.value(*vector)?;
                pattern[..*size as usize].iter().map(|component| vector[*component as usize]).collect()
            }
            Expression::FunctionArgument(_) => (0..3).map(|axis| self.push(Operation::Position(axis))).collect(),
            Expression::Load { pointer } => match self.function.expressions[*pointer] {
                Expression::LocalVariable(local) if self.locals.contains_key(&local) => self.locals[&local].clone(),
                _ => return no("a variable"),
            },
            // The value is that of the variable, which is read where it is loaded.
            Expression::LocalVariable(_) => Vec::new(),
            Expression::Unary { op, expr } => match functions::unary(*op) {
                Some(f) => {
                    let value = self.value(*expr)?;
                    self.unary(f, &value)
                }
                None => return no("an operator of integers"),
            },
            Expression::Binary { op, left, right } => match functions::binary(*op) {
                Some(f) => {
                    let (left, right) = (self.value(*left)?, self.value(*right)?);
                    self.binary(f, &left, &right)
                }
                None => return no("an operator of integers"),
            },
            Expression::Select { condition, accept, reject } => {
                let [condition, accept, reject] = [self.value(*condition)?, self.value(*accept)?, self.value(*reject)?];
                self.select(&condition, &accept, &reject)
            }
            Expression::Relational { fun, argument } => {
                let argument = self.value(*argument)?;
                match fun {
                    RelationalFunction::All => vec![self.fold(f32::min, &argument)],
                    RelationalFunction::Any => vec![self.fold(f32::max, &argument)],
                    _ => return no("a function of other types"),
                }
            }
            Expression::As { expr, kind, convert: Some(_) } => {
                let value = self.value(*expr)?;
                match kind {
                    ScalarKind::Float => value,
                    ScalarKind::Bool => self.unary(|x| f32::from(x != 0.0), &value),
                    _ => return no("an integer"),
                }
            }
            Expression::Math { fun, arg, arg1, arg2, arg3: None } => {
                let mut arguments = vec![self.value(*arg)?];
                for argument in [arg1, arg2].into_iter().flatten() {
                    arguments.push(self.value(*argument)?);
                }
                match self.math(*fun, &arguments) {
                    Some(value) => value,
                    None => return no("a function of other types"),
                }
            }
            _ => return no("what is no function of p alone"),
        })
    }

    /// How many components a type of floats or bools has.
    fn components(&self, ty: Handle<naga::Type>) -> Option<usize> {
        let known = |scalar: &naga::Scalar| matches!(scalar.kind, ScalarKind::Float | ScalarKind::Bool);
        match &self.module.types[ty].inner {
            TypeInner::Scalar(scalar) if known(scalar) => Some(1),
            TypeInner::Vector { size, scalar } if known(scalar) => Some(*size as usize),
            _ => None,
        }
    }

    fn span(&self, handle: Handle<Expression>) -> Span {
        self.function.expressions.get_span(handle)
    }

    fn push(&mut self, operation: Operation) -> Scalar {
        self.operations.push(operation);
        self.operations.len() - 1
    }

    pub fn constant(&mut self, value: f32) -> Scalar {
        self.push(Operation::Constant(value))
    }

    /// A function of every component.
    pub fn unary(&mut self, f: fn(f32) -> f32, a: &[Scalar]) -> Value {
        a.iter().map(|&a| self.push(Operation::Unary(f, a))).collect()
    }

    /// A function of pairs of components; a scalar goes with every component.
    pub fn binary(&mut self, f: fn(f32, f32) -> f32, a: &[Scalar], b: &[Scalar]) -> Value {
        (0..a.len().max(b.len())).map(|i| self.push(Operation::Binary(f, [pick(a, i), pick(b, i)]))).collect()
    }

    fn select(&mut self, condition: &[Scalar], a: &[Scalar], b: &[Scalar]) -> Value {
        (0..a.len()).map(|i| self.push(Operation::Select([pick(condition, i), pick(a, i), pick(b, i)]))).collect()
    }

    /// All components in one.
    pub fn fold(&mut self, f: fn(f32, f32) -> f32, a: &[Scalar]) -> Scalar {
        let mut sum = a[0];
        for &next in &a[1..] {
            sum = self.push(Operation::Binary(f, [sum, next]));
        }
        sum
    }
}

fn pick(value: &[Scalar], i: usize) -> Scalar {
    if value.len() == 1 { value[0] } else { value[i] }
}

fn unsupported(span: Span, what: &str) -> Fault {
    Fault { span, message: what.into() }
}
