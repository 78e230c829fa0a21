//! Thresholds and pairs at once: which pair is used in each bin of distances.
//!
//! The paper finds the fastest pairs at a few distances, then the smoothest path through them, then leaves out levels. Each step is
//! bound by the one before: a pair that is a little slower everywhere but never has to be switched is gone by then, and a threshold is
//! never between two of the distances. Here all distances are cut into bins, and one dynamic program over bins and pairs finds what
//! makes least of
//!
//! ```text
//! J = mean time over the distribution of distances + transition x sum of what transitions show + switch x number of switches
//! ```
//!
//! exactly, in O(bins x pairs^2). The paper's choice and the fastest pair of each bin are plans like any other, so that their J is
//! comparable, and never less.
//!
//! This work is based on: Liang 2022, section 6, whose three steps it does in one.

/// What transitions and switches cost, in units of the original's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prices {
    /// For each unit of transition error: the paper's eq. 5 as a root mean square, 0..1.
    pub transition: f64,
    /// For each switch: a level more to store and to bind.
    pub switch: f64,
}

impl Default for Prices {
    /// A transition that shows 0.04 is worth 1 % of the original's time, and any switch as much.
    fn default() -> Self {
        Self {
            transition: 0.25,
            switch: 0.01,
        }
    }
}

/// What a plan comes to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// The mean time over the distribution of distances, as a share of the original's.
    pub time: f64,
    /// The sum of what transitions show.
    pub transition: f64,
    /// How often one pair takes the place of another.
    pub switches: usize,
    /// All together, by the prices.
    pub j: f64,
}

/// What there is to choose from. A plan says for each bin, the nearest first, which pair is used in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// How much of the time the object is seen in each bin; sums to anything above 0.
    pub shares: Vec<f64>,
    /// For each bin the time of each pair there, as a share of the original's.
    pub times: Vec<Vec<f64>>,
    /// For each bin whether a pair may be used in it.
    pub allowed: Vec<Vec<bool>>,
    /// What transitions and switches cost.
    pub prices: Prices,
}

impl Choice {
    fn share(&self, bin: usize) -> f64 {
        self.shares[bin] / self.shares.iter().sum::<f64>()
    }

    /// What a switch costs that shows so much.
    fn switch(&self, shows: f64) -> f64 {
        self.prices.transition * shows + self.prices.switch
    }

    /// What a plan comes to. `transition` says what is seen where, at the beginning of a bin, a pair is replaced by another.
    pub fn score(&self, plan: &[usize], transition: impl Fn(usize, usize, usize) -> f64) -> Score {
        let bins = plan.iter().enumerate();
        let time: f64 = bins
            .map(|(bin, pair)| self.share(bin) * self.times[bin][*pair])
            .sum();
        let pairs = (1..).zip(plan.windows(2));
        let switched = pairs.filter(|(_, pair)| pair[0] != pair[1]);
        let shown: Vec<f64> = switched
            .map(|(bin, pair)| transition(bin, pair[0], pair[1]))
            .collect();
        Score {
            time,
            transition: shown.iter().sum(),
            switches: shown.len(),
            j: time + shown.iter().map(|shows| self.switch(*shows)).sum::<f64>(),
        }
    }

    /// The plan whose J is least; of equal ones that with the earlier pairs in the later bins. Nothing where a bin has no pair
    /// that may be used.
    pub fn best(&self, transition: impl Fn(usize, usize, usize) -> f64) -> Option<Vec<usize>> {
        let pairs = self.times.first().map_or(0, Vec::len);
        let mut sums = vec![0.0; pairs];
        let mut before: Vec<Vec<usize>> = Vec::with_capacity(self.times.len());
        for (bin, times) in self.times.iter().enumerate() {
            let mut next = vec![f64::INFINITY; pairs];
            let mut came: Vec<usize> = (0..pairs).collect();
            for to in (0..pairs).filter(|pair| self.allowed[bin][*pair]) {
                // To stay comes first, so that what costs the same is not switched.
                let mut least = sums[to];
                for from in (0..pairs).filter(|from| bin > 0 && *from != to) {
                    // What cannot be better need not be looked at.
                    if sums[from] + self.prices.switch >= least {
                        continue;
                    }
                    let sum = sums[from] + self.switch(transition(bin, from, to));
                    if sum < least {
                        (least, came[to]) = (sum, from);
                    }
                }
                next[to] = least + self.share(bin) * times[to];
            }
            before.push(came);
            sums = next;
        }
        let mut at = first_least(&sums)?;
        let mut plan = Vec::with_capacity(before.len());
        for came in before.iter().rev() {
            plan.push(at);
            at = came[at];
        }
        plan.reverse();
        Some(plan)
    }

    /// The plan with the fastest pair of each bin. Nothing where a bin has none that may be used.
    pub fn fastest(&self) -> Option<Vec<usize>> {
        let bins = self.times.iter().zip(&self.allowed);
        bins.map(|(times, allowed)| {
            let times = times.iter().zip(allowed);
            let times: Vec<f64> = times
                .map(|(time, allowed)| if *allowed { *time } else { f64::INFINITY })
                .collect();
            first_least(&times)
        })
        .collect()
    }

    /// The plan that uses each pair from a bin on, which rise, until the next one; the first one from the start.
    pub fn plan_of(&self, levels: &[(usize, usize)]) -> Option<Vec<usize>> {
        let first = levels.first()?;
        let bins = 0..self.times.len();
        let plan = bins.map(|bin| {
            let begun = levels.iter().rev().find(|(from, _)| *from <= bin);
            begun.unwrap_or(first).1
        });
        Some(plan.collect())
    }
}

/// The place of the least of what is finite, the first of equal ones.
fn first_least(values: &[f64]) -> Option<usize> {
    let mut least: Option<usize> = None;
    for (at, value) in values.iter().enumerate() {
        let is_less = least.is_none_or(|least| *value < values[least]);
        if value.is_finite() && is_less {
            least = Some(at);
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn random_choice(random: &mut Random) -> (Choice, impl Fn(usize, usize, usize) -> f64) {
        let (bins, pairs) = (1 + random.below(5), 1 + random.below(4));
        let numbers = |random: &mut Random, count: usize| -> Vec<f64> {
            (0..count).map(|_| random.unit()).collect()
        };
        let prices = Prices {
            transition: random.unit(),
            switch: 0.2 * random.unit(),
        };
        let choice = Choice {
            shares: numbers(random, bins),
            times: (0..bins).map(|_| numbers(random, pairs)).collect(),
            // The first one, the original, always.
            allowed: (0..bins)
                .map(|_| (0..pairs).map(|p| p == 0 || random.unit() < 0.7).collect())
                .collect(),
            prices,
        };
        let shown = numbers(random, bins * 16);
        (choice, move |bin, a, b| 0.3 * shown[bin * 16 + a * 4 + b])
    }

    fn all_plans(choice: &Choice) -> Vec<Vec<usize>> {
        let mut plans = vec![Vec::new()];
        for allowed in &choice.allowed {
            let pairs = (0..allowed.len()).filter(|pair| allowed[*pair]);
            let pairs: Vec<usize> = pairs.collect();
            let longer = plans.iter().flat_map(|plan: &Vec<usize>| {
                pairs
                    .iter()
                    .map(move |pair| [plan.as_slice(), &[*pair]].concat())
            });
            plans = longer.collect();
        }
        plans
    }

    #[test]
    fn no_plan_that_is_allowed_comes_to_less() {
        let mut random = Random(11);
        for _ in 0..300 {
            let (choice, transition) = random_choice(&mut random);
            let best = choice.best(&transition).expect("the original may be used");
            let j = choice.score(&best, &transition).j;
            let plans = all_plans(&choice);
            assert!(plans.contains(&best));
            for plan in plans {
                let other = choice.score(&plan, &transition).j;
                assert!(j <= other + 1e-12, "{best:?} {j} {plan:?} {other}");
            }
        }
    }

    #[test]
    fn without_prices_the_fastest_of_each_bin_is_best() {
        let mut random = Random(5);
        for _ in 0..100 {
            let (mut choice, transition) = random_choice(&mut random);
            choice.prices = Prices {
                transition: 0.0,
                switch: 0.0,
            };
            let [best, fastest] = [choice.best(&transition), choice.fastest()]
                .map(|plan| choice.score(&plan.expect("one"), &transition).time);
            assert!((best - fastest).abs() < 1e-12);
        }
    }

    #[test]
    fn a_switch_that_gains_less_than_it_costs_is_not_made() {
        let choice = |gain: f64| Choice {
            shares: vec![1.0, 1.0],
            times: vec![vec![0.5, 0.7], vec![0.5, 0.5 - gain]],
            allowed: vec![vec![true, true]; 2],
            prices: Prices {
                transition: 1.0,
                switch: 0.02,
            },
        };
        // Half of the time is spent there; the switch costs 0.02 and shows 0.03.
        let best = |gain| choice(gain).best(|_, _, _| 0.03);
        assert_eq!(best(0.09), Some(vec![0, 0]));
        assert_eq!(best(0.11), Some(vec![0, 1]));
    }

    #[test]
    fn levels_are_plans_and_what_may_not_be_used_is_none() {
        let choice = Choice {
            shares: vec![1.0; 4],
            times: vec![vec![1.0, 0.5, 0.2]; 4],
            allowed: vec![
                vec![true, false, false],
                vec![true, true, false],
                vec![true, true, false],
                vec![true, true, true],
            ],
            prices: Prices {
                transition: 1.0,
                switch: 0.02,
            },
        };
        assert_eq!(choice.fastest(), Some(vec![0, 1, 1, 2]));
        assert_eq!(
            choice.plan_of(&[(0, 0), (2, 1), (3, 2)]),
            Some(vec![0, 0, 1, 2])
        );
        assert_eq!(choice.plan_of(&[]), None);
        let score = choice.score(&[0, 0, 1, 2], |_, _, _| 0.01);
        assert_eq!((score.time, score.switches), (2.7 / 4.0, 2));
        assert!((score.j - (0.675 + 2.0 * 0.03)).abs() < 1e-12);
        let none = Choice {
            allowed: vec![vec![false; 3]; 4],
            ..choice
        };
        assert_eq!((none.best(|_, _, _| 0.0), none.fastest()), (None, None));
    }
}
