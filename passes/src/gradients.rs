//! Explicit gradients: a fragment stage that may be called in control flow that is not uniform, and what has to be
//! computed before that.
//!
//! Texture samples without a level, and derivatives by name, look at the neighbouring pixels, which have to be there. Here
//! each becomes an input of the fragment stage, and the front, a function of the same inputs, computes those inputs where
//! all pixels are together. Coordinates that depend on other samples bring them along.

use crate::edit::append;
use crate::live::keep_needed;
use crate::operands;
use crate::shader::{Shader, Stage, ValueId};
use crate::{Edit, New};
use naga::{
    AddressSpace, BinaryOperator, Binding, Block, DerivativeAxis, DerivativeControl, Expression,
    Function, FunctionArgument, Handle, ImageClass, ImageDimension, Interpolation, MathFunction,
    SampleLevel, Span, Statement, StorageAccess, TypeInner,
};
use std::collections::{BTreeMap, BTreeSet};

/// A fragment stage that derives nothing.
#[derive(Clone, Debug)]
pub struct Explicit {
    /// The shader, whose fragment stage has an input for each gradient behind its own. They have locations only so that
    /// they are inputs.
    pub shader: Shader,
    /// For each of those inputs, in their order, which of the front's gradients it is.
    pub inputs: Vec<usize>,
    /// What computes the gradients.
    pub front: Front,
}

/// The function that computes gradients from a fragment stage's own inputs. It ends with the return of all of them as one
/// value, whose type is to be a struct, and has no result until that is there.
#[derive(Clone, Debug)]
pub struct Front {
    /// Its inputs are those of the fragment stage.
    pub function: Function,
    /// The id of each value; `None` for those that are made here.
    pub ids: Vec<Option<ValueId>>,
    /// For each gradient its name and its type, in the order in which they are returned.
    pub gradients: Vec<(String, TypeInner)>,
}

/// Why a fragment stage cannot do without derivatives, and where.
#[derive(Clone, Debug)]
pub struct NotExplicit {
    /// What is in the way, for people.
    pub why: &'static str,
    /// The value in the fragment stage.
    pub value: Handle<Expression>,
}

/// A fragment stage with explicit gradients; `None` where it derives nothing as it is.
///
/// # Errors
/// When something that is derived is known only on the way, or has no form with a gradient.
pub fn explicit(shader: &Shader) -> Result<Option<Explicit>, NotExplicit> {
    let Some(old) = shader.function(Stage::Fragment) else {
        return Ok(None);
    };
    let wanted = wanted(shader, old)?;
    if wanted.is_empty() {
        return Ok(None);
    }
    let alike = alike(old);
    let mut slots: Vec<Slot> = Vec::new();
    let mut inputs: BTreeMap<Handle<Expression>, Vec<usize>> = BTreeMap::new();
    for Wanted {
        value,
        of,
        ref derived,
    } in wanted
    {
        let of_value = derived.iter().map(|(axis, control)| {
            let slot = Slot {
                of: alike[&of],
                axis: *axis,
                control: *control,
            };
            let known = slots.iter().position(|other| *other == slot);
            known.unwrap_or_else(|| {
                slots.push(slot);
                slots.len() - 1
            })
        });
        inputs.insert(value, of_value.collect());
    }
    let front = front(shader, old, &slots)?;

    let mut edit = Edit::new(shader, Stage::Fragment);
    let arguments: Vec<Handle<Expression>> = front
        .gradients
        .iter()
        .enumerate()
        .map(|(at, (name, inner))| {
            let argument = FunctionArgument {
                name: Some(name.clone()),
                ty: edit.ty(inner.clone()),
                binding: Some(Binding::Location {
                    location: u32::from(u16::MAX) + at as u32,
                    interpolation: Some(Interpolation::Perspective),
                    sampling: None,
                    blend_src: None,
                    per_primitive: false,
                }),
            };
            edit.add_argument(name.clone(), argument)
        })
        .collect();
    for (value, slots) in inputs {
        let path = shader.id(Stage::Fragment, value).path().to_owned();
        let new = match (&old.expressions[value], &slots[..]) {
            (sample @ Expression::ImageSample { level, .. }, [x, y]) => {
                let [x, y] = [arguments[*x], arguments[*y]].map(|gradient| match level {
                    // A bias is so many halvings of scale.
                    SampleLevel::Bias(bias) => {
                        let scale = Expression::Math {
                            fun: MathFunction::Exp2,
                            arg: *bias,
                            arg1: None,
                            arg2: None,
                            arg3: None,
                        };
                        let right = edit.add(format!("{path}.scale"), scale);
                        let scaled = Expression::Binary {
                            op: BinaryOperator::Multiply,
                            left: gradient,
                            right,
                        };
                        edit.add(format!("{path}.gradient"), scaled)
                    }
                    _ => gradient,
                });
                let mut sample = sample.clone();
                if let Expression::ImageSample { level, .. } = &mut sample {
                    *level = SampleLevel::Gradient { x, y };
                }
                edit.add(path, sample)
            }
            (_, [slot, ..]) => arguments[*slot],
            (_, []) => continue,
        };
        edit.replace(value, New::Value(new));
    }
    let shader = edit.finish();
    // Inputs are put in the order of their names.
    let arguments = shader.function(Stage::Fragment).into_iter();
    let arguments =
        arguments.flat_map(|function| function.arguments.iter().skip(old.arguments.len()));
    let place = |argument: &FunctionArgument| {
        let mut gradients = front.gradients.iter();
        gradients.position(|(name, _)| argument.name.as_ref() == Some(name))
    };
    let inputs = arguments.filter_map(place).collect();
    Ok(Some(Explicit {
        shader,
        inputs,
        front,
    }))
}

/// Something that looks at neighbouring pixels: the value, what it derives, and how.
struct Wanted {
    value: Handle<Expression>,
    of: Handle<Expression>,
    derived: Vec<(DerivativeAxis, DerivativeControl)>,
}

/// A gradient: of which of several like values, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slot {
    of: Handle<Expression>,
    axis: DerivativeAxis,
    control: DerivativeControl,
}

fn wanted(shader: &Shader, function: &Function) -> Result<Vec<Wanted>, NotExplicit> {
    let mut wanted = Vec::new();
    for (value, expression) in function.expressions.iter() {
        match *expression {
            Expression::Derivative { axis, ctrl, expr } => wanted.push(Wanted {
                value,
                of: expr,
                derived: vec![(axis, ctrl)],
            }),
            Expression::ImageSample {
                image,
                coordinate,
                level: SampleLevel::Auto | SampleLevel::Bias(_),
                depth_ref,
                gather: None,
                ..
            } => {
                let has_gradients = match *shader.type_of(Stage::Fragment, image) {
                    TypeInner::Image { dim, class, .. } => {
                        dim != ImageDimension::D1 && matches!(class, ImageClass::Sampled { .. })
                    }
                    _ => false,
                };
                if depth_ref.is_some() || !has_gradients {
                    let why = "such a texture has no sample with a gradient";
                    return Err(NotExplicit { why, value });
                }
                let axes = [DerivativeAxis::X, DerivativeAxis::Y];
                wanted.push(Wanted {
                    value,
                    of: coordinate,
                    // As hardware takes it for a sample: one for each square of four pixels.
                    derived: axes.map(|axis| (axis, DerivativeControl::Coarse)).to_vec(),
                });
            }
            _ => {}
        }
    }
    Ok(wanted)
}

/// For each value, the first one that is computed alike.
fn alike(function: &Function) -> BTreeMap<Handle<Expression>, Handle<Expression>> {
    let mut first: BTreeMap<String, Handle<Expression>> = BTreeMap::new();
    let mut alike = BTreeMap::new();
    for (value, expression) in function.expressions.iter() {
        let over = operands::map(expression, |operand| alike[&operand]);
        let same = match expression {
            // What is loaded from a variable depends on when.
            Expression::Load { .. } if !is_fixed(function, value) => value,
            _ => *first.entry(format!("{over:?}")).or_insert(value),
        };
        alike.insert(value, same);
    }
    alike
}

/// Whether a value alone, apart from what it is made of, is the same wherever it is computed.
fn is_fixed(function: &Function, value: Handle<Expression>) -> bool {
    match function.expressions[value] {
        Expression::LocalVariable(_)
        | Expression::CallResult(_)
        | Expression::AtomicResult { .. }
        | Expression::WorkGroupUniformLoadResult { .. }
        | Expression::RayQueryProceedResult
        | Expression::SubgroupBallotResult
        | Expression::SubgroupOperationResult { .. } => false,
        Expression::Load { pointer } => {
            let mut root = pointer;
            loop {
                match function.expressions[root] {
                    Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                        root = base;
                    }
                    Expression::GlobalVariable(_) => return true,
                    _ => return false,
                }
            }
        }
        _ => true,
    }
}

fn front(shader: &Shader, old: &Function, slots: &[Slot]) -> Result<Front, NotExplicit> {
    let module = shader.module();
    // All that the gradients are made of, in an order in which it can be computed.
    let mut needed: BTreeSet<Handle<Expression>> = BTreeSet::new();
    for slot in slots {
        let mut open = vec![slot.of];
        while let Some(value) = open.pop() {
            if !needed.insert(value) {
                continue;
            }
            let writes = match old.expressions[value] {
                Expression::GlobalVariable(variable) => {
                    match module.global_variables[variable].space {
                        AddressSpace::Private | AddressSpace::WorkGroup => true,
                        AddressSpace::Storage { access } => access.contains(StorageAccess::STORE),
                        _ => false,
                    }
                }
                _ => false,
            };
            if writes || !is_fixed(old, value) {
                let why = "it depends on a variable that changes on the way, so that it cannot be derived in front of a branch";
                return Err(NotExplicit {
                    why,
                    value: slot.of,
                });
            }
            operands::each(&old.expressions[value], |operand| open.push(operand));
        }
    }
    let mut function = old.clone();
    function.body = Block::new();
    function.result = None;
    for value in needed {
        if !function.expressions[value].needs_pre_emit() {
            let range = naga::Range::new_from_bounds(value, value);
            function.body.push(Statement::Emit(range), Span::UNDEFINED);
        }
    }
    let mut gradients: Vec<(String, TypeInner)> = Vec::new();
    let mut components = Vec::new();
    for slot in slots {
        let derivative = Expression::Derivative {
            axis: slot.axis,
            ctrl: slot.control,
            expr: slot.of,
        };
        let value = append(&mut function, derivative);
        let path = shader.id(Stage::Fragment, slot.of).path();
        let end = match slot.axis {
            DerivativeAxis::X => "across",
            DerivativeAxis::Y => "down",
            DerivativeAxis::Width => "width",
        };
        let wish = format!("{}_{end}", path.rsplit('.').next().unwrap_or(path));
        let mut names =
            std::iter::once(wish.clone()).chain((1..).map(|n| format!("{wish}_{}", "b".repeat(n))));
        let is_free = |name: &String| gradients.iter().all(|(taken, _)| taken != name);
        let name = names.find(is_free).unwrap_or(wish);
        let inner = shader.type_of(Stage::Fragment, slot.of).clone();
        gradients.push((name, inner));
        components.push(value);
    }
    // Which struct that is is decided where it is written.
    let Some((ty, _)) = module.types.iter().next() else {
        let (why, value) = ("it has no types", slots[0].of);
        return Err(NotExplicit { why, value });
    };
    let all = Expression::Compose { ty, components };
    let all = append(&mut function, all);
    let end = Statement::Return { value: Some(all) };
    function.body.push(end, Span::UNDEFINED);
    let kept = keep_needed(&function);
    let ids = kept.origins.iter().map(|origin| {
        let is_old = origin.index() < old.expressions.len();
        is_old.then(|| shader.id(Stage::Fragment, *origin).clone())
    });
    Ok(Front {
        ids: ids.collect(),
        function: kept.function,
        gradients,
    })
}
