//! Entry points around a shader's own, so that a GPU draws what the evaluator draws.
//!
//! The shader's entry point becomes an ordinary function, unchanged, and one that calls it takes its place:
//! - The vertex one moves clip positions, so that pixels are sampled off their centres.
//! - The fragment one says positions in the frame's pixels, whatever the grid and the offset, and returns each colour
//!   as four components, what the shader leaves out 0 and alpha 1. Where layers are drawn one by one, it draws those
//!   fragments alone that are behind the layer before.
//!
//! What they need of a frame is in a uniform buffer of their own ([`Place`]), so that one pipeline draws all frames.

use naga::{
    AddressSpace, ArraySize, BinaryOperator, Binding, Block, BuiltIn, EntryPoint, Expression,
    Function, FunctionArgument, FunctionResult, GlobalVariable, Handle, ImageClass, ImageDimension,
    Interpolation, Literal, Module, ResourceBinding, Scalar, ScalarKind, Span, Statement,
    StructMember, SwizzleComponent, Type, TypeInner, UnaryOperator, VectorSize,
};
use std::num::NonZeroU32;

/// The name of every entry point that is made here.
pub(super) const NAME: &str = "drawn";

/// Where a frame's fine pixels are: two vec4f, little-endian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// What is added to clip positions, over their w.
    shift: [f32; 2],
    /// Pixels to a fine pixel.
    scale: f32,
    /// Where in a pixel it is sampled, from the centre.
    offset: [f32; 2],
    /// Where layers are drawn: the first triangle of the draw among those of the mesh, and how it is blended.
    first: u32,
    blend: u32,
}

impl Place {
    /// The place of a picture of so many pixels, sampled by `offset` off their centres, with `grid` fine pixels to one.
    pub(super) fn new([width, height]: [u32; 2], offset: [f32; 2], grid: u32) -> Self {
        Self {
            shift: [
                -2.0 * offset[0] / width as f32,
                2.0 * offset[1] / height as f32,
            ],
            scale: 1.0 / grid as f32,
            offset,
            first: 0,
            blend: 0,
        }
    }

    /// The same of a draw whose layers are drawn: its first triangle among those of the mesh, and how it is blended,
    /// 0..=3. Both go through a float, which holds them exactly.
    pub(super) fn of_draw(self, first: u32, blend: u32) -> Self {
        Self {
            first,
            blend,
            ..self
        }
    }

    /// As the buffer holds it.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let [x, y] = self.shift;
        let words = [
            x,
            y,
            0.0,
            self.blend as f32,
            self.scale,
            self.offset[0],
            self.offset[1],
            self.first as f32,
        ];
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// A colour that a pipeline draws to a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Colour {
    /// The location at which the shader returns it.
    pub(super) location: u32,
    /// What the target holds of it; `None` for the bits of floats, as integers.
    pub(super) kind: Option<ScalarKind>,
}

/// What a fragment entry point draws to; behind the colours, 1 wherever anything is drawn, or the fragment's order where
/// layers are drawn.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Targets {
    /// The colours, each drawn to the target of its place in this list.
    pub(super) colours: Vec<Colour>,
    /// A texture of coverage, at its group and binding: where it is 0, nothing is drawn.
    pub(super) only_where: Option<(u32, u32)>,
    /// Whether the depth is written as the entry point sees it, 0..1, so that another one can compare its own with it to
    /// the bit.
    pub(super) writes_depth: bool,
    /// Where only what is behind a layer is drawn.
    pub(super) layer: Option<Behind>,
}

/// Textures by which one layer of a picture is drawn: what is in front of all that is opaque and behind the layer before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Behind {
    /// The depth of what is opaque, at its group and binding.
    pub(super) opaque: (u32, u32),
    /// The depth of the layer before.
    pub(super) depth: (u32, u32),
    /// The order of its fragments: of equally deep ones, the one of the last triangle is in front. It is four times a
    /// triangle's place among all, and how it is blended.
    pub(super) order: (u32, u32),
    /// Whether triangles can be told apart; if not, draws are, and of equally deep fragments of one only one is seen.
    pub(super) tells_triangles: bool,
}

/// The module with one vertex entry point, [`NAME`], around the one at `entry`.
pub(super) fn vertex(module: &Module, entry: usize, place: (u32, u32)) -> Module {
    let mut around = Around::new(module, entry, place);
    let arguments = around.arguments(|_, value| value);
    let (result, returned) = around.call(arguments);
    let Some((result, returned)) = result.zip(returned) else {
        return around.finish(None, None);
    };
    let moved = match &around.module.types[result.ty].inner {
        TypeInner::Struct { members, .. } => {
            let members = members.clone();
            let mut components = Vec::new();
            for (index, member) in (0..).zip(&members) {
                let value = around.emit(Expression::AccessIndex {
                    base: returned,
                    index,
                });
                components.push(match is_position(member.binding.as_ref()) {
                    true => around.moved(value),
                    false => value,
                });
            }
            around.emit(Expression::Compose {
                ty: result.ty,
                components,
            })
        }
        _ => around.moved(returned),
    };
    around.finish(Some(result), Some(moved))
}

/// The module with one fragment entry point, [`NAME`], around the one at `entry`.
pub(super) fn fragment(
    module: &Module,
    entry: usize,
    place: (u32, u32),
    targets: &Targets,
) -> Module {
    let mut around = Around::new(module, entry, place);
    let arguments = around.arguments(|around, position| around.in_pixels(position));
    let (result, returned) = around.call(arguments);
    if let Some(at) = targets.only_where {
        around.only_where(at);
    }
    let mut returned = around.returned(result, returned);
    let mut order = None;
    if targets.writes_depth {
        let is_depth =
            |(binding, ..): &(Binding, _, _)| *binding == Binding::BuiltIn(BuiltIn::FragDepth);
        let own = returned.iter().position(is_depth);
        let own = own.map(|at| returned.remove(at).2);
        let depth = around.depth(own);
        order = targets.layer.map(|layer| around.behind(layer, depth));
        let ty = around.ty(TypeInner::Scalar(Scalar::F32));
        returned.push((Binding::BuiltIn(BuiltIn::FragDepth), ty, depth));
    }
    let mut outputs = Vec::new();
    for (at, colour) in (0..).zip(&targets.colours) {
        let found = returned.iter().find(
            |(binding, ..)| matches!(binding, Binding::Location { location, .. } if *location == colour.location),
        );
        let kind = colour.kind.unwrap_or(ScalarKind::Float);
        let mut value = around.colour(found.map(|(_, ty, value)| (*ty, *value)), kind);
        if colour.kind.is_none() {
            // Every device draws to integers of 32 bits, and not every one to floats of as many.
            value = around.emit(Expression::As {
                expr: value,
                kind: ScalarKind::Uint,
                convert: None,
            });
        }
        let inner = four(scalar(colour.kind.unwrap_or(ScalarKind::Uint)));
        outputs.push((location(at), inner, value));
    }
    let drawn = order.unwrap_or_else(|| around.literal(Literal::U32(1)));
    let at = targets.colours.len() as u32;
    outputs.push((location(at), TypeInner::Scalar(Scalar::U32), drawn));
    for (binding, ty, value) in returned {
        if let Binding::BuiltIn(_) = binding {
            let inner = around.module.types[ty].inner.clone();
            outputs.push((binding, inner, value));
        }
    }
    around.returning(outputs)
}

/// The module with the one entry point at `entry`, as it is but for its name, [`NAME`].
pub(super) fn alone(module: &Module, entry: usize) -> Module {
    let mut module = module.clone();
    let mut own = module.entry_points.swap_remove(entry);
    own.name = NAME.to_owned();
    module.entry_points = vec![own];
    module
}

/// The module with one fragment entry point, [`NAME`], that returns these colours at their own locations: the one at
/// `entry` itself, or, where that returns fewer components or others than the targets hold, one around it.
pub(super) fn bare(module: &Module, entry: usize, place: (u32, u32), targets: &Targets) -> Module {
    let mut around = Around::new(module, entry, place);
    let arguments = around.arguments(|_, position| position);
    let (result, returned) = around.call(arguments);
    let returned = around.returned(result, returned);
    let mut own = true;
    let mut outputs = Vec::new();
    for colour in &targets.colours {
        let kind = colour.kind.unwrap_or(ScalarKind::Float);
        let at = |binding: &Binding| matches!(binding, Binding::Location { location, .. } if *location == colour.location);
        let found = returned.iter().find(|(binding, ..)| at(binding));
        let found = found.map(|(_, ty, value)| (*ty, *value));
        let inner = four(scalar(kind));
        own &= found.is_some_and(|(ty, _)| around.module.types[ty].inner == inner);
        let value = around.colour(found, kind);
        outputs.push((location(colour.location), inner, value));
    }
    if own {
        return alone(module, entry);
    }
    for (binding, ty, value) in returned {
        if let Binding::BuiltIn(_) = binding {
            let inner = around.module.types[ty].inner.clone();
            outputs.push((binding, inner, value));
        }
    }
    around.returning(outputs)
}

fn is_position(binding: Option<&Binding>) -> bool {
    matches!(binding, Some(Binding::BuiltIn(BuiltIn::Position { .. })))
}

fn location(location: u32) -> Binding {
    Binding::Location {
        location,
        // A fragment's outputs have none that matters; the validator wants integers to say so.
        interpolation: Some(Interpolation::Flat),
        sampling: None,
        blend_src: None,
        per_primitive: false,
    }
}

fn scalar(kind: ScalarKind) -> Scalar {
    Scalar { kind, width: 4 }
}

fn four(scalar: Scalar) -> TypeInner {
    TypeInner::Vector {
        size: VectorSize::Quad,
        scalar,
    }
}

/// A name that naga's writers keep.
fn letter(index: usize) -> char {
    char::from(b'a' + (index % 26) as u8)
}

/// An entry point being made around another.
struct Around {
    module: Module,
    /// The entry point as it was, without its function.
    entry: EntryPoint,
    /// The shader's own function.
    inner: Handle<Function>,
    inner_result: Option<FunctionResult>,
    place: Handle<GlobalVariable>,
    function: Function,
    /// The position and the triangle among the fragment's arguments, as they came.
    position: Option<Handle<Expression>>,
    triangle: Option<Handle<Expression>>,
}

impl Around {
    fn new(module: &Module, entry: usize, place: (u32, u32)) -> Self {
        let mut module = module.clone();
        let mut entry = module.entry_points.swap_remove(entry);
        module.entry_points.clear();
        let mut inner = std::mem::take(&mut entry.function);
        let function = Function {
            arguments: inner.arguments.clone(),
            ..Function::default()
        };
        let inner_result = inner.result.clone();
        inner.name = Some("shader_itself".to_owned());
        for argument in &mut inner.arguments {
            argument.binding = None;
        }
        if let Some(result) = &mut inner.result {
            result.binding = None;
        }
        let inner = module.functions.append(inner, Span::UNDEFINED);
        let place = place_variable(&mut module, place);
        Self {
            module,
            entry,
            inner,
            inner_result,
            place,
            function,
            position: None,
            triangle: None,
        }
    }

    fn ty(&mut self, inner: TypeInner) -> Handle<Type> {
        insert(&mut self.module, inner)
    }

    /// A new value, computed here.
    fn emit(&mut self, expression: Expression) -> Handle<Expression> {
        let bare = matches!(
            expression,
            Expression::Literal(_)
                | Expression::FunctionArgument(_)
                | Expression::GlobalVariable(_)
                | Expression::CallResult(_)
        );
        let value = self
            .function
            .expressions
            .append(expression, Span::UNDEFINED);
        if !bare {
            let range = naga::Range::new_from_bounds(value, value);
            self.push(Statement::Emit(range));
        }
        value
    }

    fn literal(&mut self, literal: Literal) -> Handle<Expression> {
        self.emit(Expression::Literal(literal))
    }

    fn push(&mut self, statement: Statement) {
        self.function.body.push(statement, Span::UNDEFINED);
    }

    fn at(&mut self, base: Handle<Expression>, index: u32) -> Handle<Expression> {
        self.emit(Expression::AccessIndex { base, index })
    }

    fn binary(
        &mut self,
        op: BinaryOperator,
        left: Handle<Expression>,
        right: Handle<Expression>,
    ) -> Handle<Expression> {
        self.emit(Expression::Binary { op, left, right })
    }

    /// One of the two vectors of the frame's place.
    fn place(&mut self, index: u32) -> Handle<Expression> {
        let base = self.emit(Expression::GlobalVariable(self.place));
        let pointer = self.at(base, index);
        self.emit(Expression::Load { pointer })
    }

    /// The values that the shader's function is called with: the arguments, with what is made of the position.
    fn arguments(
        &mut self,
        of_position: impl Fn(&mut Self, Handle<Expression>) -> Handle<Expression>,
    ) -> Vec<Handle<Expression>> {
        let arguments = self.function.arguments.clone();
        let mut values = Vec::new();
        for (index, FunctionArgument { ty, binding, .. }) in (0..).zip(arguments) {
            let value = self.emit(Expression::FunctionArgument(index));
            let value = match self.module.types[ty].inner.clone() {
                TypeInner::Struct { members, .. } => {
                    let mut components = Vec::new();
                    for (index, member) in (0..).zip(&members) {
                        let value = self.at(value, index);
                        components.push(self.argument(
                            member.binding.as_ref(),
                            value,
                            &of_position,
                        ));
                    }
                    self.emit(Expression::Compose { ty, components })
                }
                _ => self.argument(binding.as_ref(), value, &of_position),
            };
            values.push(value);
        }
        values
    }

    /// One of them.
    fn argument(
        &mut self,
        binding: Option<&Binding>,
        value: Handle<Expression>,
        of_position: impl Fn(&mut Self, Handle<Expression>) -> Handle<Expression>,
    ) -> Handle<Expression> {
        if binding == Some(&Binding::BuiltIn(BuiltIn::PrimitiveIndex)) {
            self.triangle = Some(value);
        }
        if !is_position(binding) {
            return value;
        }
        self.position = Some(value);
        of_position(self, value)
    }

    /// A built-in that the shader does not take, as another argument.
    fn taken(&mut self, name: &str, built_in: BuiltIn, inner: TypeInner) -> Handle<Expression> {
        let ty = self.ty(inner);
        let index = self.function.arguments.len() as u32;
        self.function.arguments.push(FunctionArgument {
            name: Some(name.to_owned()),
            ty,
            binding: Some(Binding::BuiltIn(built_in)),
        });
        self.emit(Expression::FunctionArgument(index))
    }

    /// The fragment's position in fine pixels.
    fn fine_position(&mut self) -> Handle<Expression> {
        let position = self.position.unwrap_or_else(|| {
            let built_in = BuiltIn::Position { invariant: false };
            self.taken("fine_position", built_in, four(Scalar::F32))
        });
        self.position = Some(position);
        position
    }

    /// Calls the shader's function.
    fn call(
        &mut self,
        arguments: Vec<Handle<Expression>>,
    ) -> (Option<FunctionResult>, Option<Handle<Expression>>) {
        let result = self.inner_result.clone();
        let value = result
            .is_some()
            .then(|| self.emit(Expression::CallResult(self.inner)));
        self.push(Statement::Call {
            function: self.inner,
            arguments,
            result: value,
        });
        (result, value)
    }

    /// A clip position, moved.
    fn moved(&mut self, position: Handle<Expression>) -> Handle<Expression> {
        let place = self.place(0);
        let w = self.at(position, 3);
        let mut components: Vec<_> = (0..4).map(|i| self.at(position, i)).collect();
        for (i, component) in (0..2).zip(&mut components) {
            let shift = self.at(place, i);
            let shift = self.binary(BinaryOperator::Multiply, shift, w);
            *component = self.binary(BinaryOperator::Add, *component, shift);
        }
        let ty = self.ty(four(Scalar::F32));
        self.emit(Expression::Compose { ty, components })
    }

    /// A position in fine pixels, in pixels.
    fn in_pixels(&mut self, position: Handle<Expression>) -> Handle<Expression> {
        let place = self.place(1);
        let scale = self.at(place, 0);
        let mut components: Vec<_> = (0..4).map(|i| self.at(position, i)).collect();
        for (i, component) in (0..2).zip(&mut components) {
            let offset = self.at(place, 1 + i);
            let scaled = self.binary(BinaryOperator::Multiply, *component, scale);
            *component = self.binary(BinaryOperator::Add, scaled, offset);
        }
        let ty = self.ty(four(Scalar::F32));
        self.emit(Expression::Compose { ty, components })
    }

    /// Draws nothing where a texture of coverage is 0.
    fn only_where(&mut self, at: (u32, u32)) {
        let drawn = self.loaded("drawn_before", at, ScalarKind::Uint);
        let zero = self.literal(Literal::U32(0));
        let hidden = self.binary(BinaryOperator::Equal, drawn, zero);
        self.kill_if(hidden);
    }

    /// The depth of the fragment, 0..1, a NaN 0: what the shader returned, or else that of its triangle.
    fn depth(&mut self, own: Option<Handle<Expression>>) -> Handle<Expression> {
        let mut depth = own.unwrap_or_else(|| {
            let position = self.fine_position();
            self.at(position, 2)
        });
        let [zero, one] = [0.0, 1.0].map(|number| self.literal(Literal::F32(number)));
        // Said so that a NaN is none of them.
        for (limit, beyond) in [(zero, BinaryOperator::Greater), (one, BinaryOperator::Less)] {
            let inside = self.binary(beyond, depth, limit);
            depth = self.emit(Expression::Select {
                condition: inside,
                accept: depth,
                reject: limit,
            });
        }
        depth
    }

    /// Draws nothing but what is in front of all that is opaque and behind the layer before; gives the fragment's order.
    fn behind(&mut self, layer: Behind, depth: Handle<Expression>) -> Handle<Expression> {
        let opaque = self.loaded("opaque_depth", layer.opaque, ScalarKind::Float);
        let before = self.loaded("depth_before", layer.depth, ScalarKind::Float);
        let order_before = self.loaded("order_before", layer.order, ScalarKind::Uint);
        let [mut order, blend] = [1, 0].map(|index| {
            let place = self.place(index);
            let number = self.at(place, 3);
            self.emit(Expression::As {
                expr: number,
                kind: ScalarKind::Uint,
                convert: Some(4),
            })
        });
        if layer.tells_triangles {
            let triangle = self.triangle.unwrap_or_else(|| {
                let inner = TypeInner::Scalar(Scalar::U32);
                self.taken("triangle", BuiltIn::PrimitiveIndex, inner)
            });
            order = self.binary(BinaryOperator::Add, order, triangle);
        }
        let four = self.literal(Literal::U32(4));
        let order = self.binary(BinaryOperator::Multiply, order, four);
        let order = self.binary(BinaryOperator::Add, order, blend);

        let in_front = self.binary(BinaryOperator::Less, depth, opaque);
        let deeper = self.binary(BinaryOperator::Greater, depth, before);
        let as_deep = self.binary(BinaryOperator::Equal, depth, before);
        let earlier = self.binary(BinaryOperator::Less, order, order_before);
        let next = self.binary(BinaryOperator::LogicalAnd, as_deep, earlier);
        let next = self.binary(BinaryOperator::LogicalOr, deeper, next);
        let seen = self.binary(BinaryOperator::LogicalAnd, in_front, next);
        let hidden = self.emit(Expression::Unary {
            op: UnaryOperator::LogicalNot,
            expr: seen,
        });
        self.kill_if(hidden);
        order
    }

    fn kill_if(&mut self, condition: Handle<Expression>) {
        self.push(Statement::If {
            condition,
            accept: Block::from_vec(vec![Statement::Kill]),
            reject: Block::new(),
        });
    }

    /// The first component of the fragment's texel of an image that was drawn before.
    fn loaded(
        &mut self,
        name: &str,
        (group, binding): (u32, u32),
        kind: ScalarKind,
    ) -> Handle<Expression> {
        let image = self.ty(TypeInner::Image {
            dim: ImageDimension::D2,
            arrayed: false,
            class: ImageClass::Sampled { kind, multi: false },
        });
        let image = self.module.global_variables.append(
            GlobalVariable {
                name: Some(name.to_owned()),
                space: AddressSpace::Handle,
                binding: Some(ResourceBinding { group, binding }),
                ty: image,
                init: None,
                memory_decorations: naga::MemoryDecorations::empty(),
            },
            Span::UNDEFINED,
        );
        let position = self.fine_position();
        let at = self.emit(Expression::Swizzle {
            size: VectorSize::Bi,
            vector: position,
            pattern: SwizzleComponent::XYZW,
        });
        let coordinate = self.emit(Expression::As {
            expr: at,
            kind: ScalarKind::Sint,
            convert: Some(4),
        });
        let image = self.emit(Expression::GlobalVariable(image));
        let level = self.literal(Literal::I32(0));
        let texel = self.emit(Expression::ImageLoad {
            image,
            coordinate,
            array_index: None,
            sample: None,
            level: Some(level),
        });
        self.at(texel, 0)
    }

    /// What the shader's function returned, one by one.
    fn returned(
        &mut self,
        result: Option<FunctionResult>,
        returned: Option<Handle<Expression>>,
    ) -> Vec<(Binding, Handle<Type>, Handle<Expression>)> {
        let Some((result, value)) = result.zip(returned) else {
            return Vec::new();
        };
        match (&self.module.types[result.ty].inner, result.binding) {
            (_, Some(binding)) => vec![(binding, result.ty, value)],
            (TypeInner::Struct { members, .. }, None) => {
                let members = members.clone();
                let all = (0..).zip(members);
                let bound = all.filter_map(|(i, m)| Some((i, m.binding?, m.ty)));
                let bound: Vec<(u32, Binding, Handle<Type>)> = bound.collect();
                let values = bound.into_iter();
                values
                    .map(|(i, binding, ty)| (binding, ty, self.at(value, i)))
                    .collect()
            }
            _ => Vec::new(),
        }
    }

    /// A colour of four components out of what was returned.
    fn colour(
        &mut self,
        returned: Option<(Handle<Type>, Handle<Expression>)>,
        kind: ScalarKind,
    ) -> Handle<Expression> {
        let mut components = Vec::new();
        if let Some((ty, value)) = returned {
            let (count, scalar) = match self.module.types[ty].inner {
                TypeInner::Vector { size, scalar } => (Some(size as u32), scalar),
                TypeInner::Scalar(scalar) => (None, scalar),
                _ => (Some(0), Scalar::F32),
            };
            let value = match (scalar.kind, scalar.width) == (kind, 4) {
                true => value,
                false => self.emit(Expression::As {
                    expr: value,
                    kind,
                    convert: Some(4),
                }),
            };
            match count {
                Some(count) => components.extend((0..count).map(|i| self.at(value, i))),
                None => components.push(value),
            }
        }
        for i in components.len()..4 {
            let number = i32::from(i == 3);
            components.push(self.emit(Expression::Literal(match kind {
                ScalarKind::Sint => Literal::I32(number),
                ScalarKind::Uint => Literal::U32(number.unsigned_abs()),
                _ => Literal::F32(number as f32),
            })));
        }
        let ty = self.ty(four(scalar(kind)));
        self.emit(Expression::Compose { ty, components })
    }

    /// The module, its entry point returning these.
    fn returning(mut self, outputs: Vec<(Binding, TypeInner, Handle<Expression>)>) -> Module {
        let mut members = Vec::new();
        let mut components = Vec::new();
        let mut offset = 0;
        for (binding, inner, value) in outputs {
            let size = match inner {
                TypeInner::Scalar(_) => 4,
                _ => 16,
            };
            members.push(StructMember {
                name: Some(format!("out_{}", letter(members.len()))),
                ty: self.ty(inner),
                binding: Some(binding),
                offset,
            });
            components.push(value);
            offset += size;
        }
        let ty = self.ty(TypeInner::Struct {
            members,
            span: offset.next_multiple_of(16),
        });
        let value = self.emit(Expression::Compose { ty, components });
        self.finish(Some(FunctionResult { ty, binding: None }), Some(value))
    }

    fn finish(
        mut self,
        result: Option<FunctionResult>,
        value: Option<Handle<Expression>>,
    ) -> Module {
        self.function.result = result;
        self.push(Statement::Return { value });
        self.entry.name = NAME.to_owned();
        self.entry.function = self.function;
        self.module.entry_points.push(self.entry);
        self.module
    }
}

/// The buffer of the frame's [`Place`] in a module; added, unless something is bound there already.
pub(super) fn place_variable(
    module: &mut Module,
    (group, binding): (u32, u32),
) -> Handle<GlobalVariable> {
    let at = Some(ResourceBinding { group, binding });
    let known = module.global_variables.iter();
    if let Some((known, _)) = known.into_iter().find(|(_, global)| global.binding == at) {
        return known;
    }
    let base = insert(module, four(Scalar::F32));
    let two = TypeInner::Array {
        base,
        size: ArraySize::Constant(NonZeroU32::MIN.saturating_add(1)),
        stride: 16,
    };
    let ty = insert(module, two);
    let place = GlobalVariable {
        name: Some("frame_place".to_owned()),
        space: AddressSpace::Uniform,
        binding: at,
        ty,
        init: None,
        memory_decorations: naga::MemoryDecorations::empty(),
    };
    module.global_variables.append(place, Span::UNDEFINED)
}

/// All functions of a module, those of entry points last.
pub(super) fn functions(module: &mut Module) -> impl Iterator<Item = &mut Function> {
    let of_entries = module.entry_points.iter_mut().map(|e| &mut e.function);
    let others = module.functions.iter_mut().map(|(_, function)| function);
    others.chain(of_entries)
}

fn insert(module: &mut Module, inner: TypeInner) -> Handle<Type> {
    module
        .types
        .insert(Type { name: None, inner }, Span::UNDEFINED)
}
