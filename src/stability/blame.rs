//! Why a variant fails on an input: the step of its recipe, the operation that was the first in trouble, and what it was given.

use super::obligations::{Digits, First, Place, wants};
use super::run::{Failure, Given, Subject, fed, shade};
use super::{Battery, Breach, Exhibit, Inputs, Reach, inputs};
use crate::Diagnostic;
use crate::eval::lane::LANES;
use crate::eval::machine::Machine;
use crate::eval::programs::Programs;
use crate::eval::rough::{Arithmetic, Rough};
use crate::eval::shadow::Both;
use crate::front::Source;
use lodc_passes::{Candidate, Recipe, Shader, Stage};
use naga::{Binding, Expression, Handle, Span, TypeInner};
use std::borrow::Cow;
use std::fmt::Write;

/// A named part of an input.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Number {
    /// Such as `material.roughness`, or the name of what is handed over from the vertices.
    pub name: String,
    /// What it holds.
    pub values: Vec<f64>,
}

/// What is known of a failure.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Blamed {
    /// The step of the recipe, with its place in it; nothing when the shader has no recipe, or it fails without.
    pub candidate: Option<(usize, Candidate)>,
    /// The stage of the operation that was the first in trouble.
    pub stage: Stage,
    /// The path of its value, `fs_main.specular.pow`; nothing where no single operation was.
    pub path: Option<String>,
    /// Where that is in the source.
    pub span: Span,
    /// What the operation is, and what it wants.
    pub wants: (&'static str, &'static str),
    /// What it was given.
    pub operands: Vec<f32>,
    /// What it gave, in `f32`.
    pub narrow: f32,
    /// The same in `f64`.
    pub wide: Option<f64>,
    /// The value whose operation lost the most digits before, with the relative errors before and after it.
    pub lost: Option<(String, f64, f64)>,
    /// The uniforms that are not as in the scene, and what came from the vertices.
    pub input: Vec<Number>,
    /// Where it comes from.
    pub reach: Reach,
    /// Whether it takes roundings that WGSL allows and the evaluator does not have.
    pub rounded: bool,
    /// What is worse than in the original, where nothing that is returned is bad.
    pub breach: Option<Breach>,
    /// The device on which alone it fails.
    pub device: Option<String>,
}

impl Battery<'_> {
    /// Finds out why a shader fails. `from` is what its recipe is replayed on.
    pub fn blame(&self, whole: (&Shader, &Recipe), failure: &Failure) -> Blamed {
        let exhibit = &*self.exhibit_of(failure);
        self.blame_by(whole, failure, &mut |shader| {
            let subject = Programs::of(shader).map(Subject::new);
            subject.is_ok_and(|subject| self.fails_on(&subject, shader, exhibit, failure))
        })
    }

    /// The same, where something else says whether a shader fails on the input.
    pub(super) fn blame_by(
        &self,
        (from, recipe): (&Shader, &Recipe),
        failure: &Failure,
        fails: &mut dyn FnMut(&Shader) -> bool,
    ) -> Blamed {
        let exhibit = &*self.exhibit_of(failure);
        let mut shaders = vec![from.clone()];
        for candidate in &recipe.0 {
            let last = &shaders[shaders.len() - 1];
            match lodc_passes::recipe::apply(last, candidate) {
                Ok(next) => shaders.push(next),
                Err(_) => break,
            }
        }
        let holds = shaders.iter().rposition(|shader| !fails(shader));
        let candidate = holds.and_then(|at| Some((at, recipe.0.get(at)?.clone())));
        let failing = &shaders[shaders.len() - 1];
        let mut blamed = self.operation(failing, exhibit, failure);
        blamed.candidate = candidate;
        if !blamed.span.is_defined() {
            let site = blamed.candidate.as_ref().map(|(_, c)| &c.site);
            let found = site.and_then(|site| self.base().find(site));
            blamed.span = found.map_or(Span::UNDEFINED, |(stage, value)| {
                span_of(self.base(), stage, value)
            });
        }
        blamed
    }

    /// The exhibit of a failure.
    pub(super) fn exhibit_of(&self, failure: &Failure) -> Cow<'_, Exhibit> {
        match &failure.group {
            Some(group) => {
                let frame = self.interface.frame(group);
                Cow::Owned(self.exhibit(frame, Inputs::Made(group.clone())))
            }
            None => Cow::Borrowed(&self.exhibits[failure.exhibit]),
        }
    }

    /// Whether a shader fails on the input of another one's failure.
    pub(crate) fn fails(&self, subject: &Subject, shader: &Shader, failure: &Failure) -> bool {
        self.fails_on(subject, shader, &self.exhibit_of(failure), failure)
    }

    fn fails_on(
        &self,
        subject: &Subject,
        shader: &Shader,
        exhibit: &Exhibit,
        failure: &Failure,
    ) -> bool {
        match &failure.law {
            Some(broken) => self.breaks(subject, shader, exhibit, broken).is_some(),
            None => {
                let bad = self.run(subject, exhibit, self.arithmetics[failure.arithmetic]);
                let original = exhibit.original.get(failure.arithmetic);
                original.is_some_and(|original| bad.first_beyond(original).is_some())
            }
        }
    }

    /// The operation that is in trouble first.
    fn operation(&self, shader: &Shader, exhibit: &Exhibit, failure: &Failure) -> Blamed {
        let arithmetic = self.arithmetics[failure.arithmetic];
        let mut blamed = Blamed {
            candidate: None,
            stage: Stage::Fragment,
            path: None,
            span: Span::UNDEFINED,
            wants: ("an operation", "operands that are finite"),
            operands: Vec::new(),
            narrow: f32::NAN,
            wide: None,
            lost: None,
            input: Vec::new(),
            reach: exhibit.reach(),
            rounded: arithmetic != Arithmetic::OWN,
            breach: failure.law.as_ref().map(|broken| broken.breach),
            device: None,
        };
        let Ok(programs) = Programs::of(shader) else {
            return blamed;
        };
        let subject = Subject::new(programs);
        let rough = || Rough(arithmetic);
        if let (Inputs::Made(_), true) = (&exhibit.inputs, subject.programs.vertex.is_some()) {
            for corner in 0..3 {
                let mut first = First::new(3 * failure.quad() + corner, rough());
                self.given(&subject, exhibit, Some(&mut first));
                if let Some((place, operands, narrow)) = first.found {
                    blamed.stage = Stage::Vertex;
                    blamed.tell(shader, place, operands, narrow);
                    return blamed;
                }
            }
        }
        let mut vertices = rough();
        let given = self.given(&subject, exhibit, Some(&mut vertices));
        let Some(block) = given.blocks.get(failure.block) else {
            return blamed;
        };
        let fragment = &subject.programs.fragment;
        let mut first = First::new(failure.lane, rough());
        let (outputs, _) = shade(fragment, &given, block, Some(&mut first));
        let found = match &failure.law {
            // Nothing is bad yet: what the operation gives is what will be.
            Some(broken) => handle_of(shader, &broken.path).map(|value| {
                let given = match broken.breach {
                    Breach::Sign => None,
                    Breach::Margin { .. } => self.breaks(&subject, shader, exhibit, broken),
                };
                let place = (value.index() as u32, broken.op);
                (place, given.unwrap_or([f32::NAN; 3]), f32::NAN)
            }),
            None => first.found,
        };
        blamed.input = self.input(shader, exhibit, &given, failure);
        match found {
            Some((place, operands, narrow)) => {
                blamed.tell(shader, place, operands, narrow);
                let inputs = fed(fragment, &given, block);
                let mut digits = Digits::new(failure.lane, place);
                let bindings = &given.frame.bindings;
                let mut machine =
                    Machine::<Both>::watched(fragment, bindings, block.draw, Some(&mut digits));
                let mut unread = vec![[0; LANES]; outputs.len()];
                machine.run(&inputs, block.active, block.covered, &mut unread);
                drop(machine);
                if let Some(value) = digits.value {
                    blamed.wide = Some(value.wide);
                    if blamed.breach.is_some() {
                        blamed.narrow = value.narrow;
                    }
                }
                blamed.lost = digits.lost.and_then(|((origin, _), before, after)| {
                    Some((super::path_of(shader, origin)?, before, after))
                });
            }
            // Too large for its target, or a constant that is not finite.
            None => {
                let words = outputs
                    .iter()
                    .map(|words| f32::from_bits(words[failure.lane]));
                let mut bad = words.filter(|x| !x.is_finite() || x.abs() > self.most);
                blamed.narrow = bad.next().unwrap_or(f32::NAN);
                blamed.wants = ("what is returned", "numbers that the target holds");
            }
        }
        blamed
    }

    /// What is special in an input.
    fn input(
        &self,
        shader: &Shader,
        exhibit: &Exhibit,
        given: &Given<'_>,
        failure: &Failure,
    ) -> Vec<Number> {
        let mut numbers = Vec::new();
        if let Inputs::Made(group) = &exhibit.inputs {
            for (path, values) in &group.values {
                numbers.push(Number {
                    name: path.clone(),
                    values: values.clone(),
                });
            }
        } else {
            for freedom in self.interface.freedoms.iter().filter(|f| !f.is_matrix()) {
                if let Some(values) = inputs::read(&given.frame.bindings, freedom) {
                    let name = freedom.path().to_owned();
                    numbers.push(Number { name, values });
                }
            }
        }
        // Of the vertex stage that lodc supplies.
        numbers.retain(|number| !number.name.starts_with("lodc."));
        let Some(block) = given.blocks.get(failure.block) else {
            return numbers;
        };
        for (location, name) in names(self.stand.base).into_iter().chain(names(shader)) {
            if numbers.iter().any(|number| number.name == name) {
                continue;
            }
            let slots = given.slots.iter().zip(&block.inputs);
            let own = slots.filter(|(slot, _)| {
                matches!(slot.binding, Binding::Location { location: at, .. } if at == location)
            });
            let values: Vec<f64> = own
                .map(|(_, words)| f64::from(f32::from_bits(words[failure.lane])))
                .collect();
            if !values.is_empty() {
                numbers.push(Number { name, values });
            }
        }
        numbers
    }
}

/// The inputs of a fragment stage by location, with their names.
pub(super) fn names(shader: &Shader) -> Vec<(u32, String)> {
    let Some(function) = shader.function(Stage::Fragment) else {
        return Vec::new();
    };
    let mut names = Vec::new();
    let mut add = |binding: &Option<Binding>, name: &Option<String>| {
        if let (Some(Binding::Location { location, .. }), Some(name)) = (binding, name) {
            names.push((*location, name.clone()));
        }
    };
    for argument in &function.arguments {
        add(&argument.binding, &argument.name);
        if let TypeInner::Struct { members, .. } = &shader.module().types[argument.ty].inner {
            for member in members {
                add(&member.binding, &member.name);
            }
        }
    }
    names
}

fn handle_of(shader: &Shader, path: &str) -> Option<Handle<Expression>> {
    let function = shader.function(Stage::Fragment)?;
    let mut all = function.expressions.iter().map(|(value, _)| value);
    all.find(|value| shader.id(Stage::Fragment, *value).path() == path)
}

pub(super) fn span_of(shader: &Shader, stage: Stage, value: Handle<Expression>) -> Span {
    let function = shader.function(stage);
    function.map_or(Span::UNDEFINED, |function| {
        function.expressions.get_span(value)
    })
}

impl Blamed {
    fn tell(&mut self, shader: &Shader, place: Place, operands: [f32; 3], narrow: f32) {
        let (origin, op) = place;
        self.wants = wants(op);
        let count = op.signature().0.len();
        self.operands = operands[..count].to_vec();
        self.operands
            .retain(|x| !(self.breach.is_some() && x.is_nan()));
        self.narrow = narrow;
        let function = shader.function(self.stage);
        let mut all = function.into_iter().flat_map(|f| f.expressions.iter());
        if let Some((value, _)) = all.find(|(value, _)| value.index() as u32 == origin) {
            self.path = Some(shader.id(self.stage, value).path().to_owned());
            self.span = span_of(shader, self.stage, value);
        }
    }

    /// The line of a candidate's site in the source, from 1.
    fn site(&self, base: &Shader) -> Span {
        let site = self
            .candidate
            .as_ref()
            .map(|(_, candidate)| &candidate.site);
        let found = site.and_then(|site| base.find(site));
        found.map_or(Span::UNDEFINED, |(stage, value)| {
            span_of(base, stage, value)
        })
    }

    /// What happens, in a line: for reports.
    pub fn says(&self, base: &Shader, source: &Source) -> String {
        let line = |span: Span| source.place(span).map(|place| place.line());
        let mut text = self.what();
        if let Some(path) = &self.path {
            let _ = write!(text, " at `{path}`");
        }
        if let Some(line) = line(self.span) {
            let _ = write!(text, ", line {line}");
        }
        if let Some((_, candidate)) = &self.candidate {
            let _ = write!(text, ", because of `{candidate}`");
            if let Some(line) = line(self.site(base)) {
                let _ = write!(text, " at line {line}");
            }
        }
        text
    }

    fn what(&self) -> String {
        let (operation, _) = self.wants;
        if let Some(device) = &self.device {
            return format!("what is returned is not finite on {device}");
        }
        match (self.breach, self.narrow) {
            (Some(Breach::Sign), _) => "a divisor crosses 0".to_owned(),
            (Some(Breach::Margin { .. }), _) => {
                format!("{operation} comes closer to trouble than in the original")
            }
            (None, x) if x.is_nan() => format!("{operation} gives no number"),
            (None, x) if x.is_finite() => {
                format!("{operation} is {x:e}, more than the target holds")
            }
            (None, _) => format!("{operation} overflows"),
        }
    }

    /// The failure in the user's source.
    pub fn diagnostic(&self, base: &Shader, source: &Source) -> Box<Diagnostic> {
        let (_, wanted) = self.wants;
        let message = match &self.candidate {
            Some((_, candidate)) => {
                format!("`{candidate}` makes the shader unstable: {}", self.what())
            }
            None => format!("the shader is unstable: {}", self.what()),
        };
        let mut diagnostic = Diagnostic::warning(message);
        let given = self.operands.iter().map(|x| format!("{x:?}"));
        let given: Vec<String> = given.collect();
        let given = match given.is_empty() {
            true => String::new(),
            false => format!("given {}; ", given.join(", ")),
        };
        let remark = match self.breach {
            _ if self.device.is_some() => {
                "the evaluator gives a number here, and the original does on both".to_owned()
            }
            Some(Breach::Sign) => {
                "the divisor changes its sign, which it does not in the original".to_owned()
            }
            Some(Breach::Margin { original, own }) => format!(
                "{given}its margin is {own:.1e}, and {original:.1e} at least in the original; it wants {wanted}"
            ),
            None => {
                let wide = self
                    .wide
                    .map_or(String::new(), |x| format!(", {x:e} in f64"));
                format!(
                    "{given}it gives {:?} in f32{wide}, and wants {wanted}",
                    self.narrow
                )
            }
        };
        diagnostic = source.locate(diagnostic, self.span, remark);
        let site = self.site(base);
        if site.is_defined() && site != self.span {
            diagnostic = source.locate(diagnostic, site, "this is what the step changes");
        }
        let input: Vec<String> = self.input.iter().map(Number::says).collect();
        let reach = match self.reach {
            Reach::Reachable => "a picture of the scene shows it",
            Reach::Declared => "no picture of the scene shows it, but the interface allows it",
        };
        if !input.is_empty() {
            diagnostic = diagnostic.with_note(format!("with {}; {reach}", input.join(", ")));
        } else {
            diagnostic = diagnostic.with_note(reach);
        }
        if self.rounded {
            diagnostic = diagnostic.with_note(
                "with roundings that WGSL allows, though the evaluator's own do not show it",
            );
        }
        if let Some((path, before, after)) = &self.lost {
            diagnostic = diagnostic.with_note(format!(
                "`{path}` loses digits: its operands are off by {before:.1e}, its result by {after:.1e}"
            ));
        }
        diagnostic
    }
}

impl Number {
    pub(super) fn says(&self) -> String {
        let numbers = self.values.iter().map(|x| format!("{:?}", *x as f32));
        let numbers: Vec<String> = numbers.collect();
        match &numbers[..] {
            [one] => format!("{} = {one}", self.name),
            several => format!("{} = ({})", self.name, several.join(", ")),
        }
    }
}
