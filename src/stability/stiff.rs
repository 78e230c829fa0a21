//! What is stiff: what is shown jumps, or changes much over a small way through the inputs.
//!
//! ```text
//! interface --ways--> quads that cross triangles, or whose uniforms change
//! way x shader --walk--> stretches on which what is shown changes visibly, halved until it no longer does: slopes and jumps
//! stretch x shader --trace--> the operation that flips there, or that makes the most of what it is given
//! original, variant --compare--> jumps that are added, removed or moved, slopes that are steeper, and the step to blame
//! ```
//!
//! A slope is told by the shortest stretch of a way over which what is shown changes by [`VISIBLE`]: an estimate of a local
//! Lipschitz constant from below. A jump is one that no halving makes shorter.
//!
//! None of this refuses a variant. To move an edge, or to be rid of it, is what a level of detail is for, and the bound on the
//! error of pictures says how much of that may be seen. What is not finite on a way is the battery's to find.

use super::blame::{Number, names, span_of};
use super::inputs::{Group, Interface, QUADS, Way};
use super::run::{Given, Subject, shade};
use super::{obligations::Place, path_of};
use crate::Diagnostic;
use crate::error::{displayed, encoded};
use crate::eval::lane::{LANES, Mask, Words};
use crate::eval::machine::{Outcome, Watcher};
use crate::eval::program::{Refused, Slot};
use crate::eval::programs::{Programs, Stand};
use crate::eval::raster::Block;
use crate::front::Source;
use lodc_passes::semantics::Op;
use lodc_passes::{Candidate, Recipe, Shader, Stage};
use naga::{Binding, ScalarKind, Span};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Stretches that a way is cut into, and how often one on which much changes is halved.
const STRETCHES: usize = 16;
const HALVINGS: u32 = 16;
/// The least change of an encoded colour of 0..1 that counts.
const VISIBLE: f32 = 1.0 / 16.0;
/// What is as short as this, as a share of its way, is a jump: no rounding of an input is much shorter.
const JUMP: f64 = 2.0 / ((STRETCHES as u64) << HALVINGS) as f64;
/// What is as short as this is steep.
const STEEP: f64 = 1.0 / 256.0;
/// How far a jump may be off and be the same, as a share of its way.
const SAME: f64 = 1.0 / 2048.0;
/// What is this much steeper than it was is told.
const STEEPER: f64 = 4.0;
/// An operation whose result changes by this much more than its operands makes a slope.
const AMPLIFIES: f64 = 8.0;
/// Stretches that are explained, and findings that are told.
const EXPLAINED: usize = 48;
const TOLD: usize = 8;

/// What was found of a jump or a slope.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Change {
    /// A variant has a jump where its original has none.
    Added,
    /// The jump is elsewhere.
    Moved,
    /// The slope is steeper.
    Steeper,
    /// The jump is gone.
    Removed,
    /// A shader by itself jumps.
    Jumps,
    /// A shader by itself is steep.
    Steep,
}

/// A jump or a slope that is worth knowing of.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Stiff {
    /// What it is.
    pub change: Change,
    /// The step of the recipe that changes it, with its place there; nothing for a shader by itself.
    pub candidate: Option<(usize, Candidate)>,
    /// The path of the value that flips or is steep, `fs_main.band.step`.
    pub path: String,
    /// Where that is in the source.
    pub span: Span,
    /// What kind of operation it is.
    pub operation: &'static str,
    /// By how much what is shown changes there, in encoded colour of 0..1; 1 where something is discarded.
    pub height: f32,
    /// The share of the way on which it does.
    pub width: f64,
    /// How many times as steep it is as the steepest of the original on that way, at least, for what is steeper.
    pub times: f64,
    /// The input that changes the most there, and by how much.
    pub within: Option<(String, f64)>,
    /// The inputs there.
    pub input: Vec<Number>,
    /// The input that tells the most where it was before, and where it is now.
    pub moved: Option<[Number; 2]>,
    /// On how many ways.
    pub ways: usize,
}

/// A stretch of a way on which what is shown changes visibly.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    quad: usize,
    from: f64,
    to: f64,
    height: f32,
}

impl Stretch {
    fn width(self) -> f64 {
        self.to - self.from
    }

    fn middle(self) -> f64 {
        self.from.midpoint(self.to)
    }

    fn is_jump(self) -> bool {
        self.width() <= JUMP
    }

    /// The same with some room on both sides.
    fn with_room(self) -> [(usize, f64); 2] {
        let from = (self.from - SAME).max(0.0);
        let to = (self.to + SAME).min(1.0);
        [(self.quad, from), (self.quad, to)]
    }
}

/// What is seen of a fragment: its colours, nothing where it is discarded.
type Shown = Option<Vec<f32>>;

/// By how much two differ. What is no number is not compared.
fn change(a: &Shown, b: &Shown) -> f32 {
    match (a, b) {
        (None, None) => 0.0,
        (Some(a), Some(b)) => {
            let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            apart.filter(|x| !x.is_nan()).fold(0.0, f32::max)
        }
        _ => 1.0,
    }
}

/// A way as one shader has it: what the vertices hand over at both ends.
struct Drawn<'w> {
    way: &'w Way,
    ends: [Given<'static>; 2],
}

impl Drawn<'_> {
    /// Whether uniforms change on it.
    fn turns(&self) -> bool {
        let [begin, end] = &self.way.ends;
        begin.values != end.values
    }

    /// Fragments on it: quads and how far they have come.
    fn between(&self, items: &[(usize, f64)]) -> Block {
        let [begin, end] = &self.ends;
        let mut block = Block {
            inputs: vec![[0; LANES]; begin.slots.len()],
            active: Mask::default(),
            covered: Mask::default(),
            pixels: [u32::MAX; LANES],
            depths: [0.5; LANES],
            draw: 0,
            first: 0,
            quads: Vec::new(),
            recall: None,
        };
        let (Some(first), Some(last)) = (begin.blocks.first(), end.blocks.first()) else {
            return block;
        };
        for (k, (quad, t)) in items.iter().enumerate() {
            block.active.0[k / 16] |= 15 << (k % 16 * 4);
            for (s, slot) in begin.slots.iter().enumerate() {
                for j in 0..4 {
                    let [a, b] = [first, last].map(|block| block.inputs[s][4 * quad + j]);
                    block.inputs[s][4 * k + j] = match slot.kind {
                        ScalarKind::Float => mixed(a, b, *t),
                        _ => a,
                    };
                }
            }
        }
        block.covered = block.active;
        block
    }
}

/// A number between two, all as bits.
fn mixed(a: u32, b: u32, t: f64) -> u32 {
    let [from, to] = [a, b].map(|x| f64::from(f32::from_bits(x)));
    match t {
        0.0 => a,
        1.0 => b,
        t => ((from + (to - from) * t) as f32).to_bits(),
    }
}

/// Ways through the inputs of a shader, and what its original has of stretches on them.
pub struct Ways<'a> {
    stand: &'a Stand<'a>,
    interface: Interface<'a>,
    original: Subject,
    ways: Vec<Way>,
    /// For each way.
    stretches: Vec<Vec<Stretch>>,
}

/// A stretch that is to be explained: of which way, whether the variant has it, and what it tells.
struct Found {
    way: usize,
    stretch: Stretch,
    change: Change,
    /// What is steepest on the way in the original is as short as this.
    before: f64,
}

impl<'a> Ways<'a> {
    /// Walks the original along all ways.
    ///
    /// # Errors
    /// When the evaluator refuses the original.
    pub fn new(stand: &'a Stand<'a>) -> Result<Self, Refused> {
        let interface = Interface::new(stand.scene, stand.scene.seed ^ 0x571f);
        let mut ways = Self {
            ways: interface.ways(),
            original: Subject::new(Programs::of(stand.base)?),
            interface,
            stand,
            stretches: Vec::new(),
        };
        let all = ways.ways.par_iter();
        ways.stretches = all
            .map(|way| ways.walk(&ways.original, &ways.drawn(&ways.original, way)))
            .collect();
        Ok(ways)
    }

    /// What is stiff in the original by itself: the highest of each operation.
    pub fn of_original(&self) -> Vec<Stiff> {
        let all = self.stretches.iter().enumerate();
        let found = all.flat_map(|(way, stretches)| {
            let stiff = stretches.iter().filter(|s| s.width() <= STEEP);
            stiff.map(move |stretch| Found {
                way,
                stretch: *stretch,
                change: Change::Jumps,
                before: stretch.width(),
            })
        });
        let found: Vec<Found> = found.collect();
        let told = some(&found)
            .filter_map(|found| self.explained(found, (self.stand.base, &self.original)));
        told_once(told.collect())
    }

    /// How a variant differs from the original in what is stiff. `from` is what its recipe is replayed on.
    ///
    /// # Errors
    /// When the evaluator refuses it.
    pub fn compare(
        &self,
        (from, recipe): (&Shader, &Recipe),
        shader: &Shader,
    ) -> Result<Vec<Stiff>, Refused> {
        let subject = Subject::new(Programs::of(shader)?);
        let all = self.ways.par_iter().enumerate();
        let found: Vec<Vec<Found>> = all
            .map(|(way, _)| self.differences(&subject, way))
            .collect();
        let found: Vec<Found> = found.into_iter().flatten().collect();
        let mut explained: Vec<(Stiff, &Found)> = Vec::new();
        for found in some(&found) {
            let of = match found.change {
                Change::Removed => (self.stand.base, &self.original),
                _ => (shader, &subject),
            };
            explained.extend(self.explained(found, of).map(|stiff| (stiff, found)));
        }
        // What is gone in one place and new in another, of the same value on the same way, was moved.
        let mut gone: Vec<(Stiff, &Found)> = Vec::new();
        let mut told: Vec<(Stiff, &Found)> = Vec::new();
        for (stiff, found) in explained {
            match found.change {
                Change::Removed => gone.push((stiff, found)),
                _ => told.push((stiff, found)),
            }
        }
        for (stiff, found) in &mut told {
            let far = |(_, before): &(Stiff, &Found)| {
                (before.stretch.middle() - found.stretch.middle()).abs()
            };
            let before = gone.iter().enumerate().filter(|(_, (other, before))| {
                let ways = [before, found].map(|found| (found.way, found.stretch.quad));
                found.change == Change::Added && ways[0] == ways[1] && other.path == stiff.path
            });
            let nearest = before.min_by(|(_, a), (_, b)| far(a).total_cmp(&far(b)));
            let nearest = nearest.map(|(at, _)| at);
            if let Some((_, before)) = nearest.map(|at| gone.remove(at)) {
                let drawn = self.drawn(&self.original, &self.ways[found.way]);
                let places = [before.stretch, found.stretch].map(|stretch| {
                    let of = (self.stand.base, &self.original);
                    self.input(of, &drawn, (stretch.quad, stretch.middle()))
                });
                stiff.change = Change::Moved;
                stiff.moved = farthest(&places);
            }
        }
        told.append(&mut gone);
        let steps = replayed(from, recipe);
        for (stiff, found) in &mut told {
            stiff.candidate = self.blame(&steps, recipe, found);
        }
        Ok(told_once(
            told.into_iter().map(|(stiff, _)| stiff).collect(),
        ))
    }

    /// What a shader's vertices hand over at the ends of a way.
    fn drawn<'w>(&self, subject: &Subject, way: &'w Way) -> Drawn<'w> {
        Drawn {
            ends: way.ends.each_ref().map(|group| self.given(subject, group)),
            way,
        }
    }

    fn given(&self, subject: &Subject, group: &Group) -> Given<'static> {
        let own = self.interface.frame(group);
        let given = subject.given(self.stand, &own, group, None);
        Given {
            frame: Cow::Owned(given.frame.into_owned()),
            ..given
        }
    }

    /// The same on the way between two groups whose uniforms differ.
    fn given_at(&self, subject: &Subject, way: &Way, t: f64) -> Given<'static> {
        let [begin, end] = &way.ends;
        let both = begin.values.iter().zip(&end.values);
        let values = both.map(|((path, low), (_, high))| {
            let pairs = low.iter().zip(high);
            let between = pairs.map(|(low, high)| low + (high - low) * t).collect();
            (path.clone(), between)
        });
        let group = Group {
            values: values.collect(),
            ..begin.clone()
        };
        self.given(subject, &group)
    }

    /// What is shown of fragments on a way: quads and how far they have come.
    fn shown(&self, subject: &Subject, drawn: &Drawn<'_>, items: &[(usize, f64)]) -> Vec<Shown> {
        if !drawn.turns() {
            let [begin, _] = &drawn.ends;
            let chunks = items.chunks(QUADS).flat_map(|items| {
                let block = drawn.between(items);
                let (outputs, alive) = shade(&subject.programs.fragment, begin, &block, None);
                let all = (0..items.len()).map(|k| self.seen(subject, &outputs, alive, 4 * k));
                all.collect::<Vec<Shown>>()
            });
            return chunks.collect();
        }
        // Their order is that of the numbers: none is below 0.
        let mut places = BTreeMap::<u64, Vec<usize>>::new();
        for (at, (_, t)) in items.iter().enumerate() {
            places.entry(t.to_bits()).or_default().push(at);
        }
        let mut all = vec![None; items.len()];
        for (t, items_here) in places {
            let given = self.given_at(subject, drawn.way, f64::from_bits(t));
            let Some(block) = given.blocks.first() else {
                continue;
            };
            let (outputs, alive) = shade(&subject.programs.fragment, &given, block, None);
            for at in items_here {
                all[at] = self.seen(subject, &outputs, alive, 4 * items[at].0);
            }
        }
        all
    }

    /// What is shown in a lane.
    fn seen(&self, subject: &Subject, outputs: &[Words], alive: Mask, lane: usize) -> Shown {
        if !alive.has(lane) {
            return None;
        }
        let scene = self.stand.scene;
        let mut colour = [0.0, 0.0, 0.0, 1.0];
        let mut others = Vec::new();
        for (slot, words) in subject.programs.fragment.outputs().iter().zip(outputs) {
            let x = f32::from_bits(words[lane]);
            match (slot.kind, &slot.binding) {
                (ScalarKind::Float, Binding::Location { location: 0, .. }) => {
                    if let Some(component) = colour.get_mut(slot.component) {
                        *component = x;
                    }
                }
                (ScalarKind::Float, Binding::Location { .. }) => others.push(x.clamp(-1.0, 1.0)),
                _ => {}
            }
        }
        let mut all = encoded(displayed(scene.output, colour)).to_vec();
        if scene.blends() {
            all.push(colour[3].clamp(0.0, 1.0));
        }
        all.append(&mut others);
        Some(all)
    }

    /// The stretches of a way on which what a shader shows changes visibly.
    fn walk(&self, subject: &Subject, drawn: &Drawn<'_>) -> Vec<Stretch> {
        let [begin, _] = &drawn.way.ends;
        let quads = begin.quads.len();
        let along = |i: usize| i as f64 / STRETCHES as f64;
        let all = (0..quads).flat_map(|quad| (0..=STRETCHES).map(move |i| (quad, along(i))));
        let all: Vec<(usize, f64)> = all.collect();
        let shown = self.shown(subject, drawn, &all);
        let mut open = Vec::new();
        for (shown, items) in shown.chunks(STRETCHES + 1).zip(all.chunks(STRETCHES + 1)) {
            for (both, ends) in shown.windows(2).zip(items.windows(2)) {
                let height = change(&both[0], &both[1]);
                if height >= VISIBLE {
                    let ((quad, from), (_, to)) = (ends[0], ends[1]);
                    let stretch = Stretch {
                        quad,
                        from,
                        to,
                        height,
                    };
                    open.push((stretch, [both[0].clone(), both[1].clone()]));
                }
            }
        }
        let mut found = Vec::new();
        for _ in 0..HALVINGS {
            let middles: Vec<_> = open.iter().map(|(s, _)| (s.quad, s.middle())).collect();
            let shown = self.shown(subject, drawn, &middles);
            let mut narrower = Vec::new();
            for ((stretch, [first, last]), middle) in open.into_iter().zip(shown) {
                let at = stretch.middle();
                let [before, after] = [change(&first, &middle), change(&middle, &last)];
                if before.max(after) < VISIBLE {
                    found.push(stretch);
                    continue;
                }
                narrower.push(match before >= after {
                    true => (
                        Stretch {
                            to: at,
                            height: before,
                            ..stretch
                        },
                        [first, middle],
                    ),
                    false => (
                        Stretch {
                            from: at,
                            height: after,
                            ..stretch
                        },
                        [middle, last],
                    ),
                });
            }
            open = narrower;
        }
        found.extend(open.into_iter().map(|(stretch, _)| stretch));
        found.sort_by(|a, b| {
            (a.quad, a.from)
                .partial_cmp(&(b.quad, b.from))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        found
    }

    /// By how much what a shader shows changes about some stretches.
    fn changes(&self, subject: &Subject, drawn: &Drawn<'_>, about: &[Stretch]) -> Vec<f32> {
        let items: Vec<_> = about.iter().flat_map(|s| s.with_room()).collect();
        let shown = self.shown(subject, drawn, &items);
        shown
            .chunks(2)
            .map(|both| change(&both[0], &both[1]))
            .collect()
    }

    /// Where a variant jumps and the original does not, and the other way round, and where it is steeper.
    fn differences(&self, subject: &Subject, at: usize) -> Vec<Found> {
        let way = &self.ways[at];
        // What is interpolated between vertices means nothing on a triangle that no mesh has.
        if way.is_wide && subject.programs.vertex.is_some() {
            return Vec::new();
        }
        let before = &self.stretches[at];
        let drawn = self.drawn(subject, way);
        let after = self.walk(subject, &drawn);
        let jumps = |all: &[Stretch]| -> Vec<Stretch> {
            all.iter().copied().filter(|s| s.is_jump()).collect()
        };
        let mut found = Vec::new();
        let mut differ = |subject: &Subject, drawn: &Drawn<'_>, jumps: &[Stretch], change| {
            let now = self.changes(subject, drawn, jumps);
            for (stretch, now) in jumps.iter().zip(now) {
                if now < stretch.height / 4.0 {
                    found.push(Found {
                        way: at,
                        stretch: *stretch,
                        change,
                        before: stretch.width(),
                    });
                }
            }
        };
        let had = self.drawn(&self.original, way);
        differ(subject, &drawn, &jumps(before), Change::Removed);
        differ(&self.original, &had, &jumps(&after), Change::Added);
        let narrowest = |quad: usize| {
            let own = before.iter().filter(|s| s.quad == quad);
            own.map(|s| s.width())
                .fold(1.0 / STRETCHES as f64, f64::min)
        };
        for stretch in after.iter().filter(|s| !s.is_jump()) {
            let (width, before) = (stretch.width(), narrowest(stretch.quad));
            if width <= STEEP && width * STEEPER <= before {
                found.push(Found {
                    way: at,
                    stretch: *stretch,
                    change: Change::Steeper,
                    before,
                });
            }
        }
        found
    }

    /// What flips, or is steep, on a stretch; nothing where that is no operation, but a texture, say.
    fn explained(&self, found: &Found, (shader, subject): (&Shader, &Subject)) -> Option<Stiff> {
        let Found {
            way,
            stretch,
            before,
            ..
        } = *found;
        let drawn = self.drawn(subject, &self.ways[way]);
        let [from, to] =
            [stretch.from, stretch.to].map(|t| self.trace(subject, &drawn, (stretch.quad, t)));
        let ((origin, op), flips) = cause(&from, &to, stretch.is_jump())?;
        let path = path_of(shader, origin)?;
        let place = |t: f64| self.input((shader, subject), &drawn, (stretch.quad, t));
        let function = shader.function(Stage::Fragment)?;
        let mut values = function.expressions.iter();
        let (value, _) = values.find(|(value, _)| value.index() as u32 == origin)?;
        Some(Stiff {
            change: match found.change {
                Change::Jumps if !flips => Change::Steep,
                other => other,
            },
            candidate: None,
            path,
            span: span_of(shader, Stage::Fragment, value),
            operation: called(op),
            height: stretch.height,
            width: stretch.width(),
            times: before / stretch.width(),
            within: farthest(&[stretch.from, stretch.to].map(&place)).map(|[a, b]| {
                let by = apart_of(&a, &b);
                (a.name, by)
            }),
            input: place(stretch.middle()),
            moved: None,
            ways: 1,
        })
    }

    /// The operations of one fragment.
    fn trace(&self, subject: &Subject, drawn: &Drawn<'_>, item: (usize, f64)) -> Vec<Done> {
        let mut trace = Trace::default();
        let fragment = &subject.programs.fragment;
        if drawn.turns() {
            let given = self.given_at(subject, drawn.way, item.1);
            trace.lane = 4 * item.0;
            if let Some(block) = given.blocks.first() {
                shade(fragment, &given, block, Some(&mut trace));
            }
        } else {
            let block = drawn.between(&[item]);
            shade(fragment, &drawn.ends[0], &block, Some(&mut trace));
        }
        trace.done
    }

    /// The inputs of a quad so far on a way: those that change on it and that the fragments read.
    fn input(
        &self,
        (shader, subject): (&Shader, &Subject),
        drawn: &Drawn<'_>,
        (quad, t): (usize, f64),
    ) -> Vec<Number> {
        let [begin, end] = &drawn.way.ends;
        let mut numbers = Vec::new();
        for ((path, low), (_, high)) in begin.values.iter().zip(&end.values) {
            let pairs = low.iter().zip(high);
            numbers.push(Number {
                name: path.clone(),
                values: pairs.map(|(low, high)| low + (high - low) * t).collect(),
            });
        }
        if drawn.turns() {
            return numbers;
        }
        let block = drawn.between(&[(quad, t)]);
        let is_read = |slot: &Slot| {
            let mut read = subject.programs.fragment.read_inputs();
            read.any(|read| read.binding == slot.binding)
        };
        for (location, name) in names(self.stand.base).into_iter().chain(names(shader)) {
            if numbers.iter().any(|number| number.name == name) {
                continue;
            }
            let slots = drawn.ends[0].slots.iter().zip(&block.inputs);
            let own = slots.filter(|(slot, _)| {
                matches!(slot.binding, Binding::Location { location: at, .. } if at == location)
                    && slot.kind == ScalarKind::Float
                    && is_read(slot)
            });
            let values: Vec<f64> = own
                .map(|(_, words)| f64::from(f32::from_bits(words[0])))
                .collect();
            if !values.is_empty() {
                numbers.push(Number { name, values });
            }
        }
        numbers
    }

    /// The step of a recipe after which something is no longer as in the original, and stays so.
    fn blame(
        &self,
        steps: &[Subject],
        recipe: &Recipe,
        found: &Found,
    ) -> Option<(usize, Candidate)> {
        let Found {
            way,
            stretch,
            change,
            ..
        } = *found;
        let as_before = |subject: &Subject| {
            let drawn = self.drawn(subject, &self.ways[way]);
            let now = self.changes(subject, &drawn, &[stretch]);
            let now = now.first().copied().unwrap_or(0.0);
            match change {
                Change::Removed => now >= stretch.height / 4.0,
                Change::Steeper => now < stretch.height / 2.0,
                _ => now < stretch.height / 4.0,
            }
        };
        let at = steps.iter().rposition(as_before)?;
        Some((at, recipe.0.get(at)?.clone()))
    }
}

/// The original and what each step of a recipe makes of it.
fn replayed(from: &Shader, recipe: &Recipe) -> Vec<Subject> {
    let mut shader = from.clone();
    let mut subjects: Vec<Subject> = Programs::of(&shader)
        .map(Subject::new)
        .into_iter()
        .collect();
    for candidate in &recipe.0 {
        let Ok(next) = lodc_passes::recipe::apply(&shader, candidate) else {
            break;
        };
        let Ok(programs) = Programs::of(&next) else {
            break;
        };
        subjects.push(Subject::new(programs));
        shader = next;
    }
    subjects
}

/// As many as are explained, from all over; what is found of one quad stays together.
fn some(found: &[Found]) -> impl Iterator<Item = &Found> {
    let mut quads = BTreeMap::<(usize, usize), Vec<&Found>>::new();
    for found in found {
        let quad = (found.way, found.stretch.quad);
        quads.entry(quad).or_default().push(found);
    }
    let apart = found.len().div_ceil(EXPLAINED).max(1);
    quads.into_values().step_by(apart).flatten().take(EXPLAINED)
}

/// Of each operation and kind the highest, or that which was moved the farthest; jumps first.
fn told_once(all: Vec<Stiff>) -> Vec<Stiff> {
    let mut told: Vec<Stiff> = Vec::new();
    for stiff in all {
        // What is inlined in several places is told once.
        let same = |known: &&mut Stiff| {
            let here = known.span.is_defined() && known.span == stiff.span;
            known.change == stiff.change && (here || known.path == stiff.path)
        };
        let known = told.iter_mut().find(same);
        match known {
            Some(known) if known.far() >= stiff.far() => known.ways += 1,
            Some(known) => {
                let ways = known.ways + 1;
                *known = Stiff { ways, ..stiff };
            }
            None => told.push(stiff),
        }
    }
    told.sort_by(|a, b| {
        let heights = b.height.total_cmp(&a.height);
        a.change
            .cmp(&b.change)
            .then(heights)
            .then(a.path.cmp(&b.path))
    });
    told.truncate(TOLD);
    told
}

/// By how much an input differs between two places.
fn apart_of(before: &Number, after: &Number) -> f64 {
    let pairs = before.values.iter().zip(&after.values);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The input that differs the most between two places.
fn farthest([before, after]: &[Vec<Number>; 2]) -> Option<[Number; 2]> {
    let both = before.iter().zip(after);
    let most = both.max_by(|(a, b), (c, d)| apart_of(a, b).total_cmp(&apart_of(c, d)));
    most.map(|(a, b)| [a.clone(), b.clone()])
}

/// An operation of one lane.
#[derive(Clone, Copy, Debug)]
struct Done {
    place: Place,
    operands: [f32; 3],
    /// What it decided, if it is one that decides.
    side: Option<u32>,
    /// What it gave, where that is a float.
    result: Option<f32>,
}

/// Keeps the operations of one lane.
#[derive(Debug, Default)]
struct Trace {
    lane: usize,
    done: Vec<Done>,
}

impl Watcher<f32> for Trace {
    fn done(
        &mut self,
        op: Op,
        origin: u32,
        lanes: Option<Mask>,
        operands: &[[f32; LANES]],
        outcome: Outcome<'_, f32>,
    ) {
        let lane = match lanes {
            Some(lanes) if !lanes.has(self.lane) => return,
            Some(_) => self.lane,
            None => 0,
        };
        let of = |place: usize| operands.get(place).map_or(0.0, |block| block[lane]);
        let operands = [of(0), of(1), of(2)];
        let (result, word) = match outcome {
            Outcome::Floats(floats) => (Some(floats[lane]), 0),
            Outcome::Words(words) => (None, words[lane]),
        };
        self.done.push(Done {
            place: (origin, op),
            operands,
            side: side(op, operands, result, word),
            result,
        });
    }
}

/// Which of several sides an operation takes, for one that jumps between them.
fn side(op: Op, [a, b, _]: [f32; 3], result: Option<f32>, word: u32) -> Option<u32> {
    Some(match op {
        Op::Less
        | Op::LessEqual
        | Op::Equal
        | Op::NotEqual
        | Op::LessInt
        | Op::LessUint
        | Op::LessEqualInt
        | Op::LessEqualUint
        | Op::FloatToInt
        | Op::FloatToUint => word,
        Op::Step | Op::Sign | Op::Floor | Op::Ceil | Op::Round | Op::Trunc => result?.to_bits(),
        Op::Fract => a.floor().to_bits(),
        Op::Rem => (a / b).trunc().to_bits(),
        _ => return None,
    })
}

/// The operation that makes two fragments differ, and whether it flips between them.
fn cause(from: &[Done], to: &[Done], is_jump: bool) -> Option<(Place, bool)> {
    let both = from.iter().zip(to);
    // Where they go different ways one has flipped before.
    let both = both.take_while(|(a, b)| a.place == b.place);
    let mut most: Option<(Place, f64)> = None;
    for (a, b) in both {
        if is_jump && a.side != b.side {
            return Some((a.place, true));
        }
        let (Some(x), Some(y)) = (a.result, b.result) else {
            continue;
        };
        let after = apart(x, y);
        let pairs = a.operands.iter().zip(&b.operands);
        let before = pairs.map(|(x, y)| apart(*x, *y)).fold(0.0, f64::max);
        if !(after.is_finite() && before.is_finite() && before > 0.0) {
            continue;
        }
        let grown = after / before;
        if after >= f64::from(VISIBLE) / 4.0
            && grown >= AMPLIFIES
            && most.is_none_or(|(_, most)| grown > most)
        {
            most = Some((a.place, grown));
        }
    }
    most.map(|(place, _)| (place, false))
}

/// How far two numbers are apart: as they are below 1, as a share above.
fn apart(x: f32, y: f32) -> f64 {
    let [x, y] = [x, y].map(f64::from);
    (x - y).abs() / (1.0 + x.abs().max(y.abs()))
}

/// What an operation is called that jumps or is steep.
fn called(op: Op) -> &'static str {
    match op {
        Op::Step => "`step`",
        Op::Sign => "`sign`",
        Op::Floor => "`floor`",
        Op::Ceil => "`ceil`",
        Op::Round => "`round`",
        Op::Trunc => "`trunc`",
        Op::Fract => "`fract`",
        Op::SmoothStep => "`smoothstep`",
        Op::Pow => "`pow`",
        Op::Sqrt => "`sqrt`",
        Op::InverseSqrt => "`inverseSqrt` or `normalize`",
        Op::Rem => "a remainder",
        Op::Div => "a division",
        Op::Exp | Op::Exp2 => "an exponential",
        Op::Log | Op::Log2 => "a logarithm",
        Op::Sin | Op::Cos | Op::Tan => "a sine, cosine or tangent",
        Op::Mul | Op::Fma => "a product",
        Op::Add | Op::Sub => "a sum or difference",
        Op::FloatToInt | Op::FloatToUint => "a conversion to an integer",
        Op::Less
        | Op::LessEqual
        | Op::Equal
        | Op::NotEqual
        | Op::LessInt
        | Op::LessUint
        | Op::LessEqualInt
        | Op::LessEqualUint => "a comparison",
        _ => "an operation",
    }
}

impl Stiff {
    /// How far it goes: on the way for what is moved, else in height.
    fn far(&self) -> f64 {
        let moved = self.moved.as_ref();
        moved.map_or(self.height.into(), |[before, after]| {
            apart_of(before, after)
        })
    }

    /// What it is, without where.
    fn what(&self) -> String {
        let height = self.height;
        let operation = self.operation;
        match self.change {
            Change::Added => format!("adds a jump of {height:.2}, of {operation}"),
            Change::Removed => format!("removes a jump of {height:.2}, of {operation}"),
            Change::Moved => format!("moves a jump of {height:.2}, of {operation}"),
            Change::Steeper => {
                let times = self.times;
                format!("makes a slope at least {times:.0} times steeper, of {operation}")
            }
            Change::Jumps => format!("what is shown jumps by {height:.2}, because of {operation}"),
            Change::Steep => format!("what is shown is steep, because of {operation}"),
        }
    }

    /// What is known of where, and how far.
    fn detail(&self) -> String {
        let input: Vec<String> = self.input.iter().map(Number::says).collect();
        let input = input.join(", ");
        match (&self.moved, &self.within, self.change) {
            (Some([before, after]), ..) => {
                format!("now at {}, before at {}", after.says(), before.says())
            }
            (None, Some((name, by)), Change::Steep | Change::Steeper) => {
                let height = self.height;
                format!("{height:.2} within {by:.1e} of `{name}`, at {input}")
            }
            (None, ..) => format!("at {input}"),
        }
    }

    /// In a line, for reports.
    pub fn says(&self, source: &Source) -> String {
        let mut text = match &self.candidate {
            Some((_, candidate)) => format!("`{candidate}` {}", self.what()),
            None => self.what(),
        };
        let _ = write!(text, " at `{}`", self.path);
        if let Some(place) = source.place(self.span) {
            let _ = write!(text, ", line {}", place.line());
        }
        let _ = write!(text, ": {}", self.detail());
        text
    }

    /// The same in the user's source.
    pub fn diagnostic(&self, base: &Shader, source: &Source) -> Box<Diagnostic> {
        let message = match (&self.candidate, self.change) {
            (Some((_, candidate)), _) => format!("`{candidate}` {}", self.what()),
            (None, Change::Jumps | Change::Steep) => self.what(),
            (None, _) => format!("the level {}", self.what()),
        };
        let mut diagnostic = Diagnostic::warning(message);
        diagnostic = source.locate(diagnostic, self.span, self.detail());
        let site = self
            .candidate
            .as_ref()
            .map(|(_, candidate)| &candidate.site);
        if let Some((stage, value)) = site.and_then(|site| base.find(site)) {
            let span = span_of(base, stage, value);
            if span.is_defined() && span != self.span {
                diagnostic = source.locate(diagnostic, span, "this is what the step changes");
            }
        }
        diagnostic
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn done(op: Op, operand: f32, result: f32) -> Done {
        Done {
            place: (op as u32, op),
            operands: [operand, 0.0, 0.0],
            side: side(op, [operand, 0.0, 0.0], Some(result), 0),
            result: Some(result),
        }
    }

    #[test]
    fn the_first_that_flips_is_the_cause_of_a_jump_and_the_steepest_of_a_slope() {
        let [low, high] = [1.999_999, 2.000_001];
        let from = [
            done(Op::Mul, low, low),
            done(Op::Floor, low, 1.0),
            done(Op::Sign, 0.0, 0.0),
        ];
        let to = [
            done(Op::Mul, high, high),
            done(Op::Floor, high, 2.0),
            done(Op::Sign, 1.0, 1.0),
        ];
        let found = cause(&from, &to, true).map(|((_, op), flips)| (op, flips));
        assert_eq!(found, Some((Op::Floor, true)));

        let from = [done(Op::Mul, 0.5, 0.51), done(Op::Pow, 0.51, 0.1)];
        let to = [done(Op::Mul, 0.501, 0.511), done(Op::Pow, 0.511, 0.4)];
        let found = cause(&from, &to, false).map(|((_, op), flips)| (op, flips));
        assert_eq!(found, Some((Op::Pow, false)));
        assert_eq!(cause(&from[..1], &to[..1], false), None);
    }

    #[test]
    fn what_is_discarded_differs_from_all_that_is_not() {
        let grey = Some(vec![0.5; 3]);
        assert_eq!(change(&grey, &None), 1.0);
        assert_eq!(change(&None, &None), 0.0);
        assert_eq!(change(&grey, &Some(vec![0.5, 0.75, f32::NAN])), 0.25);
    }
}
