//! Plans: what a collapse reads, what reads the new texture, and what computes its texels.

use super::seen::{Of, Sample, repeats, sample, seen_from};
use super::{Choice, Kind, STAGE, find};
use crate::Work;
use crate::edit::{Edit, New, part};
use crate::flow::{Flow, Value};
use crate::generated::{Generated, Read, settled};
use crate::interface::{Authors, Output};
use crate::operands::{self, User};
use crate::parameters::names;
use crate::recipe::{Candidate, Declined};
use crate::shader::Shader;
use crate::slice::{Around, Slice, Source};
use naga::{
    Binding, EntryPoint, Expression, Function, FunctionArgument, GlobalVariable, Handle,
    ImageClass, ImageDimension, Literal, LocalVariable, SampleLevel, Scalar, ScalarKind,
    ShaderStage, Span, Statement, TypeInner, VectorSize,
};
use std::sync::Arc;

/// The name of the bake's entry point, and what its paths begin with.
const BAKE: &str = "bake";

/// The longest edge of the texture of a value without one, in texels.
pub(super) const MOST_EDGE: u32 = 1024;

/// The longest edge of a texture that others are resampled into, in texels.
pub(super) const MOST_RESAMPLED: u32 = 4096;

/// A collapse that can be made.
pub(super) struct Plan<'a> {
    site: Value,
    pub(super) root: Value,
    /// What chooses the layer of the new texture, where that is an array.
    layer: Option<Value>,
    pub(super) kind: Kind,
    slice: Slice<'a>,
    /// The samples in the slice, in the order of the function.
    pub(super) samples: Vec<(Value, Sample)>,
    /// The sample that reads the new texture; `None` where there is none, and a new one does.
    carrier: Option<Value>,
    /// For each sample, how often its texture repeats.
    pub(super) repeats: Vec<[f32; 2]>,
}

impl<'a> Plan<'a> {
    pub(super) fn of_candidate(
        flow: &'a Flow<'a>,
        candidate: &Candidate,
    ) -> Result<Self, Declined> {
        let Choice { kind, root, layer } = Choice::parse(&candidate.choice)?;
        let site = find(flow, &candidate.site)?;
        let root = find(flow, &root)?;
        let layer = layer.map(|layer| find(flow, &layer)).transpose()?;
        let of = seen_from(flow, root, layer);
        let plan = match kind {
            Kind::Bake(edge) => Self::procedural(flow, (site, root), &of, edge)?,
            _ => Self::new(flow, site, (root, layer), &of)?,
        };
        if plan.layer != layer {
            return Err(Declined("it is in no such layer".into()));
        }
        match (kind, plan.kind) {
            // Textures that differ in size: it does the same, and promises less.
            (Kind::Levels, Kind::Same) => Ok(Self { kind, ..plan }),
            (Kind::Resampled(edge), Kind::Resampled(_)) => {
                match (1..=MOST_RESAMPLED).contains(&edge) {
                    true => Ok(Self { kind, ..plan }),
                    false => Err(Declined("no texture has such an edge".into())),
                }
            }
            _ if plan.kind == kind => Ok(plan),
            _ => Err(Declined(format!("it could be `{}`", plan.kind.word()))),
        }
    }

    pub(super) fn new(
        flow: &'a Flow<'a>,
        site: Value,
        (root, layer): (Value, Option<Value>),
        of: &[Of],
    ) -> Result<Self, Declined> {
        let no = |why: &str| Err(Declined(why.into()));
        let Of::Texels { linear, at_root } = of[site.index()] else {
            return no("more than texels and constants is in it");
        };
        if flow.floats(site).is_none() {
            return no("it is no float, or vector of floats");
        }
        let Some(slice) = known_slice(flow, site, (root, layer), of) else {
            return no("what ends a loop in it is more than texels and constants");
        };
        let around = slice.around();
        if around.contains(&Around::Loop) {
            return no("each round of a loop computes it anew");
        }
        if !around.is_empty()
            && (slice.has_variables() || slice.values().any(|v| has_hole(flow, v)))
        {
            return no("the branch around it may be there for a hole in its domain");
        }
        let samples: Vec<(Value, Sample)> = slice
            .values()
            .filter_map(|value| Some((value, sample(flow, value)?)))
            .collect();
        let Some((_, first)) = samples.first() else {
            return no("no texture is in it");
        };
        let sampler = |read: &Sample| flow.global(read.sampler);
        if samples
            .iter()
            .any(|(_, read)| sampler(read) != sampler(first))
        {
            return no("its samples have different samplers");
        }
        if samples.iter().any(|(_, read)| read.level != first.level) {
            return no("its samples choose their level of detail in different ways");
        }
        if !at_root && first.level != SampleLevel::Auto {
            return no("its samples are at different scales, at levels of detail that are given");
        }
        let of_texels = |value: Value| matches!(of[value.index()], Of::Texels { .. });
        let does = |value: Value| of_texels(value) && is_operation(flow, value);
        if samples.len() < 2 && !slice.values().any(does) {
            return no("it is one sample already");
        }
        let mut all_repeats = Vec::new();
        for (_, read) in &samples {
            all_repeats.push(match &of[read.coordinate.index()] {
                _ if read.coordinate == root => [1.0; 2],
                Of::Affine(rows) => repeats(rows).unwrap_or([1.0; 2]),
                _ => [1.0; 2],
            });
        }
        let layer = layer.filter(|layer| {
            let mut layers = samples.iter().map(|(_, read)| read.layer);
            layers.any(|of| of == Some(*layer))
        });
        let unneeded = unneeded(flow, &slice, site);
        let places = flow.shader.places(STAGE);
        let mut free = samples.iter().filter(|(value, read)| {
            let reaches = |operand: Value| places.reaches(operand, User::Value(*value));
            let reads_root = read.coordinate == root || reaches(root);
            let reads_layer = read.layer == layer || layer.is_none_or(reaches);
            unneeded[value.index()] && reads_root && reads_layer
        });
        let edit = Edit::new(flow.shader, STAGE);
        let Some((carrier, _)) = free.find(|(value, _)| edit.available(site, *value)) else {
            return no("something else needs all of its samples, so that there would be one more");
        };
        Ok(Self {
            site,
            root,
            layer,
            kind: match (at_root, linear) {
                (true, true) => Kind::Same,
                (true, false) => Kind::Levels,
                (false, _) => Kind::Resampled(MOST_RESAMPLED),
            },
            carrier: Some(*carrier),
            repeats: all_repeats,
            slice,
            samples,
        })
    }

    /// The bake of a value without a texture, with so many texels along each edge.
    pub(super) fn procedural(
        flow: &'a Flow<'a>,
        (site, root): (Value, Value),
        of: &[Of],
        edge: u32,
    ) -> Result<Self, Declined> {
        let no = |why: &str| Err(Declined(why.into()));
        if of[site.index()] != Of::Function || flow.floats(root) != Some(2) {
            return no("more than texture coordinates and constants is in it");
        }
        if flow.floats(site).is_none() {
            return no("it is no float, or vector of floats");
        }
        if !(1..=MOST_EDGE).contains(&edge) {
            return no("no texture has such an edge");
        }
        let Some(slice) = known_slice(flow, site, (root, None), of) else {
            return no("what ends a loop in it is more than texture coordinates and constants");
        };
        if !slice.around().is_empty() || !is_outermost(flow, site) {
            return no("it is in a branch, where a texture is not sampled with an implicit level");
        }
        if free_sampler(flow).is_none() {
            return no("there is no sampler to read a texture with");
        }
        Ok(Self {
            site,
            root,
            layer: None,
            kind: Kind::Bake(edge),
            slice,
            samples: Vec::new(),
            carrier: None,
            repeats: Vec::new(),
        })
    }

    /// The choice that makes it so.
    pub(super) fn choice(&self, flow: &Flow, kind: Kind) -> Choice {
        Choice {
            kind,
            root: flow.id(self.root).clone(),
            layer: self.layer.map(|layer| flow.id(layer).clone()),
        }
    }

    /// The work that the texture saves, in full-rate operations; endless where rounds of a loop are in it.
    pub(super) fn work(&self, works: &[Work]) -> f64 {
        if self.slice.has_variables() {
            return f64::INFINITY;
        }
        let sum = |sum: Work, value: Value| sum + works[value.index()];
        self.slice.values().fold(Work::default(), sum).total()
    }

    /// The names of the textures in it, in the order of the function.
    pub(super) fn textures<'f>(&'f self, flow: &'f Flow<'_>) -> impl Iterator<Item = &'f str> {
        let images = self
            .samples
            .iter()
            .filter_map(|(_, read)| flow.global(read.image));
        images.filter_map(|image| flow.module.global_variables[image].name.as_deref())
    }

    /// The names of those that are arrays, read in the layer of the new one.
    pub(super) fn layered<'f>(&'f self, flow: &'f Flow<'_>) -> impl Iterator<Item = &'f str> {
        let is_layered = self.samples.iter().map(|(_, read)| read.layer);
        let is_layered = is_layered.map(|layer| layer.is_some() && layer == self.layer);
        let all = self.textures(flow).zip(is_layered);
        all.filter_map(|(name, is_layered)| is_layered.then_some(name))
    }

    /// The shader with the collapse made.
    pub(super) fn make(&self, flow: &Flow) -> Shader {
        let components = flow.floats(self.site).expect("the site is of floats");
        // A texture is bound beside those that went into it, or beside its sampler.
        let beside = match self.samples.first() {
            Some((_, read)) => flow.global(read.image),
            None => free_sampler(flow),
        };
        let beside = beside.map(|beside| &flow.module.global_variables[beside]);
        let group = beside.and_then(|beside| beside.binding.map(|at| at.group));
        let group = group.unwrap_or(0);
        let bindings = flow.module.global_variables.iter();
        let last = bindings
            .filter_map(|(_, variable)| variable.binding)
            .filter(|at| at.group == group)
            .map(|at| at.binding)
            .max();
        let binding = (group, last.map_or(0, |last| last + 1));
        let generated = Generated {
            binding,
            is_cube: flow.floats(self.root) == Some(3),
            is_array: self.layer.is_some(),
            bake: Arc::new(self.bake(flow, components)),
            reads: self.reads(flow),
            edge: match self.kind {
                Kind::Bake(edge) | Kind::Resampled(edge) => Some(edge),
                Kind::Same | Kind::Levels => None,
            },
            components,
        };
        // The same texture is not made twice.
        let before = made_before(flow, &generated);
        let name = before.and_then(|before| flow.module.global_variables[before].name.clone());
        let name = name.unwrap_or_else(|| self.name(flow));
        let path = flow.id(self.site).path();
        let entry = path.split('.').next().unwrap_or(path);

        let mut edit = Edit::new(flow.shader, STAGE);
        let ty = TypeInner::Image {
            dim: match generated.is_cube {
                true => ImageDimension::Cube,
                false => ImageDimension::D2,
            },
            arrayed: generated.is_array,
            class: ImageClass::Sampled {
                kind: ScalarKind::Float,
                multi: false,
            },
        };
        let variable = match before {
            Some(variable) => variable,
            None => edit.add_texture(name.clone(), ty, generated),
        };
        let image = edit.add(
            format!("{entry}.{name}"),
            Expression::GlobalVariable(variable),
        );
        let carrier = match self.carrier {
            Some(carrier) => {
                let mut read = edit.expression(carrier).clone();
                if let Expression::ImageSample {
                    image: of,
                    coordinate,
                    array_index,
                    ..
                } = &mut read
                {
                    (*of, *coordinate, *array_index) = (image, self.root, self.layer);
                }
                edit.rewrite(carrier, read);
                edit.rename(carrier, format!("{path}.texel"));
                carrier
            }
            None => {
                let sampler = free_sampler(flow).expect("a plan without samples has one");
                let sampler = Expression::GlobalVariable(sampler);
                let sampler = edit.add(format!("{entry}.sampler"), sampler);
                edit.add(
                    format!("{path}.texel"),
                    Expression::ImageSample {
                        image,
                        sampler,
                        gather: None,
                        coordinate: self.root,
                        array_index: None,
                        offset: None,
                        level: SampleLevel::Auto,
                        depth_ref: None,
                        clamp_to_edge: false,
                    },
                )
            }
        };
        let read = match components {
            4 => carrier,
            count => edit.add(format!("{path}.collapsed"), part(carrier, 0, count)),
        };
        edit.replace(self.site, New::Value(read));
        settled(edit.finish())
    }

    /// Olano's name: that of the first texture in it, or of the value, behind a number that no other generated texture has.
    fn name(&self, flow: &Flow) -> String {
        let path = flow.id(self.site).path();
        let last = path.rsplit('.').next().unwrap_or(path);
        let last: String = last
            .chars()
            .map(|c| if c.is_alphanumeric() { c } else { '_' })
            .collect();
        let source = self.textures(flow).next().unwrap_or(&last);
        let taken = names(flow.module);
        let mut number = flow.shader.generated.len();
        loop {
            let name = format!("loctx_{number}_{source}");
            if !taken.contains(&name) {
                return name;
            }
            number += 1;
        }
    }

    fn reads(&self, flow: &Flow) -> Vec<Read> {
        let reads = self.samples.iter().zip(&self.repeats);
        reads
            .map(|((_, read), repeats)| {
                let image = flow.global(read.image);
                let at = image.and_then(|image| flow.module.global_variables[image].binding);
                Read {
                    binding: at.map_or((0, 0), |at| (at.group, at.binding)),
                    repeats: *repeats,
                    is_layered: read.layer.is_some() && read.layer == self.layer,
                }
            })
            .collect()
    }

    /// What computes a texel.
    fn bake(&self, flow: &Flow, components: usize) -> Shader {
        let mut module = flow.module.clone();
        let mut ty = |inner| {
            module
                .types
                .insert(naga::Type { name: None, inner }, Span::UNDEFINED)
        };
        let coordinates = ty(flow.inner(self.root).clone());
        let float = ty(TypeInner::Scalar(Scalar::F32));
        let texel = ty(TypeInner::Vector {
            size: VectorSize::Quad,
            scalar: Scalar::F32,
        });
        let layer = self.layer.map(|layer| ty(flow.inner(layer).clone()));
        let at = |location, ty| Binding::Location {
            location,
            interpolation: Some(match Some(ty) == layer {
                true => naga::Interpolation::Flat,
                false => naga::Interpolation::Perspective,
            }),
            sampling: (Some(ty) != layer).then_some(naga::Sampling::Center),
            blend_src: None,
            per_primitive: false,
        };
        let argument = |(location, name, ty)| FunctionArgument {
            name: Some(name),
            ty,
            binding: Some(at(location, ty)),
        };
        let behind = self.samples.len() as u32 + 1;
        let levels = (1..behind).map(|i| (i, format!("level_{i}"), float));
        let arguments = std::iter::once((0, "coordinates".to_owned(), coordinates)).chain(levels);
        let arguments = arguments.chain(layer.map(|ty| (behind, "layer".to_owned(), ty)));
        let mut function = Function {
            arguments: arguments.map(argument).collect(),
            ..Function::default()
        };
        let end = Statement::Return { value: None };
        function.body.push(end, Span::UNDEFINED);
        module.entry_points = vec![EntryPoint {
            name: BAKE.into(),
            stage: ShaderStage::Fragment,
            early_depth_test: None,
            workgroup_size: [0; 3],
            workgroup_size_overrides: None,
            function,
            mesh_info: None,
            task_payload: None,
            incoming_ray_payload: None,
        }];
        let authors = Authors::of(&module);
        let generated = flow.shader.generated.clone();
        let empty = Shader::changed(
            module,
            vec![Vec::new()],
            authors,
            generated,
            flow.shader.passes.clone(),
        );

        let mut edit = Edit::new(&empty, STAGE);
        let argument = |edit: &mut Edit<'_>, at: u32| {
            edit.add(format!("{BAKE}.argument"), Expression::FunctionArgument(at))
        };
        let coordinates = argument(&mut edit, 0);
        let levels = (1..behind).map(|at| argument(&mut edit, at));
        let levels = levels.collect();
        let layer = layer.map(|_| argument(&mut edit, behind));
        let mut source = OfBake {
            flow,
            plan: self,
            coordinates,
            levels,
            layer,
        };
        let value = self.slice.copy(&mut edit, &mut source);
        let path = format!("{BAKE}.texel");
        let mut parts = vec![value];
        if components < 4 {
            // What nobody reads is 1, so that the texture is opaque for people who look at it.
            for _ in components..4 {
                parts.push(edit.add(path.clone(), Expression::Literal(Literal::F32(1.0))));
            }
            parts = vec![edit.add(
                path,
                Expression::Compose {
                    ty: texel,
                    components: parts,
                },
            )];
        }
        let binding = Binding::Location {
            location: 0,
            interpolation: None,
            sampling: None,
            blend_src: None,
            per_primitive: false,
        };
        let output = Output {
            name: "texel".into(),
            ty: texel,
            binding,
        };
        edit.add_output(output, parts[0]);
        edit.finish()
    }
}

/// What a bake has for what it cannot copy.
struct OfBake<'p, 'a> {
    flow: &'p Flow<'p>,
    plan: &'p Plan<'a>,
    coordinates: Handle<Expression>,
    /// For each sample.
    levels: Vec<Handle<Expression>>,
    /// Of an array.
    layer: Option<Handle<Expression>>,
}

impl Source for OfBake<'_, '_> {
    fn instead(&mut self, _: &mut Edit<'_>, value: Value) -> Option<Handle<Expression>> {
        match value == self.plan.root {
            true => Some(self.coordinates),
            false => self.layer.filter(|_| Some(value) == self.plan.layer),
        }
    }

    fn path(&self, value: Value) -> String {
        format!("{BAKE}.{}", self.flow.id(value).path())
    }

    fn adapted(&mut self, _: &mut Edit<'_>, value: Value, expression: Expression) -> Expression {
        let mut samples = self.plan.samples.iter();
        match (samples.position(|(sample, _)| *sample == value), expression) {
            (
                Some(at),
                Expression::ImageSample {
                    image,
                    sampler,
                    gather,
                    coordinate,
                    array_index,
                    offset,
                    depth_ref,
                    clamp_to_edge,
                    ..
                },
            ) => Expression::ImageSample {
                image,
                sampler,
                gather,
                coordinate,
                array_index,
                offset,
                level: SampleLevel::Exact(self.levels[at]),
                depth_ref,
                clamp_to_edge,
            },
            (_, expression) => expression,
        }
    }
}

/// The variable of a texture that was made before and holds the same, in the same group.
fn made_before(flow: &Flow, generated: &Generated) -> Option<Handle<GlobalVariable>> {
    let mut all = flow.shader.generated.iter();
    let same = all.find(|made| {
        made.binding.0 == generated.binding.0 && made.definition() == generated.definition()
    })?;
    let mut variables = flow.module.global_variables.iter();
    let (variable, _) = variables.find(|(_, variable)| {
        let at = variable.binding.map(|at| (at.group, at.binding));
        at == Some(same.binding)
    })?;
    Some(variable)
}

fn has_hole(flow: &Flow, value: Value) -> bool {
    let mut found = false;
    operands::each(&flow.function.expressions[value], |operand| {
        found |= !flow.is_constant(operand) && flow.has_hole(value, operand);
    });
    found
}

/// Whether a value does something to others.
pub(super) fn is_operation(flow: &Flow, value: Value) -> bool {
    let does = matches!(
        flow.function.expressions[value],
        Expression::Unary { .. }
            | Expression::Binary { .. }
            | Expression::Select { .. }
            | Expression::Math { .. }
            | Expression::Relational { .. }
            | Expression::As { .. }
    );
    does && !flow.is_constant(value)
}

/// For each value of a slice, whether nothing but its site needs it.
fn unneeded(flow: &Flow, slice: &Slice<'_>, site: Value) -> Vec<bool> {
    let mut unneeded = vec![false; flow.function.expressions.len()];
    for value in slice.values() {
        unneeded[value.index()] = true;
    }
    // What a value is stored in, and what else states it.
    let mut stored: Vec<Vec<Handle<LocalVariable>>> = vec![Vec::new(); unneeded.len()];
    let mut stated = vec![false; unneeded.len()];
    operands::walk(&flow.function.body, &mut |statement| match *statement {
        Statement::Store { pointer, value } => match flow.local(pointer) {
            Some(local) => stored[value.index()].push(local),
            None => stated[value.index()] = true,
        },
        ref other => operands::each_of_statement(other, |operand| stated[operand.index()] = true),
    });
    let loads: Vec<(Value, Handle<LocalVariable>)> = flow
        .function
        .expressions
        .iter()
        .filter_map(|(value, expression)| match *expression {
            Expression::Load { pointer } => Some((value, flow.local(pointer)?)),
            _ => None,
        })
        .collect();
    loop {
        let before = unneeded.clone();
        for value in slice.values().filter(|value| *value != site) {
            let of_stored = |local: &Handle<LocalVariable>| {
                let mut own = loads.iter().filter(|(_, of)| of == local);
                own.all(|(load, _)| before[load.index()])
            };
            unneeded[value.index()] &= !stated[value.index()]
                && flow.users(value).all(|user| before[user.index()])
                && stored[value.index()].iter().all(of_stored);
        }
        if unneeded == before {
            return unneeded;
        }
    }
}

/// What a value is computed of down to its root and its layer; `None` when something in it is not known.
fn known_slice<'a>(
    flow: &'a Flow<'a>,
    site: Value,
    (root, layer): (Value, Option<Value>),
    of: &[Of],
) -> Option<Slice<'a>> {
    let mut ends = vec![false; flow.function.expressions.len()];
    let is_end = |value: Value| value == root || Some(value) == layer;
    for (value, _) in flow.function.expressions.iter() {
        ends[value.index()] = is_end(value);
    }
    let slice = Slice::up_to(flow, site, ends);
    let known = |value: Value| is_end(value) || of[value.index()] != Of::Unknown;
    let all_known = slice.values().all(known);
    all_known.then_some(slice)
}

/// Whether a value is computed, and used, outside of all branches and loops.
fn is_outermost(flow: &Flow, value: Value) -> bool {
    let body = &flow.function.body;
    let mut outermost = vec![false; flow.function.expressions.len()];
    let mut stated = false;
    for statement in body {
        if let Statement::Emit(range) = statement {
            range
                .clone()
                .for_each(|value| outermost[value.index()] = true);
        }
        for inner in operands::blocks(statement) {
            operands::walk(inner, &mut |statement| {
                operands::each_of_statement(statement, |operand| stated |= operand == value);
            });
        }
    }
    let mut users = flow.users(value);
    outermost[value.index()] && !stated && users.all(|user| outermost[user.index()])
}

/// A sampler that a new texture can be read with: the first one that compares nothing.
fn free_sampler(flow: &Flow) -> Option<Handle<GlobalVariable>> {
    let mut variables = flow.module.global_variables.iter();
    let plain = TypeInner::Sampler { comparison: false };
    let found = variables.find(|(_, variable)| flow.module.types[variable.ty].inner == plain);
    found.map(|(sampler, _)| sampler)
}
