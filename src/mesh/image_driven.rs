//! Simplifies a mesh by what its pictures show: edge after edge goes, those first whose loss is seen least.
//!
//! A collapse moves a point onto a neighbour, so that a vertex never changes and is shaded once for all. Trying every edge in
//! the pictures would take hours, so that points of the surface as it was guess what it costs ([`lodc_mesh::Samples`]), weighed by
//! how much the pictures react ([`super::reaction`]), and the pictures correct them. A round is
//!
//! 1. the cheapest edges by the guess, [`Settings::share`] of them; of these a set that does not meet: no two share a triangle,
//!    and no two may change the same square of 2 x 2 pixels in any view;
//! 2. all of the set drawn at once, moved to the one end, and again to the other: only the squares that they may change.
//!    Since none meets another, what each one changes is the difference within its own squares, exactly. Samples are few, and the
//!    guess is worth some more of them;
//! 3. those whose better end costs least go, up to [`Settings::accepted`] of the set and never beyond the bound. The guess at the
//!    others becomes what was measured, and the guess at what is around those that went is corrected by it.
//!
//! Edges of triangles so small that all views together hardly sample them go by the guess, many at once, and what comes of them is
//! seen together. Meshes are compared with the original's picture with the same samples, which aliases alike: by the reference
//! those edges would seem best that happen to undo an error of the original's.
//!
//! What is hidden in all views behind what is seen costs nothing and goes by the guess alone. Squares are drawn with every
//! triangle that reaches them, so that a surface comes out that was hidden behind a silhouette, and derivatives see whole quads.
//!
//! Complexity: with n triangles and p pixels over all views, a round takes O(n) for the triangles' boxes and O(p) at most for
//! shading. Since sets fill the pictures a round removes a share of what is left as long as triangles are larger than
//! a few pixels, and about p / 20 edges while they are smaller: O(log n + n / p) rounds.
//!
//! This work is based on: Liang 2022, section 4.2; Lindstrom and Turk, "Image-driven simplification", 2000, sections 3 and 4.

use super::reaction::weights;
use super::selection::{Sequence, Step};
use super::view::{Part, Picture, View};
use super::{Pictures, Subject, Triangles};
use crate::eval::raster::Squares;
use glam::DVec3;
use lodc_mesh::{Collapse, Samples, Surface};
use lodc_passes::autolod;
use rayon::prelude::*;

/// What refuses an edge whatever the picture says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum EdgeRule {
    /// Points of the original that went would be farther from the surface than allowed.
    #[default]
    Deviation,
    /// The edge is longer than allowed, as the paper has it: it ends with a triangle or two for each pixel.
    Length,
}

/// How a mesh is simplified.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// How many views it is seen from at least. With few of them edges go that happen to be between their samples: on a rock of
    /// 20,000 triangles with clay 60 left 13 to 29 % less excess than 20 on pictures that had no part in it, at three times the time.
    pub views: usize,
    /// What is refused beyond [`Settings::most_pixels`].
    pub rule: EdgeRule,
    /// How many pixels that is, at the nearest point of the object: Liang's D.
    pub most_pixels: f64,
    /// How many of the edges are looked at in a round, as a share.
    pub share: f64,
    /// How many of those that were drawn may go, as a share.
    pub accepted: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            views: 60,
            rule: EdgeRule::Deviation,
            most_pixels: 1.0,
            share: 0.15,
            accepted: 0.75,
        }
    }
}

/// When a simplification ends.
#[derive(Clone, Copy, Debug)]
pub enum Until {
    /// So many triangles are left, or as few above that as can be.
    Triangles(usize),
    /// The next edge would add more than so much to the original's own error: excess of the RMSE, 0..1.
    Error(f64),
}

/// How far a simplification has come.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    /// Triangles that are left.
    pub triangles: usize,
    /// What they add to the original's error.
    pub excess: f64,
}

/// The fewest edges that a round looks at.
const LEAST_OF_ROUND: usize = 64;

/// Of so many edges at once it is found out what they would change.
const CHUNK: usize = 256;

/// By how much a guess is corrected at most by one measurement.
const MOST_CORRECTION: f64 = 16.0;

/// An end that is guessed to cost so many times as much as the other is not drawn.
const HOPELESS: f64 = 1.25;

/// Edges of which all views together take fewer samples are not judged by them.
const FEWEST_SAMPLES: f64 = 16.0;

/// How many samples a guess is worth.
const WORTH_OF_GUESS: f64 = 200.0;

/// How much of what the bound leaves a round may use up by guesses alone.
const SHARE_OF_ROOM: f64 = 0.25;

/// How much of what was learnt of guesses is kept from one time to the next.
const KEPT_OF_SCALE: f64 = 0.8;

/// The pictures are drawn whole again whenever so much of the triangles has gone.
const CHECK_EVERY: f64 = 0.1;

/// A mesh that is simplified for one distance after another.
pub struct Simplifier<'a> {
    subject: Subject<'a>,
    /// What it is judged by, where that is another one.
    original: Option<Subject<'a>>,
    settings: Settings,
    surface: Surface,
    /// For each point that is left, the points of the original that it stands for, itself left out.
    held: Vec<Vec<u32>>,
}

/// An edge that was drawn: to the one end, or also to the other.
struct Tried {
    ends: Vec<Collapse>,
    /// The part of each view that it may change.
    parts: Vec<Option<Part>>,
    /// How many samples all views take of what may change, on average.
    samples: f64,
    /// What it is guessed to change.
    guess: f64,
}

/// What came of it, at the end that is better.
struct Scored {
    tried: usize,
    end: usize,
    /// What it is taken to add to the sum of squared changes.
    added: f64,
    /// What it adds to that in the pictures.
    change: f64,
    /// What it adds to the sum of squared errors.
    error: f64,
}

impl Scored {
    /// Of an edge that was not drawn by itself.
    fn unseen() -> Self {
        Self {
            tried: 0,
            end: 0,
            added: 0.0,
            change: 0.0,
            error: 0.0,
        }
    }
}

/// What is known at one distance.
struct Round<'a, 's> {
    simplifier: &'s mut Simplifier<'a>,
    views: Vec<View>,
    triangles: Triangles,
    samples: Samples,
    pixels_per_unit: f64,
    /// For each point its best edge by the guess; none where there is none.
    best: Vec<Option<(f64, u32)>>,
    /// Whether that has to be found anew.
    stale: Vec<bool>,
    /// What guesses at each point are multiplied by.
    factors: Vec<f64>,
    /// Sums of what edges changed, and of what was guessed, the latest of them most.
    scale: [f64; 2],
    /// The sum of errors.
    error: f64,
    /// The sum of changes.
    change: f64,
    steps: Vec<Step>,
    coverage: f64,
}

impl<'a> Simplifier<'a> {
    /// Of the mesh of the subject's scene.
    pub fn new(subject: Subject<'a>, settings: Settings) -> Self {
        let surface = Surface::new(&subject.scene.mesh);
        Self {
            held: vec![Vec::new(); surface.points()],
            subject,
            original: None,
            settings,
            surface,
        }
    }

    /// Of the mesh of the subject's scene, as its pictures are judged by those of another subject: the original shader on the original mesh,
    /// in the same scene.
    pub fn against(original: Subject<'a>, subject: Subject<'a>, settings: Settings) -> Self {
        Self {
            original: Some(original),
            ..Self::new(subject, settings)
        }
    }

    /// The surface as it is.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Goes on from a mesh that a sequence went through, instead of the last one: what came after so many of its steps is
    /// taken back.
    pub fn go_back(&mut self, sequence: &Sequence, steps: usize) {
        let undone = sequence.steps.get(steps..).unwrap_or_default();
        for step in undone.iter().rev() {
            let Collapse { from, to, .. } = step.collapse;
            // What came with the point lies behind it, in the order in which it came.
            let list = &mut self.held[to as usize];
            if let Some(at) = list.iter().rposition(|point| *point == from) {
                let mut back = list.split_off(at);
                back.remove(0);
                self.held[from as usize] = back;
            }
        }
        self.surface = sequence.surface(steps);
    }

    /// Simplifies further, as the mesh is seen at a distance from the eye to the object's centre, world units. `watch` is told
    /// after each round.
    pub fn run(&mut self, distance: f64, until: Until, watch: &dyn Fn(Watch)) -> Sequence {
        let subject = self.subject;
        let scene = subject.scene;
        let count = self.settings.views;
        let pictures = match self.original {
            None => Pictures::all_around(subject, distance, count),
            Some(original) => Pictures::against(original, subject, distance, count),
        };
        let (coverage, floor) = (pictures.coverage, pictures.floor());
        let triangles = Triangles::left(&self.surface, &scene.mesh);
        let pixels_per_unit = autolod::rho(&scene.view(distance));
        let weights = weights(&pictures, (&self.surface, &triangles), pixels_per_unit);
        let weight = |triangle: u32| weights.get(triangle as usize).copied();
        let samples = Samples::new(&self.surface, &scene.mesh, |triangle| {
            weight(triangle).unwrap_or_default()
        });

        let points = self.surface.points();
        let start = self.surface.clone();
        let mut round = Round {
            simplifier: self,
            views: pictures.views,
            triangles,
            samples,
            pixels_per_unit,
            best: vec![None; points],
            stale: vec![true; points],
            factors: vec![1.0; points],
            scale: [0.0; 2],
            error: 0.0,
            change: 0.0,
            steps: Vec::new(),
            coverage,
        };
        round.look_at_all();
        let square = round.error / coverage;
        let left = start.triangle_count();
        let (fewest, most_error) = match until {
            Until::Triangles(count) => (count, f64::INFINITY),
            Until::Error(excess) => (0, (floor + excess * excess) * coverage),
        };
        let mut checked = left;
        loop {
            let now = round.simplifier.surface.triangle_count();
            if now <= fewest || !round.go(fewest, most_error) {
                break;
            }
            let now = round.simplifier.surface.triangle_count();
            if (now as f64) < (1.0 - CHECK_EVERY) * checked as f64 {
                round.look_at_all();
                checked = now;
            }
            watch(Watch {
                triangles: now,
                excess: (round.error / coverage - floor).max(0.0).sqrt(),
            });
        }
        let mut sequence = Sequence {
            distance,
            floor,
            start,
            triangles: left,
            square,
            steps: round.steps,
        };
        // Guesses may have gone too far.
        let is_over = |step: &Step| step.square * coverage > most_error;
        let over = sequence
            .steps
            .iter()
            .rev()
            .take_while(|step| is_over(step))
            .count();
        let within = sequence.steps.len() - over;
        self.go_back(&sequence, within);
        sequence.steps.truncate(within);
        sequence
    }

    /// Whether the rule allows an edge to go.
    fn allows(&self, collapse: &Collapse, pixels_per_unit: f64) -> bool {
        let most = self.settings.most_pixels / pixels_per_unit;
        let place = |point: u32| self.surface.position(point);
        let (from, to) = (place(collapse.from), place(collapse.to));
        if self.settings.rule == EdgeRule::Length {
            return from.distance(to) <= most;
        }
        // A point that has gone is no farther from the surface than from the triangles that take its place.
        let corners = collapse
            .moved
            .iter()
            .map(|(_, corners)| corners.map(|vertex| place(self.surface.point_of(vertex))));
        let corners: Vec<[DVec3; 3]> = corners.collect();
        let held = self.held[collapse.from as usize]
            .iter()
            .map(|point| place(*point));
        let is_near = |point: DVec3| {
            point.distance(to) <= most
                || corners.iter().any(|corners| {
                    lodc_mesh::nearest_in_triangle(point, *corners).distance(point) <= most
                })
        };
        is_near(from) && held.into_iter().all(is_near)
    }
}

impl Round<'_, '_> {
    /// Draws all views whole.
    fn look_at_all(&mut self) {
        let (subject, triangles) = (&self.simplifier.subject, &self.triangles);
        self.views.par_iter_mut().for_each(|view| {
            let picture = view.look(subject, triangles, &view.squares(true));
            view.show(picture);
        });
        self.error = self.views.iter().map(|view| view.picture().error()).sum();
        self.change = self.views.iter().map(|view| view.picture().change()).sum();
    }

    /// Finds the best edge of each point where that may have changed.
    fn guess(&mut self) {
        let (surface, samples) = (&self.simplifier.surface, &self.samples);
        let best = |point: u32| {
            let edges = surface.neighbours(point).into_iter();
            let costs = edges.filter_map(|to| {
                let collapse = surface.collapse(point, to).ok()?;
                Some((samples.cost(surface, &collapse), to))
            });
            costs.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        };
        let all = self.best.par_iter_mut().zip(&mut self.stale).enumerate();
        all.for_each(|(point, (kept, stale))| {
            if std::mem::take(stale) {
                *kept = best(point as u32);
            }
        });
    }

    /// One round; whether an edge went.
    fn go(&mut self, fewest: usize, most_error: f64) -> bool {
        self.guess();
        let guesses = self.best.iter().zip(&self.factors).enumerate();
        let guesses = guesses.filter_map(|(point, (best, factor))| {
            let (cost, to) = (*best)?;
            Some((cost * factor, point as u32, to))
        });
        let mut order: Vec<(f64, u32, u32)> = guesses.collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (small, set) = self.choose(&order, fewest, most_error);
        let mut has_gone = !small.is_empty();
        self.take_small(&small);
        if set.is_empty() {
            return has_gone;
        }
        let pictures = self.try_both_ends(&set);
        let mut scored = self.score(&set, &pictures);
        self.learn(scored.iter().map(|one| (one.added, set[one.tried].guess)));
        let scale = self.scale();
        for one in &mut scored {
            // A few samples say little: the guess is worth so many.
            let tried = &set[one.tried];
            let share = WORTH_OF_GUESS / (WORTH_OF_GUESS + tried.samples);
            one.added += share * (scale * tried.guess - one.added);
        }
        scored.sort_unstable_by(|a, b| a.added.total_cmp(&b.added).then(a.tried.cmp(&b.tried)));
        let accepted = ((scored.len() as f64 * self.simplifier.settings.accepted).ceil()) as usize;
        for (place, one) in scored.iter().enumerate() {
            let tried = &set[one.tried];
            let from = tried.ends[0].from as usize;
            let fits = self.error + one.error <= most_error;
            let left = self.simplifier.surface.triangle_count();
            if left > fewest && fits && (place < accepted || one.added <= 0.0) {
                self.take(tried, one, &pictures[one.end]);
                has_gone = true;
                continue;
            }
            // What was measured takes the place of the guess; what the bound forbids is not tried again as long as nothing
            // changes around it.
            match self.best[from] {
                Some((cost, _)) if fits && cost > 0.0 => {
                    self.factors[from] = one.added.max(0.0) / (cost * scale);
                }
                Some((_, to)) if fits => {
                    self.best[from] = Some((one.added.max(0.0) / scale, to));
                }
                _ => self.best[from] = None,
            }
        }
        // Without one that fits, others may.
        has_gone || order.len() > set.len()
    }

    /// Edges of the cheapest that do not meet: those that are too small for the pictures to judge them singly, and those whose
    /// squares do not meet either.
    fn choose(
        &mut self,
        order: &[(f64, u32, u32)],
        fewest: usize,
        most_error: f64,
    ) -> (Vec<Tried>, Vec<Tried>) {
        let share = (order.len() as f64 * self.simplifier.settings.share).ceil() as usize;
        let most = share.max(LEAST_OF_ROUND);
        // Each edge takes a triangle or two.
        let left = self.simplifier.surface.triangle_count();
        let room = left.saturating_sub(fewest).div_ceil(2).max(1);
        let (mut small, mut set): (Vec<Tried>, Vec<Tried>) = (Vec::new(), Vec::new());
        let mut guessed = 0.0;
        let most_guessed = SHARE_OF_ROOM * (most_error - self.error) / self.scale();
        let views = self.views.iter();
        let mut claimed: Vec<_> = views.map(|v| Squares::new(v.size(), false)).collect();
        let mut taken = vec![false; self.best.len()];
        for (number, chunk) in order.chunks(CHUNK).enumerate() {
            let count = small.len() + set.len();
            if number * CHUNK >= most && count > 0 || count >= room {
                break;
            }
            let tried: Vec<_> = chunk
                .par_iter()
                .map(|(guess, from, to)| self.edge(*guess, *from, *to))
                .collect();
            for (tried, (_, from, to)) in tried.into_iter().zip(chunk) {
                let Some(tried) = tried else {
                    self.best[*from as usize] = None;
                    continue;
                };
                if small.len() + set.len() >= room {
                    break;
                }
                let surface = &self.simplifier.surface;
                let around = [*from, *to].map(|point| surface.neighbours(point));
                if around.iter().flatten().any(|point| taken[*point as usize]) {
                    continue;
                }
                let is_small = tried.samples < FEWEST_SAMPLES;
                if is_small {
                    if guessed + tried.guess > most_guessed {
                        continue;
                    }
                    guessed += tried.guess;
                } else {
                    let mut parts = claimed.iter().zip(&tried.parts);
                    if parts.any(|(claimed, part)| {
                        part.as_ref().is_some_and(|part| claimed.any(&part.0))
                    }) {
                        continue;
                    }
                    for (claimed, part) in claimed.iter_mut().zip(&tried.parts) {
                        if let Some(part) = part {
                            claimed.mark(&part.0);
                        }
                    }
                }
                taken[*from as usize] = true;
                taken[*to as usize] = true;
                match is_small {
                    true => small.push(tried),
                    false => set.push(tried),
                }
            }
        }
        (small, set)
    }

    /// What guesses are to be multiplied by.
    fn scale(&self) -> f64 {
        let [measured, guessed] = self.scale;
        let scale = measured / guessed;
        if scale.is_finite() && scale > 0.0 {
            scale
        } else {
            1.0
        }
    }

    /// Takes note of what was measured, and of what was guessed of that.
    fn learn(&mut self, pairs: impl Iterator<Item = (f64, f64)>) {
        let mut sums = [0.0; 2];
        for (measured, guessed) in pairs {
            sums[0] += measured;
            sums[1] += guessed;
        }
        for (kept, new) in self.scale.iter_mut().zip(sums) {
            *kept = KEPT_OF_SCALE * *kept + new;
        }
    }

    /// Lets small edges go by the guess, and draws what came of all together.
    fn take_small(&mut self, small: &[Tried]) {
        if small.is_empty() {
            return;
        }
        let (first, error, change) = (self.steps.len(), self.error, self.change);
        for tried in small {
            self.take(tried, &Scored::unseen(), &[]);
        }
        self.look_at_all();
        let guessed: f64 = small.iter().map(|tried| tried.guess).sum();
        self.learn([((self.change - change).max(0.0), guessed)].into_iter());
        // What came of each alone is not known.
        let count = small.len() as f64;
        for (place, step) in (1..).zip(&mut self.steps[first..]) {
            let share = f64::from(place) / count;
            step.square = (error + share * (self.error - error)) / self.coverage;
        }
    }

    /// An edge with what it may change; none that may not go.
    fn edge(&self, guess: f64, from: u32, to: u32) -> Option<Tried> {
        let surface = &self.simplifier.surface;
        let allowed = |from, to| {
            let collapse = surface.collapse(from, to).ok()?;
            let fits = self.simplifier.allows(&collapse, self.pixels_per_unit);
            fits.then_some(collapse)
        };
        let first = allowed(from, to)?;
        let worth = HOPELESS * self.samples.cost(surface, &first);
        let other = allowed(to, from);
        let other = other.filter(|other| self.samples.cost(surface, other) <= worth);
        let mut ends = vec![first];
        ends.extend(other);
        let mut samples = 0.0;
        let mut parts = Vec::with_capacity(self.views.len());
        for view in &self.views {
            let part = self.part(view, &ends)?;
            samples += part.as_ref().map_or(0.0, |(_, area)| *area);
            parts.push(part.map(|(part, _)| part));
        }
        Some(Tried {
            parts,
            ends,
            samples,
            guess,
        })
    }

    /// The part of a view that an edge may change, and how many pixels its triangles have there; inner none where it changes
    /// nothing, outer none where it cannot be told.
    fn part(&self, view: &View, ends: &[Collapse]) -> Option<Option<(Part, f64)>> {
        let surface = &self.simplifier.surface;
        let spots = view.retained().on_screen();
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let mut nearest = f32::INFINITY;
        let mut area = 0.0;
        for (end, collapse) in ends.iter().enumerate() {
            for triangle in surface.around(collapse.from) {
                let mut at = [[0.0; 2]; 3];
                for (at, vertex) in at.iter_mut().zip(surface.triangle(*triangle)?) {
                    let spot = (*spots.get(vertex as usize)?)?;
                    nearest = nearest.min(spot.depth);
                    *at = spot.at;
                    for i in [0, 1] {
                        low[i] = low[i].min(spot.at[i]);
                        high[i] = high[i].max(spot.at[i]);
                    }
                }
                if end == 0 {
                    let [[ax, ay], [bx, by], [cx, cy]] = at;
                    area += ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)).abs() / 2.0;
                }
            }
        }
        let Some(part) = Squares::around(view.size(), low, high).map(Part) else {
            return Some(None);
        };
        let is_hidden = nearest > view.picture().farthest(&part, view.size());
        Some((!is_hidden).then_some((part, f64::from(area))))
    }

    /// The pictures with all edges of a set moved to the one end, and to the other, where that is allowed; none where nothing changes.
    fn try_both_ends(&self, set: &[Tried]) -> [Vec<Option<Picture>>; 2] {
        let subject = &self.simplifier.subject;
        let changed = [0, 1].map(|end| {
            let mut triangles = self.triangles.clone();
            for tried in set {
                if let Some(collapse) = tried.ends.get(end) {
                    put(&mut triangles, collapse);
                }
            }
            triangles
        });
        let views = self.views.par_iter().enumerate();
        let pairs = views.map(|(number, view)| {
            [0, 1].map(|end| {
                let mut squares = view.squares(false);
                for tried in set.iter().filter(|tried| tried.ends.len() > end) {
                    if let Some(part) = &tried.parts[number] {
                        squares.mark(&part.0);
                    }
                }
                (!squares.is_empty()).then(|| view.look(subject, &changed[end], &squares))
            })
        });
        let (one, other) = pairs.map(|[one, other]| (one, other)).unzip();
        [one, other]
    }

    /// What each edge of a set adds to the sum of errors, at its better end.
    fn score(&self, set: &[Tried], pictures: &[Vec<Option<Picture>>; 2]) -> Vec<Scored> {
        let of = |(number, tried): (usize, &Tried)| {
            let ends = 0..tried.ends.len();
            let added = ends.map(|end| {
                let views = self.views.iter().zip(&pictures[end]).zip(&tried.parts);
                let (mut change, mut error) = (0.0, 0.0);
                for ((view, picture), part) in views {
                    if let (Some(picture), Some(part)) = (picture, part) {
                        let (size, before) = (view.size(), view.picture());
                        change += picture.change_of(part, size) - before.change_of(part, size);
                        error += picture.error_of(part, size) - before.error_of(part, size);
                    }
                }
                (change, error, end)
            });
            // Of equal ones the first, which the guess prefers.
            let best = added.min_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
            let (added, error, end) = best.unwrap_or_default();
            Scored {
                tried: number,
                end,
                added,
                change: added,
                error,
            }
        };
        set.par_iter().enumerate().map(of).collect()
    }

    /// Lets an edge go.
    fn take(&mut self, tried: &Tried, one: &Scored, pictures: &[Option<Picture>]) {
        let collapse = &tried.ends[one.end];
        let (from, to) = (collapse.from as usize, collapse.to as usize);
        for ((view, part), picture) in self.views.iter_mut().zip(&tried.parts).zip(pictures) {
            if let (Some(picture), Some(part)) = (picture, part) {
                view.show_part(picture, part);
            }
        }
        put(&mut self.triangles, collapse);
        let scale = self.scale();
        let simplifier = &mut *self.simplifier;
        self.samples.apply(&simplifier.surface, collapse);
        simplifier.surface.apply(collapse);
        self.error += one.error;
        self.change += one.change;
        self.steps.push(Step {
            collapse: collapse.clone(),
            square: self.error / self.coverage,
            triangles: simplifier.surface.triangle_count(),
        });
        let mut held = std::mem::take(&mut simplifier.held[from]);
        simplifier.held[to].push(collapse.from);
        simplifier.held[to].append(&mut held);
        self.best[from] = None;
        // The guess was as wrong as this around here.
        if one.end == 0 && tried.guess > 0.0 && one.added > 0.0 {
            let ratio =
                (one.added / (tried.guess * scale)).clamp(1.0 / MOST_CORRECTION, MOST_CORRECTION);
            self.factors[to] = (self.factors[to] * self.factors[from] * ratio).sqrt();
        }
        self.stale[to] = true;
        for point in simplifier.surface.neighbours(collapse.to) {
            self.stale[point as usize] = true;
        }
    }
}

/// Puts a collapse into a list of triangles.
fn put(triangles: &mut Triangles, collapse: &Collapse) {
    for triangle in &collapse.removed {
        triangles.0[*triangle as usize] = None;
    }
    for (triangle, corners) in &collapse.moved {
        triangles.0[*triangle as usize] = Some(*corners);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::normal_form;
    use crate::eval::program::Program;
    use crate::front::Source;
    use crate::mesh::Pictures;
    use crate::scene::Scene;
    use crate::scene::mesh::Mesh;
    use lodc_passes::Stage;
    use std::path::Path;
    use std::sync::Arc;

    /// A material of the repository on one of its objects, in small pictures; `test` gets what is drawn.
    fn with(material: &str, mesh: Option<Mesh>, test: impl FnOnce(Subject<'_>, f64)) {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
        let source = Source::read(&root.join(material).with_extension("wgsl")).expect("it parses");
        let base = normal_form(&source).expect("it is small");
        let programs = [Stage::Vertex, Stage::Fragment].map(|stage| {
            let entry = base.index(stage).expect("it has one");
            Program::compile(base.module(), entry, &[]).expect("it runs")
        });
        let mut scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
        scene.resolution = [96, 96];
        if let Some(mesh) = mesh {
            scene.mesh = Arc::new(mesh);
        }
        let distance = 3.0 * scene.sphere.radius;
        let subject = Subject {
            vertex: &programs[0],
            fragment: &programs[1],
            scene: &scene,
        };
        test(subject, distance);
    }

    const FEW: Settings = Settings {
        views: 6,
        rule: EdgeRule::Deviation,
        most_pixels: 1.0,
        share: 0.15,
        accepted: 0.75,
    };

    #[test]
    fn the_error_that_is_kept_is_that_of_the_pictures() {
        for material in ["pbr", "ivy", "clay"] {
            with(material, None, |subject, distance| {
                let mut simplifier = Simplifier::new(subject, FEW);
                let rounds = std::cell::RefCell::new(Vec::new());
                let sequence = simplifier.run(distance, Until::Triangles(3200), &|now| {
                    rounds.borrow_mut().push(now);
                });
                let rounds = rounds.into_inner();
                assert!(
                    rounds.len() > 10 && sequence.steps.len() > 100,
                    "{material}"
                );
                let pictures = Pictures::all_around(subject, distance, FEW.views);
                assert_eq!(pictures.floor(), sequence.floor);
                // Within a round it is not known what each of the small edges does.
                for round in [
                    rounds[0],
                    rounds[rounds.len() / 2],
                    rounds[rounds.len() - 1],
                ] {
                    let steps = sequence.steps.iter();
                    let steps = steps
                        .take_while(|step| step.triangles >= round.triangles)
                        .count();
                    let surface = sequence.surface(steps);
                    let triangles = Triangles::left(&surface, &subject.scene.mesh);
                    assert_eq!(triangles.count(), round.triangles);
                    let square = pictures.square(&triangles);
                    // Sums of as many numbers in another order.
                    let off = (square - sequence.steps[steps - 1].square).abs();
                    assert!(
                        off < 1e-9 + 1e-6 * square,
                        "{material}: {square}, off {off}"
                    );
                    let excess = pictures.excess(&triangles);
                    assert!((excess - round.excess).abs() < 1e-5, "{material}: {excess}");
                }
            });
        }
    }

    #[test]
    fn a_deferred_material_loses_edges_that_its_pictures_show() {
        with("gbuffer", None, |subject, distance| {
            let all = subject.scene.mesh.indices.len() / 3;
            let mut simplifier = Simplifier::new(subject, FEW);
            simplifier.run(distance, Until::Triangles(all / 4), &|_| {});
            let left = simplifier.surface().triangle_count();
            assert!(left <= all / 4, "{left} of {all}");
        });
    }

    #[test]
    fn a_bound_is_kept_and_a_smaller_one_leaves_more() {
        with("pbr", None, |subject, distance| {
            let left = [0.004, 0.02].map(|bound| {
                let mut simplifier = Simplifier::new(subject, FEW);
                let sequence = simplifier.run(distance, Until::Error(bound), &|_| {});
                assert!(sequence.excess(sequence.steps.len()) <= bound);
                simplifier.surface().triangle_count()
            });
            let all = subject.scene.mesh.indices.len() / 3;
            assert!(left[1] < left[0] && left[0] < all, "{left:?} of {all}");
        });
    }

    #[test]
    fn the_result_is_the_same_with_any_number_of_threads() {
        let of = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().expect("there are threads").install(|| {
                let mut found = Vec::new();
                with("pbr", None, |subject, distance| {
                    let mut simplifier = Simplifier::new(subject, FEW);
                    let sequence = simplifier.run(distance, Until::Triangles(3600), &|_| {});
                    let steps = sequence.steps.iter();
                    found = steps
                        .map(|s| (s.collapse.from, s.collapse.to, s.square.to_bits()))
                        .collect();
                });
                found
            })
        };
        let alone = of(1);
        assert!(alone.len() > 100);
        assert_eq!(alone, of(3));
    }

    #[test]
    fn the_paper_s_rule_refuses_long_edges_and_ends_early() {
        with("pbr", None, |subject, distance| {
            let left = [EdgeRule::Length, EdgeRule::Deviation].map(|rule| {
                let mut simplifier = Simplifier::new(subject, Settings { rule, ..FEW });
                simplifier.run(distance, Until::Error(0.05), &|_| {});
                simplifier.surface().triangle_count()
            });
            assert!(left[0] > 2 * left[1], "{left:?}");
        });
    }

    #[test]
    fn no_point_that_went_is_farther_away_than_allowed() {
        with("pbr", None, |subject, distance| {
            let scene = subject.scene;
            let mut simplifier = Simplifier::new(subject, FEW);
            simplifier.run(distance, Until::Error(0.1), &|_| {});
            let surface = simplifier.surface();
            let tree = lodc_mesh::Tree::new(&surface.mesh(&scene.mesh));
            let most = FEW.most_pixels / autolod::rho(&scene.view(distance));
            let gone = (0..surface.points() as u32).map(|point| surface.position(point));
            let far = gone.map(|place| tree.nearest(place).map_or(0.0, |n| n.distance));
            let far = far.fold(0.0, f64::max);
            // What stands for a point may move on without it.
            assert!(far <= 3.0 * most, "{far} {most}");
        });
    }

    #[test]
    fn a_simplification_goes_back_to_any_of_its_meshes() {
        with("pbr", None, |subject, distance| {
            let mut simplifier = Simplifier::new(subject, FEW);
            let before = simplifier.held.clone();
            let sequence = simplifier.run(distance, Until::Triangles(3600), &|_| {});
            let half = sequence.steps.len() / 2;
            simplifier.go_back(&sequence, half);
            assert_eq!(
                simplifier.surface().triangle_count(),
                sequence.steps[half - 1].triangles
            );
            let held: usize = simplifier.held.iter().map(Vec::len).sum();
            assert_eq!(held, half);
            simplifier.go_back(&sequence, 0);
            assert_eq!(simplifier.held, before);
        });
    }

    #[test]
    fn what_is_worth_keeping_is_spread_over_the_changes_of_error() {
        with("pbr", None, |subject, distance| {
            let mut simplifier = Simplifier::new(subject, FEW);
            let sequence = simplifier.run(distance, Until::Triangles(3000), &|_| {});
            let all = sequence.steps.len();
            for most in [1, 10, 100, 100_000] {
                let kept = sequence.worth_keeping(most);
                assert!(
                    kept.len() <= most && kept.last() == Some(&all),
                    "{most}: {kept:?}"
                );
                assert!(kept.is_sorted() && kept.first().is_some_and(|first| *first > 0));
                assert!(kept.len() >= most.min(all) / 4, "{most}: {}", kept.len());
            }
        });
    }
}
