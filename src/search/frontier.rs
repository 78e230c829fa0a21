//! The Pareto frontier of error against cost over every variant that was seen. The error is the share of its bound
//! that a variant uses up, where it uses up most.

use lodc_passes::Recipe;

/// A variant as the search saw it: its derivation, its error and its cost on the search set.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// How it is made from the original.
    pub recipe: Recipe,
    /// `E^2` on the search set.
    pub square: f64,
    /// How much of its bound it uses up there; feasible when at most 1.
    pub strain: f64,
    /// What it costs by the goal, as [`super::Measured::cost`] has it.
    pub cost: f64,
}

/// How many feasible variants are remembered beside the members.
const NEAR: usize = 1024;

/// The members that no other member beats in both error and cost, cheapest first.
#[derive(Clone, Debug, Default)]
pub struct Frontier {
    members: Vec<Seen>,
    /// What is feasible and costs least, members or not, where that is wanted.
    near: Option<Vec<Seen>>,
}

impl Frontier {
    /// A frontier that remembers what is beaten, too: by another measure of cost it may not be.
    pub(super) fn with_near() -> Self {
        Self {
            near: Some(Vec::new()),
            ..Self::default()
        }
    }

    /// Adds a variant, unless a member is at least as good in both, and drops those that it beats.
    pub fn add(&mut self, seen: Seen) {
        let cost = seen.cost;
        if !(seen.strain.is_finite() && cost.is_finite()) {
            return;
        }
        if let Some(near) = &mut self.near
            && seen.strain <= 1.0
        {
            near.push(seen.clone());
            if near.len() > 2 * NEAR {
                near.sort_by(|a, b| a.cost.total_cmp(&b.cost));
                near.truncate(NEAR);
            }
        }
        // Members are sorted by cost up, and so by error down.
        let at = self.members.partition_point(|member| member.cost <= cost);
        if at > 0 && self.members[at - 1].strain <= seen.strain {
            return;
        }
        let same_cost = self.members[..at]
            .iter()
            .rposition(|member| member.cost < cost)
            .map_or(0, |last| last + 1);
        let beaten = self.members[at..]
            .iter()
            .take_while(|member| member.strain >= seen.strain)
            .count();
        self.members.splice(same_cost..at + beaten, [seen]);
    }

    /// The members, cheapest first.
    pub fn members(&self) -> &[Seen] {
        &self.members
    }

    /// What it remembers of what is feasible, in no order that means anything.
    pub(super) fn near(&self) -> &[Seen] {
        self.near.as_deref().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(cost: f64, strain: f64) -> Seen {
        Seen {
            recipe: Recipe::default(),
            square: strain,
            strain,
            cost,
        }
    }

    #[test]
    fn keeps_exactly_the_members_that_nothing_beats() {
        let points = [
            (5.0, 5.0),
            (3.0, 6.0),
            (3.0, 4.0),
            (9.0, 1.0),
            (9.0, 0.5),
            (4.0, 4.0),
            (1.0, 9.0),
            (2.0, 9.0),
            (6.0, f64::NAN),
            (10.0, 0.0),
        ];
        let mut frontier = Frontier::default();
        for (cost, square) in points {
            frontier.add(seen(cost, square));
        }
        let found: Vec<_> = frontier
            .members()
            .iter()
            .map(|m| (m.cost, m.strain))
            .collect();
        assert_eq!(found, [(1.0, 9.0), (3.0, 4.0), (9.0, 0.5), (10.0, 0.0)]);
    }
}
