//! A lane that computes twice: in `f32`, as a GPU does, and beside it in `f64`, so that the two can be compared.
//!
//! All that decides (comparisons, minima, conversions to integers) follows the `f32`. So both take the same way, and where
//! they part is a matter of rounding alone.

use crate::lane::{LANES, Lane};
use lodc_passes::semantics::Real;

/// A number in `f32`, and what it would be in `f64`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Both {
    /// As a GPU has it.
    pub narrow: f32,
    /// The same computation in `f64` throughout, from the same inputs.
    pub wide: f64,
}

impl Both {
    /// How far the two are apart, as a share of the larger; 0 where both are 0, 1 at most where both are finite, infinite where
    /// only one is. What is below the smallest normal `f32` counts as 0.
    pub fn apart(self) -> f64 {
        let narrow = f64::from(self.narrow);
        let finite = [narrow.is_finite(), self.wide.is_finite()];
        match finite {
            [true, true] => {
                let larger = narrow.abs().max(self.wide.abs());
                match larger > f64::from(f32::MIN_POSITIVE) {
                    true => ((narrow - self.wide).abs() / larger).min(1.0),
                    false => 0.0,
                }
            }
            [false, false] => 0.0,
            _ => f64::INFINITY,
        }
    }

    fn map(self, narrow: impl Fn(f32) -> f32, wide: impl Fn(f64) -> f64) -> Self {
        Self {
            narrow: narrow(self.narrow),
            wide: wide(self.wide),
        }
    }

    fn with(
        self,
        other: Self,
        narrow: impl Fn(f32, f32) -> f32,
        wide: impl Fn(f64, f64) -> f64,
    ) -> Self {
        Self {
            narrow: narrow(self.narrow, other.narrow),
            wide: wide(self.wide, other.wide),
        }
    }
}

/// Methods that are a function of `f32` and one of `f64`.
macro_rules! alike {
    ($($name:ident: $wide:expr;)*) => {
        $(fn $name(self) -> Self {
            self.map(<f32 as Real>::$name, $wide)
        })*
    };
}

impl Real for Both {
    fn from_f32(x: f32) -> Self {
        Self {
            narrow: x,
            wide: x.into(),
        }
    }
    fn to_f32(self) -> f32 {
        self.narrow
    }
    fn from_i32(x: i32) -> Self {
        Self {
            narrow: x as f32,
            wide: x.into(),
        }
    }
    fn from_u32(x: u32) -> Self {
        Self {
            narrow: x as f32,
            wide: x.into(),
        }
    }
    fn to_i32(self) -> i32 {
        Real::to_i32(self.narrow)
    }
    fn to_u32(self) -> u32 {
        Real::to_u32(self.narrow)
    }

    fn lt(self, other: Self) -> bool {
        self.narrow < other.narrow
    }
    fn le(self, other: Self) -> bool {
        self.narrow <= other.narrow
    }
    fn eq(self, other: Self) -> bool {
        self.narrow == other.narrow
    }

    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b, |a, b| a + b)
    }
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b, |a, b| a - b)
    }
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b, |a, b| a * b)
    }
    fn div(self, other: Self) -> Self {
        self.with(other, |a, b| a / b, |a, b| a / b)
    }
    fn pow(self, exponent: Self) -> Self {
        let wide = |base: f64, exponent: f64| match (exponent == 0.0, base < 0.0) {
            (true, _) => 1.0,
            (false, true) => f64::NAN,
            (false, false) => libm::pow(base, exponent),
        };
        self.with(exponent, <f32 as Real>::pow, wide)
    }
    fn atan2(self, x: Self) -> Self {
        self.with(x, <f32 as Real>::atan2, libm::atan2)
    }
    alike! {
        neg: |x| -x;
        abs: f64::abs;
        floor: f64::floor;
        ceil: f64::ceil;
        round: f64::round_ties_even;
        trunc: f64::trunc;
        sqrt: f64::sqrt;
        exp2: libm::exp2;
        exp: libm::exp;
        log2: libm::log2;
        log: libm::log;
        sin: libm::sin;
        cos: libm::cos;
        tan: libm::tan;
        asin: libm::asin;
        acos: libm::acos;
        atan: libm::atan;
        sinh: libm::sinh;
        cosh: libm::cosh;
        tanh: libm::tanh;
        asinh: libm::asinh;
        acosh: libm::acosh;
        atanh: libm::atanh;
        quantize: |x| f64::from(Real::quantize(x as f32));
    }
    fn ldexp(self, exponent: i32) -> Self {
        self.map(
            |x| Real::ldexp(x, exponent),
            |x| libm::ldexp(x, exponent.clamp(-300, 300)),
        )
    }
    fn frexp(self) -> (Self, i32) {
        let (fraction, exponent) = Real::frexp(self.narrow);
        let wide = match self.wide.is_finite() {
            true => libm::ldexp(self.wide, -exponent),
            false => self.wide,
        };
        let both = Self {
            narrow: fraction,
            wide,
        };
        (both, exponent)
    }
}

impl Lane for Both {
    fn floats<'a>(block: &'a [Self; LANES], scratch: &'a mut [f32; LANES]) -> &'a [f32; LANES] {
        for (narrow, both) in scratch.iter_mut().zip(block) {
            *narrow = both.narrow;
        }
        scratch
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::Mask;
    use crate::machine::{Bindings, Machine, Outcome, Watcher};
    use crate::program::Program;
    use lodc_passes::semantics::Op;

    /// The farthest that the two were apart after each kind of operation.
    #[derive(Debug, Default)]
    struct Farthest(Vec<(Op, u32, f64)>);

    impl Watcher<Both> for Farthest {
        fn done(
            &mut self,
            op: Op,
            origin: u32,
            lanes: Option<Mask>,
            _: &[[Both; LANES]],
            outcome: Outcome<'_, Both>,
        ) {
            if let (Outcome::Floats(floats), Some(lanes)) = (outcome, lanes) {
                let apart = lanes.lanes().map(|lane| floats[lane].apart());
                self.0.push((op, origin, apart.fold(0.0, f64::max)));
            }
        }
    }

    #[test]
    fn a_cancelled_difference_is_where_the_digits_are_lost() {
        let text = "@fragment fn fs_main(@location(0) x: f32) -> @location(0) vec4f {
            let near = sqrt(1.0 + x * x);
            let lost = near - 1.0;
            return vec4f(lost);
        }";
        let module = naga::front::wgsl::parse_str(text).expect("it is valid");
        let program = Program::compile(&module, 0, &[]).expect("it runs");
        let mut inputs = [[0_u32; LANES]];
        for (lane, word) in inputs[0].iter_mut().enumerate() {
            *word = (1e-3 + lane as f32 * 1e-6).to_bits();
        }
        let bindings = Bindings::new();
        let mut farthest = Farthest::default();
        let mut outputs = [[0; LANES]; 4];
        let mut machine = Machine::watched(&program, &bindings, 0, Some(&mut farthest));
        machine.run(&inputs, Mask::ALL, Mask::ALL, &mut outputs);
        drop(machine);
        let of = |op| {
            let mut all = farthest.0.iter();
            all.find(|(known, ..)| *known == op).expect("it was done")
        };
        assert!(of(Op::Mul).2 < 1e-7 && of(Op::Sqrt).2 < 1e-6);
        assert!(of(Op::Sub).2 > 0.01, "{farthest:?}");
        let names = &module.entry_points[0].function.named_expressions;
        let named = |at: u32| names.iter().find(|(h, _)| h.index() as u32 == at);
        let lost = named(of(Op::Sub).1).expect("it is named");
        assert_eq!(lost.1, "lost");
        // The same bits come out as without anybody who watches.
        let mut plain = [[0; LANES]; 4];
        Machine::new(&program, &bindings).run(&inputs, Mask::ALL, Mask::ALL, &mut plain);
        assert_eq!(plain, outputs);
    }
}
