//! A smooth texture as a short sum of functions of its coordinates.

use crate::Facts;
use crate::basis::{Basis, Lobe};
use crate::cost::SAMPLE_WEIGHT;
use crate::edit::{Edit, floats};
use crate::facts::{Fit, TextureFacts, ValueFacts};
use crate::flow::{Flow, Value};
use crate::operands::User;
use crate::recipe::{Candidate, Declined};
use crate::shader::{Shader, Stage};
use naga::{BinaryOperator, Expression, MathFunction};

/// The part of a texture's variance that a fit may leave, above which the mean does nearly as well, for less; and the part of
/// what a simpler fit leaves that a better one may leave. Surroundings are mostly read blurred, and from one side, so that
/// lamps in them that no harmonics follow may not matter.
fn limits(basis: Basis) -> (f64, f64) {
    match basis {
        Basis::Polynomial(_) => (0.5, 0.7),
        Basis::Harmonics(_) | Basis::Lights(_) => (0.9, 0.9),
    }
}

/// How many numbers say where a light is; they stand behind the factors.
const LOBE: usize = 3;

/// A sum as a candidate bakes it.
pub(super) struct Sum {
    read: Value,
    basis: Basis,
    coordinates: Value,
    /// For each function its numbers, one for each component that is used.
    numbers: Vec<Vec<f32>>,
    /// Where its lights are.
    lobes: Vec<Lobe>,
    /// How many components the read returns.
    returned: usize,
}

impl Sum {
    /// Reads the numbers of a candidate at a read.
    pub(super) fn new(
        flow: &Flow,
        read: Value,
        basis: Basis,
        candidate: &Candidate,
    ) -> Result<Self, Declined> {
        let coordinates = coordinates(flow, read, basis)?;
        let used = used(flow, read);
        let factors = basis.count() * used;
        let numbers = candidate.baked(factors + LOBE * basis.lights())?;
        let (factors, lobes) = numbers.split_at(factors);
        let (lobes, _) = lobes.as_chunks::<LOBE>();
        Ok(Self {
            read,
            basis,
            coordinates,
            numbers: factors.chunks(used).map(<[f32]>::to_vec).collect(),
            lobes: lobes.to_vec(),
            returned: flow.floats(read).unwrap_or(used),
        })
    }

    /// Adds the values that compute it, and gives the last one.
    pub(super) fn write(&self, shader: &Shader, edit: &mut Edit) -> Value {
        let path = format!("{}.smooth", shader.id(Stage::Fragment, self.read).path());
        let functions = self.basis.write(edit, &path, self.coordinates, &self.lobes);
        let binary = |op, left, right| Expression::Binary { op, left, right };
        let mut sum = edit.add_numbers(&path, &self.numbers[0]);
        for (function, numbers) in functions.into_iter().zip(&self.numbers[1..]) {
            let numbers = edit.add_numbers(&path, numbers);
            let term = binary(BinaryOperator::Multiply, numbers, function);
            let term = edit.add(format!("{path}.term"), term);
            sum = edit.add(
                format!("{path}.sum"),
                binary(BinaryOperator::Add, sum, term),
            );
        }
        let used = self.numbers[0].len();
        let nothing = edit.add_numbers(&path, &vec![0.0; used]);
        let positive = Expression::Math {
            fun: MathFunction::Max,
            arg: sum,
            arg1: Some(nothing),
            arg2: None,
            arg3: None,
        };
        let value = edit.add(path.clone(), positive);
        if used == self.returned {
            return value;
        }
        let ty = edit.ty(floats(self.returned));
        let rest = (used..self.returned).map(|_| edit.add_numbers(&path, &[0.0]));
        let components = std::iter::once(value)
            .chain(rest.collect::<Vec<_>>())
            .collect();
        edit.add(
            format!("{path}.whole"),
            Expression::Compose { ty, components },
        )
    }
}

/// The sums that a read may become, each with its numbers or why it does not.
pub(super) fn listed(
    flow: &Flow,
    facts: &Facts,
    texture: &TextureFacts,
    read: Value,
) -> Vec<(Basis, Result<Vec<f32>, Declined>)> {
    let mut simpler = 1.0;
    let mut found = Vec::new();
    for fit in &texture.fits {
        // What is not smooth is not thought of.
        let (most, better) = limits(fit.basis);
        if fit.left > most.min(better * simpler) || coordinates(flow, read, fit.basis).is_err() {
            continue;
        }
        if fit.basis.work(used(flow, read)) >= SAMPLE_WEIGHT {
            let why = "it would cost as much as the sample".into();
            found.push((fit.basis, Err(Declined(why))));
            continue;
        }
        simpler = fit.left;
        found.push((fit.basis, numbers(flow, facts, fit, read)));
    }
    found
}

fn numbers(flow: &Flow, facts: &Facts, fit: &Fit, read: Value) -> Result<Vec<f32>, Declined> {
    let seen = |value: Value| facts.values.get(flow.id(value));
    let below = |seen: &ValueFacts| !seen.min.iter().all(|min| *min >= 0.0);
    match seen(read) {
        None => return Err(Declined("no sample saw it".into())),
        Some(read) if below(read) => {
            return Err(Declined("it is seen below 0, where no sum goes".into()));
        }
        Some(_) => {}
    }
    let outside = |seen: &ValueFacts| below(seen) || !seen.max.iter().all(|max| *max <= 1.0);
    if let Basis::Polynomial(_) = fit.basis
        && seen(coordinates(flow, read, fit.basis)?).is_none_or(outside)
    {
        return Err(Declined(
            "its coordinates are seen outside 0..1, where it repeats or ends".into(),
        ));
    }
    let used = used(flow, read);
    let numbers = fit
        .numbers
        .iter()
        .flat_map(|of_function| of_function[..used].to_vec());
    let numbers = numbers.chain(fit.lobes.iter().flatten().copied());
    let numbers: Vec<f32> = numbers.collect();
    match numbers.iter().all(|number| number.is_finite()) {
        true => Ok(numbers),
        false => Err(Declined(
            "its texture holds numbers that are not finite".into(),
        )),
    }
}

/// The coordinates of a read that a basis is of.
fn coordinates(flow: &Flow, read: Value, basis: Basis) -> Result<Value, Declined> {
    match flow.function.expressions[read] {
        Expression::ImageSample {
            coordinate,
            array_index: None,
            gather: None,
            depth_ref: None,
            ..
        } if flow.floats(coordinate) == Some(basis.coordinates()) => Ok(coordinate),
        _ => Err(Declined(format!(
            "it is no sample of a texture at {} coordinates",
            basis.coordinates()
        ))),
    }
}

/// How many components of a read are used, from the first one on.
fn used(flow: &Flow, read: Value) -> usize {
    let all = flow.floats(read).unwrap_or(1);
    let users = flow.shader.users(Stage::Fragment, read).iter();
    let of_user = |user: &User| match *user {
        User::Statement(_) => all,
        User::Value(user) => match flow.function.expressions[user] {
            Expression::AccessIndex { index, .. } => index as usize + 1,
            Expression::Swizzle { size, pattern, .. } => {
                let last = pattern[..size as usize]
                    .iter()
                    .map(|part| *part as usize)
                    .max();
                last.map_or(all, |last| last + 1)
            }
            _ => all,
        },
    };
    users.map(of_user).max().unwrap_or(all).min(all)
}
