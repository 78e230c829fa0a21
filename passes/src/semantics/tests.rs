//! Every function against `f64` or plain integers, and every operation's special cases.

use super::*;
use naga::{BinaryOperator, MathFunction, UnaryOperator};

/// Numbers in `low..high`: evenly spread ones, and ones spread evenly over the exponents.
fn samples(low: f32, high: f32) -> impl Iterator<Item = f32> {
    let count = 60_000;
    let even = (0..=count).map(move |i| low + (high - low) * (i as f32 / count as f32));
    let first = if low > 0.0 { low } else { 1e-30f32.min(high) };
    let ratio = f64::from(high / first).ln();
    let spread = (0..=count)
        .map(move |i| (f64::from(first) * (ratio * f64::from(i) / f64::from(count)).exp()) as f32);
    let mirrored = low < 0.0;
    even.chain(spread.flat_map(move |x| [x, if mirrored { -x } else { x }]))
        .filter(move |x| (low..=high).contains(x))
}

/// The distance of a number from the truth, in units in the last place of the truth.
fn ulps(got: f32, truth: f64) -> f64 {
    let size = (truth.abs() as f32).max(f32::MIN_POSITIVE);
    let unit = f64::from(f32::from_bits(size.to_bits() + 1)) - f64::from(size);
    if truth.is_nan() && got.is_nan() || f64::from(got) == truth {
        0.0
    } else {
        (f64::from(got) - truth).abs() / unit
    }
}

fn worst(low: f32, high: f32, got: fn(f32) -> f32, truth: fn(f64) -> f64) -> f64 {
    samples(low, high)
        .map(|x| ulps(got(x), truth(f64::from(x))))
        .fold(0.0, f64::max)
}

/// The accuracy that the documentation of each function states, in ulp, on the ranges that matter.
#[test]
fn functions_are_as_accurate_as_stated() {
    type Row = (&'static str, f32, f32, fn(f32) -> f32, fn(f64) -> f64, f64);
    let rows: &[Row] = &[
        ("exp2", -126.0, 127.9, Real::exp2, f64::exp2, 1.5),
        ("exp", -87.0, 88.7, Real::exp, f64::exp, 2.0),
        ("log2", 1e-37, 3e38, Real::log2, f64::log2, 2.0),
        ("log2 near 1", 0.5, 2.0, Real::log2, f64::log2, 2.0),
        ("log", 1e-37, 3e38, Real::log, f64::ln, 2.5),
        ("sin", -7.0, 7.0, Real::sin, f64::sin, 2.0),
        ("sin far", -1.0e6, 1.0e6, Real::sin, f64::sin, 2.0),
        ("cos", -7.0, 7.0, Real::cos, f64::cos, 2.0),
        ("cos far", -1.0e6, 1.0e6, Real::cos, f64::cos, 2.0),
        ("tan", -7.0, 7.0, Real::tan, f64::tan, 4.0),
        ("asin", -1.0, 1.0, Real::asin, f64::asin, 3.0),
        ("acos", -1.0, 1.0, Real::acos, f64::acos, 3.0),
        ("atan", -1e6, 1e6, Real::atan, f64::atan, 3.0),
        ("sinh", -80.0, 80.0, Real::sinh, f64::sinh, 2.0),
        ("cosh", -80.0, 80.0, Real::cosh, f64::cosh, 2.0),
        ("tanh", -20.0, 20.0, Real::tanh, f64::tanh, 3.0),
        ("asinh", -1e6, 1e6, Real::asinh, f64::asinh, 3.0),
        ("acosh", 1.0, 1e6, Real::acosh, f64::acosh, 3.0),
        ("atanh", -0.999, 0.999, Real::atanh, f64::atanh, 3.0),
        (
            "inverse_sqrt",
            1e-37,
            1e37,
            Real::inverse_sqrt,
            |x| 1.0 / x.sqrt(),
            1.5,
        ),
        ("fract", -1e4, 1e4, Real::fract, |x| x - x.floor(), 0.5),
    ];
    let mut failed = Vec::new();
    for &(name, low, high, got, truth, bound) in rows {
        let worst = worst(low, high, got, truth);
        println!("{name:12} {worst:.2} ulp");
        if worst > bound {
            failed.push(format!("{name}: {worst:.2} > {bound}"));
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn pow_is_as_accurate_as_its_logarithm() {
    for x in samples(1e-4, 1e4).step_by(97) {
        for y in [-3.5f32, -1.0, 0.5, 1.0, 2.0, 2.2, 5.0, 32.0] {
            let truth = f64::from(x).powf(f64::from(y));
            if truth.abs() > 1e37 || truth.abs() < 1e-37 {
                continue;
            }
            // One rounding of y * log2(x), and two ulp of log2, all scaled by the exponent.
            let bound = 2.0 + 3.0 * (f64::from(y) * f64::from(x).log2()).abs();
            let got = Real::pow(x, y);
            assert!(
                ulps(got, truth) <= bound,
                "pow({x}, {y}) = {got}, not {truth}"
            );
        }
    }
}

#[test]
fn atan2_covers_the_circle() {
    for i in 0..720 {
        let angle = f64::from(i) * std::f64::consts::PI / 360.0 + 1e-3;
        let (y, x) = ((3.0 * angle.sin()) as f32, (3.0 * angle.cos()) as f32);
        let truth = f64::from(y).atan2(f64::from(x));
        assert!(ulps(Real::atan2(y, x), truth) < 4.0, "atan2({y}, {x})");
    }
    for (y, x) in [
        (0.0, 1.0),
        (0.0, -1.0),
        (-0.0, -1.0),
        (1.0, 0.0),
        (-1.0, 0.0),
        (0.0, 0.0),
    ] {
        let truth = f64::from(y).atan2(f64::from(x));
        assert!(ulps(Real::atan2(y, x), truth) < 2.0, "atan2({y}, {x})");
    }
    assert!(Real::is_nan(Real::atan2(f32::NAN, 1.0)));
}

#[test]
fn special_cases_of_floats() {
    let (inf, nan) = (f32::INFINITY, f32::NAN);
    let same = |got: f32, want: f32| {
        assert_eq!(words::bits(got), words::bits(want), "{got} is not {want}");
    };
    same(Real::min(nan, 2.0), 2.0);
    same(Real::min(2.0, nan), 2.0);
    same(Real::max(nan, 2.0), 2.0);
    same(Real::max(2.0, nan), 2.0);
    same(Real::min(-0.0, 0.0), -0.0);
    same(Real::saturate(nan), 0.0);
    same(Real::sign(nan), 0.0);
    same(Real::sign(-3.0), -1.0);
    same(Real::exp2(inf), inf);
    same(Real::exp2(-inf), 0.0);
    same(Real::exp2(nan), nan);
    same(Real::exp2(128.0), inf);
    same(Real::exp2(-149.0), f32::from_bits(1));
    same(Real::exp2(-151.0), 0.0);
    same(Real::exp(-inf), 0.0);
    same(Real::exp(inf), inf);
    same(Real::exp(0.0), 1.0);
    same(Real::log2(0.0), -inf);
    same(Real::log2(-0.0), -inf);
    same(Real::log2(-1.0), nan);
    same(Real::log2(inf), inf);
    same(Real::log2(nan), nan);
    same(Real::log2(f32::from_bits(1)), -149.0);
    for n in -126..128 {
        same(Real::exp2(n as f32), 2f32.powi(n));
        same(Real::log2(2f32.powi(n)), n as f32);
    }
    same(Real::pow(0.0, 2.0), 0.0);
    same(Real::pow(0.0, 0.0), 1.0);
    same(Real::pow(0.0, -1.0), inf);
    same(Real::pow(-2.0, 2.0), nan);
    same(Real::pow(5.0, 0.0), 1.0);
    same(Real::sin(-0.0), 0.0);
    same(Real::sin(inf), nan);
    same(Real::cos(nan), nan);
    assert!(Real::sin(1e30f32).abs() <= 1.0);
    same(Real::asin(1.5), nan);
    same(Real::acos(1.0), 0.0);
    same(Real::round(0.5), 0.0);
    same(Real::round(1.5), 2.0);
    same(Real::round(-2.5), -2.0);
    same(Real::rem(-5.5, 2.0), -1.5);
    same(Real::rem(5.5, -2.0), 1.5);
    same(Real::fract(-0.25), 0.75);
    same(Real::step(1.0, 1.0), 1.0);
    same(Real::step(1.0, 0.5), 0.0);
    same(Real::smooth_step(0.0, 2.0, 1.0), 0.5);
    same(Real::mix(2.0, 4.0, 0.25), 2.5);
    same(Real::ldexp(1.0, 127), 2f32.powi(127));
    same(Real::ldexp(f32::from_bits(1), 276), 2f32.powi(127));
    same(Real::ldexp(1.0, -149), f32::from_bits(1));
    assert_eq!(Real::frexp(8.0f32), (0.5, 4));
    assert_eq!(Real::frexp(-0.75f32), (-0.75, 0));
    assert_eq!(Real::frexp(f32::from_bits(1)), (0.5, -148));
    assert_eq!(Real::frexp(0.0f32), (0.0, 0));
    assert_eq!(Real::to_i32(3.9f32), 3);
    assert_eq!(Real::to_i32(-3.9f32), -3);
    assert_eq!(Real::to_i32(1e20f32), 2_147_483_520);
    assert_eq!(Real::to_i32(-1e20f32), i32::MIN);
    assert_eq!(Real::to_i32(nan), 0);
    assert_eq!(Real::to_u32(-1.0f32), 0);
    assert_eq!(Real::to_u32(1e20f32), 4_294_967_040);
    assert_eq!(Real::to_u32(nan), 0);
}

#[test]
fn halves_round_to_nearest_even() {
    // Every half survives the way there and back.
    for half in 0..0x1_0000u32 {
        let x = words::half_to_float(half);
        if x.is_nan() {
            assert!(half & 0x7FFF > 0x7C00);
        } else {
            assert_eq!(words::float_to_half(x), half, "{x}");
        }
    }
    assert_eq!(words::half_to_float(0x3C00), 1.0);
    assert_eq!(words::half_to_float(0x0001), 2f32.powi(-24));
    assert_eq!(words::half_to_float(0x7BFF), 65504.0);
    // Between two halves: to the nearer, and to the even one from the middle.
    for half in 0..0x7BFFu32 {
        let (a, b) = (words::half_to_float(half), words::half_to_float(half + 1));
        let middle = (a + b) / 2.0;
        assert_eq!(words::float_to_half(middle), half + (half & 1), "{middle}");
        let below = f32::from_bits(middle.to_bits() - 1);
        assert_eq!(words::float_to_half(below), half, "{below}");
    }
    assert_eq!(words::float_to_half(65519.9), 0x7BFF);
    assert_eq!(words::float_to_half(65520.0), 0x7C00);
    assert_eq!(words::float_to_half(f32::NEG_INFINITY), 0xFC00);
}

#[test]
fn integers_are_defined_everywhere() {
    let m = i32::MIN as u32;
    let minus = |x: i32| x as u32;
    let cases: &[(Op, &[u32], u32)] = &[
        (Op::AddWord, &[u32::MAX, 2], 1),
        (Op::MulWord, &[0x8000_0001, 2], 2),
        (Op::DivInt, &[7, 0], 7),
        (Op::DivInt, &[m, u32::MAX], m),
        (Op::DivInt, &[minus(-7), 2], minus(-3)),
        (Op::DivUint, &[7, 0], 7),
        (Op::RemInt, &[minus(-7), 2], minus(-1)),
        (Op::RemInt, &[m, u32::MAX], 0),
        (Op::RemInt, &[7, 0], 0),
        (Op::RemUint, &[7, 0], 0),
        (Op::AbsInt, &[m], m),
        (Op::SignInt, &[minus(-9)], minus(-1)),
        (Op::ShiftLeft, &[1, 33], 2),
        (Op::ShiftRightInt, &[m, 31], u32::MAX),
        (Op::ShiftRightUint, &[m, 31], 1),
        (Op::LessInt, &[minus(-1), 0], 1),
        (Op::LessUint, &[minus(-1), 0], 0),
        (Op::FirstTrailingBit, &[0], u32::MAX),
        (Op::FirstTrailingBit, &[8], 3),
        (Op::FirstLeadingBit, &[8], 3),
        (Op::FirstLeadingBitInt, &[minus(-1)], u32::MAX),
        (Op::FirstLeadingBitInt, &[minus(-9)], 3),
        (Op::CountLeadingZeros, &[0], 32),
        (Op::Extract, &[0xABCD, 4, 8], 0xBC),
        (Op::Extract, &[0xABCD_0000, 24, 32], 0xAB),
        (Op::Extract, &[1, 40, 3], 0),
        (Op::ExtractInt, &[0xABCD, 4, 8], minus(-0x44)),
        (Op::ExtractInt, &[0xABCD, 4, 0], 0),
        (Op::Field, &[4, 8], 0xFF0),
        (Op::Field, &[0, 32], u32::MAX),
        (Op::Field, &[32, 4], 0),
        (Op::FloatToBits, &[0xFFC0_1234], 0x7FC0_0000),
    ];
    for &(op, operands, want) in cases {
        assert_eq!(evaluate(op, operands), want, "{op:?} {operands:?}");
    }
}

fn vector(values: &[f32]) -> Constant {
    Constant {
        shape: Shape::Vector(values.len(), ScalarKind::Float),
        words: values.iter().map(|x| x.to_bits()).collect(),
    }
}

fn matrix(columns: usize, values: &[f32]) -> Constant {
    Constant {
        shape: Shape::Matrix {
            columns,
            rows: values.len() / columns,
        },
        words: values.iter().map(|x| x.to_bits()).collect(),
    }
}

fn scalar(x: f32) -> Constant {
    Constant::from_literal(Literal::F32(x)).unwrap()
}

fn floats(constant: Option<Constant>) -> Vec<f32> {
    let words = constant.expect("it folds").words;
    words.into_iter().map(f32::from_bits).collect()
}

#[test]
fn folds_vectors_and_matrices() {
    use MathFunction as M;
    let math = |fun, operands: &[Constant]| floats(fold(Operation::Math(fun), operands));
    let times = |a: Constant, b: Constant| {
        floats(fold(Operation::Binary(BinaryOperator::Multiply), &[a, b]))
    };
    let (a, b) = (vector(&[1.0, 2.0, 3.0]), vector(&[4.0, 5.0, 6.0]));
    assert_eq!(math(M::Dot, &[a.clone(), b.clone()]), [32.0]);
    assert_eq!(math(M::Cross, &[a.clone(), b.clone()]), [-3.0, 6.0, -3.0]);
    assert_eq!(math(M::Length, &[vector(&[3.0, 4.0])]), [5.0]);
    assert_eq!(
        math(M::Distance, &[vector(&[3.0, 4.0]), vector(&[0.0, 0.0])]),
        [5.0]
    );
    assert_eq!(math(M::Normalize, &[vector(&[0.0, 4.0])]), [0.0, 1.0]);
    assert_eq!(
        math(M::Reflect, &[vector(&[1.0, -1.0]), vector(&[0.0, 1.0])]),
        [1.0, 1.0]
    );
    let down = vector(&[0.0, -1.0]);
    let up = vector(&[0.0, 1.0]);
    assert_eq!(
        math(M::Refract, &[down.clone(), up.clone(), scalar(0.5)]),
        [0.0, -1.0]
    );
    assert_eq!(
        math(M::Refract, &[vector(&[0.8, -0.6]), up.clone(), scalar(2.0)]),
        [0.0, 0.0]
    );
    assert_eq!(
        math(M::FaceForward, &[up.clone(), up.clone(), down.clone()]),
        [0.0, 1.0]
    );
    assert_eq!(
        math(M::FaceForward, &[up.clone(), up.clone(), up.clone()]),
        [-0.0, -1.0]
    );
    assert_eq!(
        math(
            M::Mix,
            &[vector(&[0.0, 2.0]), vector(&[4.0, 4.0]), scalar(0.5)]
        ),
        [2.0, 3.0]
    );
    // Columns (1, 2), (3, 4), (5, 6).
    let m = matrix(3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(
        times(m.clone(), vector(&[1.0, 10.0, 100.0])),
        [531.0, 642.0]
    );
    assert_eq!(times(vector(&[1.0, 10.0]), m.clone()), [21.0, 43.0, 65.0]);
    assert_eq!(
        times(m.clone(), matrix(2, &[1.0, 0.0, 0.0, 0.0, 1.0, 1.0])),
        [1.0, 2.0, 8.0, 10.0]
    );
    assert_eq!(
        math(M::Transpose, std::slice::from_ref(&m)),
        [1.0, 3.0, 5.0, 2.0, 4.0, 6.0]
    );
    assert_eq!(
        math(M::Outer, &[vector(&[1.0, 2.0]), vector(&[3.0, 4.0, 5.0])]),
        [3.0, 6.0, 4.0, 8.0, 5.0, 10.0]
    );
    let m = matrix(3, &[1.0, 0.0, 0.0, 2.0, 1.0, 0.0, 3.0, 4.0, 1.0]);
    assert_eq!(math(M::Determinant, std::slice::from_ref(&m)), [1.0]);
    assert_eq!(
        times(m.clone(), fold(Operation::Math(M::Inverse), &[m]).unwrap()),
        [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    );
    let m = matrix(
        4,
        &[
            1., 0., 2., 3., 0., 1., 0., 0., 0., 0., 1., 0., 5., 0., 0., 1.,
        ],
    );
    assert_eq!(math(M::Determinant, std::slice::from_ref(&m)), [-14.0]);
}

#[test]
fn folds_packing() {
    use MathFunction as M;
    let word = |c: Option<Constant>| c.expect("it folds").words[0];
    let pack = |fun, values: &[f32]| word(fold(Operation::Math(fun), &[vector(values)]));
    let uint = |x| Constant::from_literal(Literal::U32(x)).unwrap();
    let unpack = |fun, x| floats(fold(Operation::Math(fun), &[uint(x)]));
    assert_eq!(pack(M::Pack4x8unorm, &[0.0, 1.0, 0.5, 2.0]), 0xFF80_FF00);
    assert_eq!(pack(M::Pack4x8snorm, &[0.0, 1.0, -1.0, -2.0]), 0x8181_7F00);
    assert_eq!(pack(M::Pack2x16float, &[1.0, -2.0]), 0xC000_3C00);
    assert_eq!(pack(M::Pack2x16unorm, &[0.0, 1.0]), 0xFFFF_0000);
    assert_eq!(unpack(M::Unpack4x8unorm, 0xFF00_0000), [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(
        unpack(M::Unpack4x8snorm, 0x0080_817F),
        [1.0, -1.0, -1.0, 0.0]
    );
    assert_eq!(unpack(M::Unpack2x16float, 0xC000_3C00), [1.0, -2.0]);
    let dot = |fun, a, b| word(fold(Operation::Math(fun), &[uint(a), uint(b)]));
    assert_eq!(dot(M::Dot4I8Packed, 0xFF02_0304, 0x0201_0101), 7);
    assert_eq!(dot(M::Dot4U8Packed, 0xFF02_0304, 0x0201_0101), 519);
    let insert = Operation::Math(M::InsertBits);
    let operands = [uint(0xFFFF_FFFF), uint(0x12), uint(4), uint(8)];
    assert_eq!(word(fold(insert, &operands)), 0xFFFF_F12F);
}

#[test]
fn declines_what_no_literal_can_hold() {
    let divide = Operation::Binary(BinaryOperator::Divide);
    assert_eq!(fold(divide, &[scalar(1.0), scalar(0.0)]), None);
    assert_eq!(
        fold(Operation::Math(MathFunction::Sqrt), &[scalar(-1.0)]),
        None
    );
    assert_eq!(
        fold(Operation::Math(MathFunction::Modf), &[scalar(1.5)]),
        None
    );
    assert_eq!(Constant::from_literal(Literal::F64(1.0)), None);
    let negate = Operation::Unary(UnaryOperator::Negate);
    assert_eq!(floats(fold(negate, &[scalar(1.0)])), [-1.0]);
}
