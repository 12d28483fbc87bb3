//! WGSL's operators and functions of floats and bools, in single precision.

use std::ops::{Add, Div, Mul, Neg, Rem, Sub};

use naga::{BinaryOperator, MathFunction, UnaryOperator};

use super::program::{Builder, Value};

pub(super) fn unary(operator: UnaryOperator) -> Option<fn(f32) -> f32> {
    match operator {
        UnaryOperator::Negate => Some(f32::neg),
        UnaryOperator::LogicalNot => Some(|x| 1.0 - x),
        UnaryOperator::BitwiseNot => None,
    }
}

/// Bools are 0 and 1, so that their "and" is the minimum. Operands are no integers, which are refused before.
pub(super) fn binary(operator: BinaryOperator) -> Option<fn(f32, f32) -> f32> {
    Some(match operator {
        BinaryOperator::Add => f32::add,
        BinaryOperator::Subtract => f32::sub,
        BinaryOperator::Multiply => f32::mul,
        BinaryOperator::Divide => f32::div,
        BinaryOperator::Modulo => f32::rem,
        BinaryOperator::Equal => |a, b| f32::from(a == b),
        BinaryOperator::NotEqual => |a, b| f32::from(a != b),
        BinaryOperator::Less => |a, b| f32::from(a < b),
        BinaryOperator::LessEqual => |a, b| f32::from(a <= b),
        BinaryOperator::Greater => |a, b| f32::from(a > b),
        BinaryOperator::GreaterEqual => |a, b| f32::from(a >= b),
        BinaryOperator::And | BinaryOperator::LogicalAnd => f32::min,
        BinaryOperator::InclusiveOr | BinaryOperator::LogicalOr => f32::max,
        BinaryOperator::ExclusiveOr | BinaryOperator::ShiftLeft | BinaryOperator::ShiftRight => return None,
    })
}

/// The functions that act on components one by one, of one and of two arguments.
fn of_components(function: MathFunction) -> Option<fn(f32) -> f32> {
    use MathFunction as F;
    Some(match function {
        F::Abs => f32::abs,
        F::Saturate => |x| x.clamp(0.0, 1.0),
        F::Cos => f32::cos,
        F::Cosh => f32::cosh,
        F::Sin => f32::sin,
        F::Sinh => f32::sinh,
        F::Tan => f32::tan,
        F::Tanh => f32::tanh,
        F::Acos => f32::acos,
        F::Asin => f32::asin,
        F::Atan => f32::atan,
        F::Asinh => f32::asinh,
        F::Acosh => f32::acosh,
        F::Atanh => f32::atanh,
        F::Radians => f32::to_radians,
        F::Degrees => f32::to_degrees,
        F::Ceil => f32::ceil,
        F::Floor => f32::floor,
        F::Round => f32::round_ties_even,
        F::Fract => |x| x - x.floor(),
        F::Trunc => f32::trunc,
        F::Exp => f32::exp,
        F::Exp2 => f32::exp2,
        F::Log => f32::ln,
        F::Log2 => f32::log2,
        F::Sign => |x| if x == 0.0 { 0.0 } else { x.signum() },
        F::Sqrt => f32::sqrt,
        F::InverseSqrt => |x| 1.0 / x.sqrt(),
        _ => return None,
    })
}

fn of_pairs(function: MathFunction) -> Option<fn(f32, f32) -> f32> {
    use MathFunction as F;
    Some(match function {
        F::Min => f32::min,
        F::Max => f32::max,
        F::Atan2 => f32::atan2,
        // WGSL's is exp2(y · log2(x)): none of a negative base, even to a whole power.
        F::Pow => |x, y| if x < 0.0 { f32::NAN } else { x.powf(y) },
        F::Step => |edge, x| f32::from(edge <= x),
        _ => return None,
    })
}

impl Builder<'_> {
    /// The value of a function of floats; `None` for one that is of others.
    pub fn math(&mut self, function: MathFunction, arguments: &[Value]) -> Option<Value> {
        use MathFunction as F;
        Some(match (function, arguments) {
            (_, [x]) if of_components(function).is_some() => self.unary(of_components(function)?, x),
            (_, [x, y]) if of_pairs(function).is_some() => self.binary(of_pairs(function)?, x, y),
            (F::Clamp, [x, low, high]) => {
                let above = self.binary(f32::max, x, low);
                self.binary(f32::min, &above, high)
            }
            (F::Fma, [a, b, c]) => {
                let product = self.binary(f32::mul, a, b);
                self.binary(f32::add, &product, c)
            }
            (F::Mix, [a, b, t]) => {
                let rest = self.unary(|t| 1.0 - t, t);
                let (a, b) = (self.binary(f32::mul, a, &rest), self.binary(f32::mul, b, t));
                self.binary(f32::add, &a, &b)
            }
            (F::SmoothStep, [low, high, x]) => {
                let (above, width) = (self.binary(f32::sub, x, low), self.binary(f32::sub, high, low));
                let t = self.binary(f32::div, &above, &width);
                self.unary(
                    |t| {
                        let t = t.clamp(0.0, 1.0);
                        t * t * (3.0 - 2.0 * t)
                    },
                    &t,
                )
            }
            (F::Dot, [a, b]) => self.dot(a, b),
            (F::Length, [a]) => self.length(a),
            (F::Distance, [a, b]) => {
                let difference = self.binary(f32::sub, a, b);
                self.length(&difference)
            }
            (F::Normalize, [a]) => {
                let length = self.length(a);
                self.binary(f32::div, a, &length)
            }
            (F::Cross, [a, b]) => {
                let turn = |v: &Value, by: usize| (0..3).map(|i| v[(i + by) % 3]).collect::<Value>();
                let left = self.binary(f32::mul, &turn(a, 1), &turn(b, 2));
                let right = self.binary(f32::mul, &turn(a, 2), &turn(b, 1));
                self.binary(f32::sub, &left, &right)
            }
            (F::Reflect, [a, normal]) => {
                let along = self.dot(normal, a);
                let twice = self.unary(|x| 2.0 * x, &along);
                let back = self.binary(f32::mul, normal, &twice);
                self.binary(f32::sub, a, &back)
            }
            _ => return None,
        })
    }

    fn dot(&mut self, a: &[usize], b: &[usize]) -> Value {
        let products = self.binary(f32::mul, a, b);
        vec![self.fold(f32::add, &products)]
    }

    fn length(&mut self, a: &[usize]) -> Value {
        let square = self.dot(a, a);
        self.unary(f32::sqrt, &square)
    }
}
