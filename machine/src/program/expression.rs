//! Lowers expressions: access to variables, buffers and composites, textures, and operations.

use super::ir::{Detail, Id, Node, Question, Sample, SlotId, TexelLoad};
use super::lower::{Entity, Lowering, Pointer, Root, kind_of};
use super::refused::{Refused, Unsupported};
use lodc_passes::semantics::{Kind, Op, Operation, Scalars, Shape, expand};
use naga::{
    AddressSpace, DerivativeAxis, DerivativeControl, Expression, GlobalVariable, Handle,
    ImageClass, ImageDimension, ImageQuery, SampleLevel, ScalarKind, StorageAccess,
    SwizzleComponent, TypeInner,
};

/// The place of an element.
enum Index {
    Known(u32),
    Value(Id),
}

impl Lowering<'_> {
    /// What an expression of the current frame stands for, computed here.
    pub(super) fn evaluate(&mut self, handle: Handle<Expression>) -> Result<Entity, Refused> {
        let module = self.module;
        let expressions = self.frame.expressions;
        let expression = &expressions[handle];
        match *expression {
            Expression::Literal(literal) => {
                let id = self.literal(literal)?;
                Ok(self.list([id]))
            }
            Expression::Constant(constant) => {
                self.global_expression(module.constants[constant].init)
            }
            Expression::Override(handle) => self.override_value(handle),
            Expression::ZeroValue(ty) => self.zero(&module.types[ty].inner),
            Expression::Compose { ref components, .. } => {
                let mut values = Vec::new();
                for &component in components {
                    let entity = self.expression(component)?;
                    values.extend(self.components(entity)?);
                }
                Ok(self.list(values))
            }
            Expression::Access { base, index } => {
                let index = self.expression(index)?;
                let index = self.scalar(index)?;
                let index = match self.ir.values[index as usize].constant {
                    Some(index) => Index::Known(index),
                    None => Index::Value(index),
                };
                self.access(base, &index)
            }
            Expression::AccessIndex { base, index } => self.access(base, &Index::Known(index)),
            Expression::Splat { size, value } => {
                let value = self.expression(value)?;
                let value = self.scalar(value)?;
                Ok(self.list(std::iter::repeat_n(value, size as usize)))
            }
            Expression::Swizzle {
                size,
                vector,
                pattern,
            } => {
                let vector = self.expression(vector)?;
                let vector = self.components(vector)?;
                let picked: Vec<Id> = pattern[..size as usize]
                    .iter()
                    .map(|&c| vector[c as usize])
                    .collect();
                Ok(self.list(picked))
            }
            Expression::FunctionArgument(index) => match self.argument(index) {
                Some(entity) => Ok(entity),
                None => self.refuse(Unsupported::Invalid("an argument that is not there")),
            },
            Expression::GlobalVariable(global) => self.global_variable(global),
            Expression::LocalVariable(local) => Ok(Entity::Pointer(Pointer {
                root: Root::Variable(self.local(local.index())),
                offset: 0,
                index: None,
            })),
            Expression::Load { pointer } => {
                let entity = self.expression(pointer)?;
                let from = self.pointer(entity)?;
                let ty = self.pointee(pointer)?;
                self.load(from, &ty)
            }
            Expression::ImageSample { .. } => self.image_sample(expression),
            Expression::ImageLoad { .. } => self.image_load(expression),
            Expression::ImageQuery { image, query } => self.image_query(image, query),
            Expression::Derivative { axis, ctrl, expr } => {
                let entity = self.expression(expr)?;
                let values = self.components(entity)?;
                let coarse = ctrl == DerivativeControl::Coarse;
                let results: Vec<Id> = values
                    .into_iter()
                    .map(|value| self.derivative(value, axis, coarse))
                    .collect();
                Ok(self.list(results))
            }
            Expression::ArrayLength(array) => {
                let entity = self.expression(array)?;
                let pointer = self.pointer(entity)?;
                let TypeInner::Array { stride, .. } = self.pointee(array)? else {
                    return self.refuse(Unsupported::Invalid(
                        "the length of something that is not an array",
                    ));
                };
                let Root::Buffer(buffer) = pointer.root else {
                    return self.refuse(Unsupported::Invalid(
                        "the length of an array outside of a buffer",
                    ));
                };
                let length = self.length(buffer, pointer.offset, stride);
                Ok(self.list([length]))
            }
            Expression::Unary { .. }
            | Expression::Binary { .. }
            | Expression::Select { .. }
            | Expression::Relational { .. }
            | Expression::Math { .. }
            | Expression::As { .. } => self.operation(handle, expression),
            // A call gives its result a meaning before anything reads it.
            Expression::CallResult(_) => self.refuse(Unsupported::Invalid(
                "a value that is read before it is computed",
            )),
            Expression::AtomicResult { .. } => self.refuse(Unsupported::Atomic),
            Expression::WorkGroupUniformLoadResult { .. } => self.refuse(Unsupported::Workgroup),
            Expression::RayQueryVertexPositions { .. }
            | Expression::RayQueryProceedResult
            | Expression::RayQueryGetIntersection { .. } => self.refuse(Unsupported::RayQuery),
            Expression::SubgroupBallotResult | Expression::SubgroupOperationResult { .. } => {
                self.refuse(Unsupported::Subgroup)
            }
            Expression::CooperativeLoad { .. } | Expression::CooperativeMultiplyAdd { .. } => {
                self.refuse(Unsupported::CooperativeMatrix)
            }
        }
    }

    fn operation(
        &mut self,
        handle: Handle<Expression>,
        expression: &Expression,
    ) -> Result<Entity, Refused> {
        let Some((operation, operands)) = Operation::of(expression) else {
            return self.refuse(Unsupported::Invalid("an operation that is not known"));
        };
        let module = self.module;
        // The result tells of widths that operands do not have: a conversion to f16, say.
        let facts = self.frame.facts.clone();
        let result = facts.types.get(handle, &module.types);
        if Shape::of(result).is_none() && !matches!(result, TypeInner::Struct { .. }) {
            return self.refuse(Unsupported::Wide);
        }
        let mut given = Vec::with_capacity(operands.len());
        for &operand in &operands {
            let Some(shape) = Shape::of(facts.types.get(operand, &module.types)) else {
                return self.refuse(Unsupported::Wide);
            };
            let entity = self.expression(operand)?;
            given.push((shape, self.components(entity)?));
        }
        let given: Vec<(Shape, &[Id])> = given.iter().map(|(s, v)| (*s, &v[..])).collect();
        match expand(self, operation, &given) {
            Some(values) => Ok(self.list(values)),
            None => self.refuse(Unsupported::Invalid("an operation that is not known")),
        }
    }

    fn derivative(&mut self, value: Id, axis: DerivativeAxis, coarse: bool) -> Id {
        if axis == DerivativeAxis::Width {
            let x = self.derivative(value, DerivativeAxis::X, coarse);
            let y = self.derivative(value, DerivativeAxis::Y, coarse);
            let x = self.apply(Op::Abs, &[x]);
            let y = self.apply(Op::Abs, &[y]);
            return self.apply(Op::Add, &[x, y]);
        }
        if self.ir.values[value as usize].invariant {
            return self.float(0.0);
        }
        let result = self.ir.value(Kind::F);
        self.push(Node::Derivative {
            result,
            value,
            axis,
            coarse,
        });
        result
    }

    // Access.

    fn global_variable(&mut self, handle: Handle<GlobalVariable>) -> Result<Entity, Refused> {
        let variable = &self.module.global_variables[handle];
        let root = match variable.space {
            AddressSpace::Handle => {
                return match self.module.types[variable.ty].inner {
                    TypeInner::Image { .. } => Ok(Entity::Image(handle)),
                    TypeInner::Sampler { .. } => Ok(Entity::Sampler(handle)),
                    TypeInner::BindingArray { .. } => {
                        self.refuse_read(Unsupported::BindingArray, handle)
                    }
                    _ => self.refuse_read(Unsupported::RayQuery, handle),
                };
            }
            AddressSpace::Private => match self.private(handle) {
                Some(variable) => Root::Variable(variable),
                None => {
                    return self.refuse_read(
                        Unsupported::Invalid("a private variable that is not there"),
                        handle,
                    );
                }
            },
            AddressSpace::Uniform | AddressSpace::Storage { .. } => {
                if let AddressSpace::Storage { access } = variable.space
                    && access.contains(StorageAccess::ATOMIC)
                {
                    return self.refuse_read(Unsupported::Atomic, handle);
                }
                if let TypeInner::BindingArray { .. } = self.module.types[variable.ty].inner {
                    return self.refuse_read(Unsupported::BindingArray, handle);
                }
                let binding = self.binding(handle)?;
                Root::Buffer(place(&mut self.ir.buffers, binding))
            }
            AddressSpace::Immediate => return self.refuse_read(Unsupported::Immediate, handle),
            AddressSpace::WorkGroup | AddressSpace::TaskPayload => {
                return self.refuse_read(Unsupported::Workgroup, handle);
            }
            AddressSpace::Function
            | AddressSpace::RayPayload
            | AddressSpace::IncomingRayPayload => {
                return self.refuse_read(Unsupported::RayQuery, handle);
            }
        };
        Ok(Entity::Pointer(Pointer {
            root,
            offset: 0,
            index: None,
        }))
    }

    fn binding(&self, handle: Handle<GlobalVariable>) -> Result<(u32, u32), Refused> {
        match &self.module.global_variables[handle].binding {
            Some(binding) => Ok((binding.group, binding.binding)),
            None => self.refuse_read(Unsupported::Unbound, handle),
        }
    }

    fn access(&mut self, base: Handle<Expression>, index: &Index) -> Result<Entity, Refused> {
        let entity = self.expression(base)?;
        match entity {
            Entity::Pointer(pointer) => {
                let ty = self.pointee(base)?;
                Ok(Entity::Pointer(self.access_pointer(pointer, &ty, index)?))
            }
            Entity::Values { first, .. } => {
                let module = self.module;
                let facts = self.frame.facts.clone();
                let ty = facts.types.get(base, &module.types);
                self.access_value(first, ty, index)
            }
            _ => self.refuse(Unsupported::Invalid("access to a resource")),
        }
    }

    /// How far apart the elements of a type are, in scalars and in bytes, and how many there are.
    fn elements(&mut self, ty: &TypeInner) -> Result<(u32, u32, Option<u32>), Refused> {
        match *ty {
            TypeInner::Vector { size, .. } => Ok((1, 4, Some(size as u32))),
            TypeInner::Matrix { columns, rows, .. } => {
                let rows = rows as u32;
                Ok((rows, column_stride(rows), Some(columns as u32)))
            }
            TypeInner::Array { base, size, stride } => {
                let size = self.array_size(size)?;
                // An array in a buffer may hold what a variable may not.
                let scalars = self.count_of(base).unwrap_or(0);
                Ok((scalars, stride, size))
            }
            _ => self.refuse(Unsupported::Invalid("access to a resource")),
        }
    }

    fn access_pointer(
        &mut self,
        pointer: Pointer,
        ty: &TypeInner,
        index: &Index,
    ) -> Result<Pointer, Refused> {
        let buffer = matches!(pointer.root, Root::Buffer(_));
        if let (TypeInner::Struct { members, .. }, Index::Known(index)) = (ty, index) {
            let index = *index as usize;
            let mut offset = 0;
            if buffer {
                offset = members.get(index).map_or(0, |m| m.offset);
            } else {
                for member in members.iter().take(index) {
                    offset += self.count_of(member.ty)?;
                }
            }
            return Ok(Pointer {
                offset: pointer.offset + offset,
                ..pointer
            });
        }
        let (scalars, bytes, size) = self.elements(ty)?;
        let stride = if buffer { bytes } else { scalars };
        match (index, size, pointer.root) {
            (Index::Known(index), Some(size), _) => Ok(Pointer {
                offset: pointer.offset + (*index).min(size - 1) * stride,
                ..pointer
            }),
            (index, size, root) => {
                let index = match *index {
                    Index::Known(index) => self.word(index),
                    Index::Value(index) => index,
                };
                let last = match (size, root) {
                    (Some(size), _) => self.word(size - 1),
                    (None, Root::Buffer(buffer)) => {
                        let length = self.length(buffer, pointer.offset, bytes);
                        let one = self.word(1);
                        self.apply(Op::SubWord, &[length, one])
                    }
                    (None, Root::Variable(_)) => {
                        return self.refuse(Unsupported::UnknownSize);
                    }
                };
                let index = self.apply(Op::MinUint, &[index, last]);
                let stride = self.word(stride);
                let mut index = self.apply(Op::MulWord, &[index, stride]);
                if let Some(outer) = pointer.index {
                    index = self.apply(Op::AddWord, &[outer, index]);
                }
                Ok(Pointer {
                    index: Some(index),
                    ..pointer
                })
            }
        }
    }

    fn access_value(
        &mut self,
        first: usize,
        ty: &TypeInner,
        index: &Index,
    ) -> Result<Entity, Refused> {
        if let (TypeInner::Struct { members, .. }, Index::Known(index)) = (ty, index) {
            let index = *index as usize;
            let mut offset = 0;
            for member in members.iter().take(index) {
                offset += self.count_of(member.ty)? as usize;
            }
            let count = match members.get(index) {
                Some(member) => self.count_of(member.ty)? as usize,
                None => return self.refuse(Unsupported::Invalid("a member that is not there")),
            };
            return Ok(Entity::Values {
                first: first + offset,
                count,
            });
        }
        let (width, _, size) = self.elements(ty)?;
        let (width, Some(size)) = (width as usize, size) else {
            return self.refuse(Unsupported::UnknownSize);
        };
        let index = match *index {
            Index::Known(index) => {
                return Ok(Entity::Values {
                    first: first + index.min(size - 1) as usize * width,
                    count: width,
                });
            }
            Index::Value(index) => index,
        };
        let last = self.word(size - 1);
        let index = self.apply(Op::MinUint, &[index, last]);
        let values = self.flat[first..first + width * size as usize].to_vec();
        if size <= 4 {
            return Ok(self.choose(&values, width, index));
        }
        let (floats, words) = self.table(first, &values);
        let stride = self.word(width as u32);
        let index = self.apply(Op::MulWord, &[index, stride]);
        let picked: Vec<Id> = (0..width)
            .map(|i| {
                let kind = self.ir.values[values[i] as usize].kind;
                let slot = if kind == Kind::F { floats } else { words };
                let result = self.ir.value(kind);
                self.push(Node::Get {
                    result,
                    slot,
                    index: Some(index),
                    offset: i as u32,
                });
                result
            })
            .collect();
        Ok(self.list(picked))
    }

    /// One of a few elements, by selection.
    fn choose(&mut self, values: &[Id], width: usize, index: Id) -> Entity {
        let mut picked = values[..width].to_vec();
        for (k, element) in values.chunks(width).enumerate().skip(1) {
            let k = self.word(k as u32);
            let here = self.apply(Op::EqualWord, &[index, k]);
            for (picked, &value) in picked.iter_mut().zip(element) {
                let op = match self.ir.values[value as usize].kind {
                    Kind::F => Op::SelectFloat,
                    Kind::W => Op::SelectWord,
                };
                *picked = self.apply(op, &[here, value, *picked]);
            }
        }
        self.list(picked)
    }

    /// Arrays of slots that hold a composite value, for floats and for words. What is the same for a whole
    /// draw is written once.
    fn table(&mut self, first: usize, values: &[Id]) -> (SlotId, SlotId) {
        let invariant = values.iter().all(|&v| self.ir.values[v as usize].invariant);
        if let (true, Some(&table)) = (invariant, self.tables.get(&first)) {
            return table;
        }
        let floats = self.slot(Kind::F, values.len() as u32);
        let words = self.slot(Kind::W, values.len() as u32);
        for (i, &value) in values.iter().enumerate() {
            let slot = match self.ir.values[value as usize].kind {
                Kind::F => floats,
                Kind::W => words,
            };
            let node = Node::Set {
                slot,
                index: None,
                offset: i as u32,
                value,
            };
            if invariant {
                self.ir.prologue.push(node);
            } else {
                self.push(node);
            }
        }
        if invariant {
            self.tables.insert(first, (floats, words));
        }
        (floats, words)
    }

    // Buffers.

    fn length(&mut self, buffer: u32, offset: u32, stride: u32) -> Id {
        let result = self.ir.value(Kind::W);
        self.compute(
            result,
            true,
            Node::Length {
                result,
                buffer,
                offset,
                stride,
            },
        );
        result
    }

    pub(super) fn load_buffer(
        &mut self,
        buffer: u32,
        ty: &TypeInner,
        offset: u32,
        index: Option<Id>,
        out: &mut Vec<Id>,
    ) -> Result<(), Refused> {
        let module = self.module;
        match *ty {
            TypeInner::Scalar(scalar) => {
                if scalar.width != 4 {
                    return self.refuse(Unsupported::Wide);
                }
                out.push(self.fetch(buffer, kind_of(scalar.kind), offset, index));
            }
            TypeInner::Vector { size, scalar } => {
                for i in 0..size as u32 {
                    let scalar = TypeInner::Scalar(scalar);
                    self.load_buffer(buffer, &scalar, offset + 4 * i, index, out)?;
                }
            }
            TypeInner::Matrix {
                columns,
                rows,
                scalar,
            } => {
                let column = TypeInner::Vector { size: rows, scalar };
                let stride = column_stride(rows as u32);
                for i in 0..columns as u32 {
                    self.load_buffer(buffer, &column, offset + stride * i, index, out)?;
                }
            }
            TypeInner::Array { base, size, stride } => {
                let Some(size) = self.array_size(size)? else {
                    return self.refuse(Unsupported::UnknownSize);
                };
                self.count_of(base)?;
                for i in 0..size {
                    let element = &module.types[base].inner;
                    self.load_buffer(buffer, element, offset + stride * i, index, out)?;
                }
            }
            TypeInner::Struct { ref members, .. } => {
                for member in members {
                    let inner = &module.types[member.ty].inner;
                    self.load_buffer(buffer, inner, offset + member.offset, index, out)?;
                }
            }
            TypeInner::Atomic(_) => return self.refuse(Unsupported::Atomic),
            _ => {
                return self.refuse(Unsupported::Invalid(
                    "a pointer or a resource inside a value",
                ));
            }
        }
        Ok(())
    }

    fn fetch(&mut self, buffer: u32, kind: Kind, offset: u32, index: Option<Id>) -> Id {
        let key = (buffer, offset, kind == Kind::F);
        if index.is_none()
            && let Some(&id) = self.fetched.get(&key)
        {
            return id;
        }
        let invariant = index.is_none_or(|i| self.ir.values[i as usize].invariant);
        let result = self.ir.value(kind);
        self.compute(
            result,
            invariant,
            Node::Fetch {
                result,
                buffer,
                index,
                offset,
            },
        );
        if index.is_none() {
            self.fetched.insert(key, result);
        }
        result
    }

    // Textures.

    /// The texture that an expression stands for: its place among the textures, and its type.
    fn image(
        &mut self,
        image: Handle<Expression>,
    ) -> Result<(u32, ImageDimension, ImageClass), Refused> {
        let Entity::Image(handle) = self.expression(image)? else {
            return self.refuse(Unsupported::BindingArray);
        };
        let ty = self.module.global_variables[handle].ty;
        let TypeInner::Image { dim, class, .. } = self.module.types[ty].inner else {
            return self.refuse_read(Unsupported::BindingArray, handle);
        };
        match class {
            ImageClass::Sampled { multi: true, .. } | ImageClass::Depth { multi: true } => {
                return self.refuse_read(Unsupported::Multisampled, handle);
            }
            ImageClass::External => return self.refuse_read(Unsupported::ExternalTexture, handle),
            ImageClass::Storage { .. } => {
                return self.refuse_read(Unsupported::StorageTexture, handle);
            }
            ImageClass::Sampled { .. } | ImageClass::Depth { .. } => {}
        }
        let binding = self.binding(handle)?;
        Ok((place(&mut self.ir.textures, binding), dim, class))
    }

    fn kind_of_expression(&self, handle: Handle<Expression>) -> Option<ScalarKind> {
        self.frame
            .facts
            .types
            .get(handle, &self.module.types)
            .scalar_kind()
    }

    /// An integer operand as a signed one: an unsigned one that is too large becomes the largest.
    fn signed(&mut self, handle: Handle<Expression>) -> Result<Vec<Id>, Refused> {
        let unsigned = self.kind_of_expression(handle) == Some(ScalarKind::Uint);
        let entity = self.expression(handle)?;
        let mut values = self.components(entity)?;
        if unsigned {
            let most = self.word(i32::MAX as u32);
            for value in &mut values {
                *value = self.apply(Op::MinUint, &[*value, most]);
            }
        }
        Ok(values)
    }

    /// A level of detail as a float; depth textures take integers.
    fn level(&mut self, handle: Handle<Expression>) -> Result<Id, Refused> {
        let entity = self.expression(handle)?;
        let value = self.scalar(entity)?;
        Ok(match self.kind_of_expression(handle) {
            Some(ScalarKind::Sint) => self.apply(Op::IntToFloat, &[value]),
            Some(ScalarKind::Uint) => self.apply(Op::UintToFloat, &[value]),
            _ => value,
        })
    }

    /// The values that a texture read gives: one for depth, unless gathered, else four, as integers
    /// for textures of such.
    fn texels(&mut self, class: ImageClass, gathered: bool) -> ([Option<Id>; 4], Option<Op>) {
        let (count, op) = match class {
            ImageClass::Depth { .. } if !gathered => (1, None),
            ImageClass::Sampled {
                kind: ScalarKind::Sint,
                ..
            } => (4, Some(Op::FloatToInt)),
            ImageClass::Sampled {
                kind: ScalarKind::Uint,
                ..
            } => (4, Some(Op::FloatToUint)),
            _ => (4, None),
        };
        let mut results = [None; 4];
        for result in &mut results[..count] {
            *result = Some(self.ir.value(Kind::F));
        }
        (results, op)
    }

    fn converted(&mut self, results: [Option<Id>; 4], op: Option<Op>) -> Entity {
        let values: Vec<Id> = results
            .into_iter()
            .flatten()
            .map(|id| match op {
                Some(op) => self.apply(op, &[id]),
                None => id,
            })
            .collect();
        self.list(values)
    }

    fn image_sample(&mut self, expression: &Expression) -> Result<Entity, Refused> {
        let Expression::ImageSample {
            image,
            sampler,
            gather,
            coordinate,
            array_index,
            offset,
            level,
            depth_ref,
            clamp_to_edge,
        } = *expression
        else {
            return self.refuse(Unsupported::Invalid("an operation that is not known"));
        };
        let (texture, _, class) = self.image(image)?;
        let Entity::Sampler(sampler) = self.expression(sampler)? else {
            return self.refuse(Unsupported::BindingArray);
        };
        let sampler = self.binding(sampler)?;
        let sampler = place(&mut self.ir.samplers, sampler);
        let coordinates = self.expression(coordinate)?;
        let coordinates = self.components(coordinates)?;
        let layer = match array_index {
            Some(index) => self.signed(index)?.first().copied(),
            None => None,
        };
        let mut offsets = [0; 3];
        if let Some(offset) = offset {
            let entity = self.demand(offset)?;
            for (to, id) in offsets.iter_mut().zip(self.components(entity)?) {
                match self.ir.values[id as usize].constant {
                    Some(word) => *to = word as i32,
                    None => {
                        return self.refuse(Unsupported::Invalid("an offset that is not constant"));
                    }
                }
            }
        }
        let detail = match level {
            SampleLevel::Auto => Detail::Implicit(None),
            SampleLevel::Zero => Detail::Zero,
            SampleLevel::Exact(level) => Detail::Exact(self.level(level)?),
            SampleLevel::Bias(bias) => Detail::Implicit(Some(self.level(bias)?)),
            SampleLevel::Gradient { x, y } => {
                let (x, y) = (self.expression(x)?, self.expression(y)?);
                Detail::Gradients(self.components(x)?, self.components(y)?)
            }
        };
        let detail = if gather.is_some() {
            Detail::Zero
        } else {
            detail
        };
        let reference = match depth_ref {
            Some(reference) => {
                let entity = self.expression(reference)?;
                Some(self.scalar(entity)?)
            }
            None => None,
        };
        let (results, op) = self.texels(class, gather.is_some());
        self.push(Node::Sample(Box::new(Sample {
            texture,
            sampler,
            coordinates,
            layer,
            offset: offsets,
            detail,
            gather: gather.map(|c: SwizzleComponent| c as usize),
            reference,
            clamp_to_edge,
            results,
        })));
        Ok(self.converted(results, op))
    }

    fn image_load(&mut self, expression: &Expression) -> Result<Entity, Refused> {
        let Expression::ImageLoad {
            image,
            coordinate,
            array_index,
            level,
            ..
        } = *expression
        else {
            return self.refuse(Unsupported::Invalid("an operation that is not known"));
        };
        let (texture, _, class) = self.image(image)?;
        let coordinates = self.signed(coordinate)?;
        let layer = match array_index {
            Some(index) => self.signed(index)?.first().copied(),
            None => None,
        };
        let level = match level {
            Some(level) => self.signed(level)?.first().copied(),
            None => None,
        };
        let (results, op) = self.texels(class, false);
        self.push(Node::TexelLoad(Box::new(TexelLoad {
            texture,
            coordinates,
            layer,
            level,
            results,
        })));
        Ok(self.converted(results, op))
    }

    fn image_query(
        &mut self,
        image: Handle<Expression>,
        query: ImageQuery,
    ) -> Result<Entity, Refused> {
        let (texture, dim, _) = self.image(image)?;
        let (question, level, count) = match query {
            ImageQuery::Size { level } => {
                let level = match level {
                    Some(level) => self.signed(level)?.first().copied(),
                    None => None,
                };
                let count = match dim {
                    ImageDimension::D1 => 1,
                    ImageDimension::D2 | ImageDimension::Cube => 2,
                    ImageDimension::D3 => 3,
                };
                (Question::Size, level, count)
            }
            ImageQuery::NumLevels => (Question::Levels, None, 1),
            ImageQuery::NumLayers => (Question::Layers, None, 1),
            ImageQuery::NumSamples => return self.refuse(Unsupported::Multisampled),
        };
        let values: Vec<Id> = (0..count).map(|_| self.ir.value(Kind::W)).collect();
        let mut results = [None; 3];
        for (result, &value) in results.iter_mut().zip(&values) {
            *result = Some(value);
        }
        let node = Node::Query {
            results,
            texture,
            question,
            level,
        };
        let invariant = level.is_none_or(|l| self.ir.values[l as usize].invariant);
        if invariant {
            for &value in &values {
                self.ir.values[value as usize].invariant = true;
            }
            self.ir.prologue.push(node);
        } else {
            self.push(node);
        }
        Ok(self.list(values))
    }
}

/// The place of a binding in a list, where it is added if it is new.
fn place(list: &mut Vec<(u32, u32)>, binding: (u32, u32)) -> u32 {
    let at = list.iter().position(|&b| b == binding).unwrap_or_else(|| {
        list.push(binding);
        list.len() - 1
    });
    at as u32
}

/// Bytes between the columns of a matrix of so many rows.
fn column_stride(rows: u32) -> u32 {
    if rows == 2 { 8 } else { 16 }
}
