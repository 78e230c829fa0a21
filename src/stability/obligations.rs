//! Obligations: operations that are not defined everywhere, and how far their operands are from where they are not.
//!
//! A margin is a number that is above 0 where an operation is safe, and 0 or less where it is in trouble. It falls on the way
//! there, so that a search can go down on it; margins of different operations are not compared.

use crate::eval::lane::{LANES, Mask};
use crate::eval::machine::{Outcome, Watcher};
use crate::eval::rough::Rough;
use crate::eval::shadow::Both;
use lodc_passes::semantics::Op;
use std::collections::{BTreeMap, BTreeSet};

/// Which operation of which value: the place of its expression in the entry point's function.
pub(crate) type Place = (u32, Op);

/// Where the exponential of a number overflows.
const MOST_EXPONENT: f64 = 88.722_83;
/// The same of a power of two.
const MOST_POWER: f64 = 128.0;

/// How far operands are from trouble; nothing for operations that are defined everywhere.
pub(crate) fn margin(op: Op, [a, b, c]: [f32; 3]) -> Option<f64> {
    let [x, y, _] = [a, b, c].map(f64::from);
    Some(match op {
        // 0 / 0 and what overflows.
        Op::Div | Op::Rem => y.abs().min(1e30) - x.abs() / f64::from(f32::MAX),
        Op::SmoothStep => (y - x).abs(),
        Op::Sqrt | Op::Log | Op::Log2 | Op::InverseSqrt => x,
        Op::Pow => match b {
            0.0 => return None,
            _ => x.min((MOST_POWER - y * x.max(0.0).log2()) / MOST_POWER),
        },
        Op::Exp => MOST_EXPONENT - x,
        Op::Exp2 => MOST_POWER - x,
        Op::Tan => x.cos().abs(),
        Op::Asin | Op::Acos | Op::Atanh => 1.0 - x.abs(),
        Op::Acosh => x - 1.0,
        Op::FloatToInt => (f64::from(i32::MAX) - x.abs()) / f64::from(i32::MAX),
        Op::FloatToUint => {
            let span = f64::from(u32::MAX);
            x.min(span - x) / span
        }
        _ => return None,
    })
}

/// How far an index is from the end of what it is of, as a share of that. `last` is the last that is there.
pub(crate) fn margin_of_index(index: f32, last: f32) -> f64 {
    let [index, last] = [index, last].map(f64::from);
    // A negative one is a large unsigned one.
    (last + 1.0 - index) / (last + 1.0)
}

/// What a sum or difference keeps of the digits of its operands, beyond one rounding, where they cancel; nothing where
/// they do not.
pub(crate) fn margin_of_digits(op: Op, [a, b, _]: [f32; 3]) -> Option<f64> {
    let [x, y] = [a, b].map(f64::from);
    let result = match op {
        Op::Add => x + y,
        Op::Sub => x - y,
        _ => return None,
    };
    let larger = x.abs().max(y.abs());
    let cancels = result.abs() < larger && larger > f64::from(f32::MIN_POSITIVE);
    cancels.then(|| result.abs() / larger - f64::from(f32::EPSILON))
}

/// Whether its operands may cancel.
pub(crate) fn is_sum(op: Op) -> bool {
    matches!(op, Op::Add | Op::Sub)
}

/// What an operation is called, and what it wants of its operands.
pub(crate) fn wants(op: Op) -> (&'static str, &'static str) {
    match op {
        Op::Div => ("a division", "a divisor that is not 0"),
        Op::Rem => ("a remainder", "a divisor that is not 0"),
        Op::SmoothStep => ("`smoothstep`", "edges that are not the same"),
        Op::Sqrt => ("`sqrt`", "a number of 0 or more"),
        Op::InverseSqrt => ("`inverseSqrt` or `normalize`", "a number above 0"),
        Op::Log | Op::Log2 => ("a logarithm", "a number above 0"),
        Op::Pow => ("`pow`", "a base of 0 or more"),
        Op::Exp | Op::Exp2 => ("an exponential", "an exponent that does not overflow"),
        Op::Tan => ("`tan`", "an angle away from its poles"),
        Op::Asin | Op::Acos => ("an arc sine or cosine", "a number of -1 to 1"),
        Op::Atanh => ("`atanh`", "a number between -1 and 1"),
        Op::Acosh => ("`acosh`", "a number of 1 or more"),
        Op::FloatToInt | Op::FloatToUint => {
            ("a conversion", "a number that the integer's type holds")
        }
        Op::Add | Op::Sub | Op::Mul | Op::Fma | Op::Mix => {
            ("an operation", "a result that does not overflow")
        }
        _ => ("an operation", "operands that are finite"),
    }
}

/// The least margin of each operation, with the lane that had it.
#[derive(Debug, Default)]
pub(crate) struct Margins {
    pub(crate) least: BTreeMap<Place, Least>,
    /// The expressions that have an index.
    indexed: BTreeSet<u32>,
}

impl Margins {
    pub(crate) fn of(indexed: &BTreeSet<u32>) -> Self {
        Self {
            least: BTreeMap::new(),
            indexed: indexed.clone(),
        }
    }
}

/// The least margin of an operation in a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Least {
    pub(crate) margin: f64,
    pub(crate) lane: usize,
}

impl Watcher<f32> for Margins {
    fn done(
        &mut self,
        op: Op,
        origin: u32,
        lanes: Option<Mask>,
        operands: &[[f32; LANES]],
        _: Outcome<'_, f32>,
    ) {
        let is_index = op == Op::MinUint && self.indexed.contains(&origin);
        let of_three = |three: [f32; 3]| match op {
            Op::MinUint if is_index => Some(margin_of_index(three[0], three[1])),
            Op::Add | Op::Sub => margin_of_digits(op, three),
            _ => margin(op, three),
        };
        if !is_index && !is_sum(op) && margin(op, [1.0; 3]).is_none() {
            return;
        }
        let one = Mask([1, 0, 0, 0]);
        for lane in lanes.unwrap_or(one).lanes() {
            let of = |place: usize| operands.get(place).map_or(0.0, |block| block[lane]);
            let three = [of(0), of(1), of(2)];
            // What is no number came from an operation before.
            let Some(margin) = of_three(three).filter(|margin| !margin.is_nan()) else {
                continue;
            };
            let least = self.least.entry((origin, op)).or_insert(Least {
                margin: f64::INFINITY,
                lane,
            });
            if margin < least.margin {
                *least = Least { margin, lane };
            }
        }
    }
}

/// The operation that was the first to be in trouble in one lane, with its operands.
#[derive(Debug)]
pub(crate) struct First {
    lane: usize,
    pub(crate) found: Option<(Place, [f32; 3], f32)>,
    /// What roughens the result before it is looked at.
    pub(crate) rough: Rough,
}

impl First {
    pub(crate) fn new(lane: usize, rough: Rough) -> Self {
        Self {
            lane,
            found: None,
            rough,
        }
    }
}

impl Watcher<f32> for First {
    fn done(
        &mut self,
        op: Op,
        origin: u32,
        lanes: Option<Mask>,
        operands: &[[f32; LANES]],
        outcome: Outcome<'_, f32>,
    ) {
        let Outcome::Floats(floats) = outcome else {
            return;
        };
        if !self.rough.is_plain() {
            let floats = Outcome::Floats(&mut *floats);
            self.rough.done(op, origin, lanes, operands, floats);
        }
        let lane = match lanes {
            Some(lanes) if !lanes.has(self.lane) => return,
            Some(_) => self.lane,
            None => 0,
        };
        let finite = operands.iter().all(|block| block[lane].is_finite());
        if finite && !floats[lane].is_finite() && self.found.is_none() {
            let of = |place: usize| operands.get(place).map_or(0.0, |block| block[lane]);
            self.found = Some(((origin, op), [of(0), of(1), of(2)], floats[lane]));
        }
    }
}

/// What one operation gave in one lane in both precisions, and where digits were lost on the way.
#[derive(Debug)]
pub(crate) struct Digits {
    lane: usize,
    /// The operation that is asked for; the first time that it gave what is not finite counts, else the last.
    of: Place,
    pub(crate) value: Option<Both>,
    /// The operation whose result was farther off than its operands by the most, how far those were off and how far it was.
    pub(crate) lost: Option<(Place, f64, f64)>,
}

impl Digits {
    pub(crate) fn new(lane: usize, of: Place) -> Self {
        Self {
            lane,
            of,
            value: None,
            lost: None,
        }
    }
}

impl Watcher<Both> for Digits {
    fn done(
        &mut self,
        op: Op,
        origin: u32,
        lanes: Option<Mask>,
        operands: &[[Both; LANES]],
        outcome: Outcome<'_, Both>,
    ) {
        let Outcome::Floats(floats) = outcome else {
            return;
        };
        let lane = match lanes {
            Some(lanes) if !lanes.has(self.lane) => return,
            Some(_) => self.lane,
            None => 0,
        };
        if (origin, op) == self.of && self.value.is_none_or(|v| v.narrow.is_finite()) {
            self.value = Some(floats[lane]);
        }
        let before = operands.iter().map(|block| block[lane].apart());
        let before = before.fold(0.0, f64::max);
        let after = floats[lane].apart();
        if after.is_finite() && before.is_finite() {
            let grown = |before: f64, after: f64| after / before.max(1e-9);
            let most = self
                .lost
                .map_or(0.0, |(_, before, after)| grown(before, after));
            if after > 1e-4 && grown(before, after) > most {
                self.lost = Some(((origin, op), before, after));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margins_fall_on_the_way_to_trouble_and_end_where_it_begins() {
        let cases: [(Op, [f32; 3], [f32; 3]); 8] = [
            (Op::Div, [1.0, 1e-3, 0.0], [0.0, 0.0, 0.0]),
            (Op::Sqrt, [0.5, 0.0, 0.0], [-1e-9, 0.0, 0.0]),
            (Op::InverseSqrt, [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]),
            (Op::Acos, [0.5, 0.0, 0.0], [1.000_000_1, 0.0, 0.0]),
            (Op::Pow, [0.5, 5.0, 0.0], [-1e-9, 5.0, 0.0]),
            (Op::Exp, [1.0, 0.0, 0.0], [89.0, 0.0, 0.0]),
            (Op::FloatToUint, [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            (Op::Log, [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ];
        for (op, safe, trouble) in cases {
            let [safe, trouble] = [safe, trouble].map(|three| margin(op, three));
            assert!(safe > Some(0.0) && trouble <= Some(0.0), "{op:?}");
        }
        let [inside, last, beyond] = [1.0, 3.0, 4.0].map(|index| margin_of_index(index, 3.0));
        assert!(inside > last && last > 0.0 && beyond <= 0.0);
        // The words of -1.
        assert!(margin_of_index(u32::MAX as f32, 3.0) < beyond);
        let digits = |op, a, b| margin_of_digits(op, [a, b, 0.0]);
        let [some, few] = [0.5, 1.0 - 1e-6].map(|x| digits(Op::Sub, 1.0, x));
        assert!(some > few && few > Some(0.0));
        assert!(digits(Op::Add, 1.0, -1.0) <= Some(0.0));
        assert_eq!(digits(Op::Add, 1.0, 0.5), None);
        assert_eq!(margin(Op::Mul, [0.0; 3]), None);
        assert_eq!(margin(Op::Pow, [-1.0, 0.0, 0.0]), None);
    }
}
