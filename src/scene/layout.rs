//! Where the parts of a buffer are: paths such as `lights.items[2].colour` to offsets, numbers to bytes.

use naga::proc::Layouter;
use naga::{ArraySize, Handle, Module, ScalarKind, Type, TypeInner};

/// The most bytes that a buffer may have. WebGPU promises 64 KiB for uniforms; storage is larger.
pub(super) const LARGEST: u64 = 4 << 20;

/// A scalar, vector or matrix in a buffer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Leaf {
    /// The path from the variable: `camera.view_proj`.
    pub(super) path: String,
    /// Bytes from the start of the buffer.
    pub(super) offset: u32,
    /// Columns of a matrix, else 1.
    pub(super) columns: usize,
    /// Components of a vector or of a column, else 1.
    pub(super) rows: usize,
    /// Bytes from one column to the next.
    pub(super) stride: u32,
    /// What its components are.
    pub(super) kind: ScalarKind,
    /// Bytes of a component.
    pub(super) width: u8,
}

impl Leaf {
    /// How many numbers it holds.
    pub(super) fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Whether it is made of 32-bit floats.
    pub(super) fn is_float(&self) -> bool {
        self.kind == ScalarKind::Float && self.width == 4
    }

    /// Its WGSL type.
    pub(super) fn type_name(&self) -> String {
        let scalar = scalar_name(self.kind, self.width);
        match (self.columns, self.rows) {
            (1, 1) => scalar.to_owned(),
            (1, rows) => format!("vec{rows}<{scalar}>"),
            (columns, rows) => format!("mat{columns}x{rows}<{scalar}>"),
        }
    }

    /// The bits of its numbers, column by column.
    pub(super) fn words(&self, numbers: &[f64]) -> impl Iterator<Item = u32> {
        let numbers = numbers.iter().take(self.len());
        numbers.map(|&number| match self.kind {
            ScalarKind::Sint => (number as i32).cast_unsigned(),
            ScalarKind::Uint => number as u32,
            ScalarKind::Bool => u32::from(number != 0.0),
            _ => (number as f32).to_bits(),
        })
    }

    /// Writes its numbers, column by column, into the bytes of its buffer.
    pub(super) fn write(&self, numbers: &[f64], bytes: &mut [u8]) {
        for (i, word) in self.words(numbers).enumerate() {
            let (column, row) = ((i / self.rows) as u32, (i % self.rows) as u32);
            let at = (self.offset + column * self.stride + row * 4) as usize;
            if let Some(place) = bytes.get_mut(at..at + 4) {
                place.copy_from_slice(&word.to_le_bytes());
            }
        }
    }
}

fn scalar_name(kind: ScalarKind, width: u8) -> &'static str {
    match (kind, width) {
        (ScalarKind::Float, 2) => "f16",
        (ScalarKind::Float, 8) => "f64",
        (ScalarKind::Sint, 8) => "i64",
        (ScalarKind::Uint, 8) => "u64",
        (ScalarKind::Sint, _) => "i32",
        (ScalarKind::Uint, _) => "u32",
        (ScalarKind::Bool, _) => "bool",
        _ => "f32",
    }
}

/// A type's name with its article.
pub(super) fn article(name: &str) -> String {
    // Scalars are spelt out: an f32, an i32, a u32.
    let spelt = ["f", "i"].iter().any(|letter| {
        let rest = name.strip_prefix(letter);
        rest.is_some_and(|r| r.starts_with(|c: char| c.is_ascii_digit()))
    });
    let an = spelt || name.starts_with('a');
    format!("{} {name}", if an { "an" } else { "a" })
}

/// A part of a buffer: the buffer itself, a member, an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Place {
    /// Its path.
    pub(super) path: String,
    /// Its type.
    pub(super) ty: Handle<Type>,
    /// Bytes from the start of the buffer.
    pub(super) offset: u32,
    /// One more than the index into a runtime array on the way here; 0 when there is none.
    pub(super) runtime: u32,
}

/// The layouts of a module's types.
pub(super) struct Layout<'m> {
    module: &'m Module,
    layouter: Layouter,
}

impl<'m> Layout<'m> {
    pub(super) fn new(module: &'m Module) -> Self {
        let mut layouter = Layouter::default();
        // It cannot fail on a module that has been validated; types without a layout have none.
        let _ = layouter.update(module.to_ctx());
        Self { module, layouter }
    }

    fn inner(&self, ty: Handle<Type>) -> &'m TypeInner {
        &self.module.types[ty].inner
    }

    /// The bytes of a type, with `runtime` elements in a runtime array at its end.
    pub(super) fn size(&self, ty: Handle<Type>, runtime: u32) -> u64 {
        match *self.inner(ty) {
            TypeInner::Array {
                size: ArraySize::Dynamic,
                stride,
                ..
            } => u64::from(stride) * u64::from(runtime.max(1)),
            TypeInner::Struct { ref members, span } => {
                let end = members.last().map_or(0, |last| {
                    u64::from(last.offset) + self.size(last.ty, runtime)
                });
                let alignment = u64::from(self.layouter[ty].alignment.round_up(1));
                end.next_multiple_of(alignment).max(u64::from(span))
            }
            _ => u64::from(self.layouter[ty].size),
        }
    }

    /// Whether a type is, or ends in, a runtime array.
    pub(super) fn has_runtime_array(&self, ty: Handle<Type>) -> bool {
        match self.inner(ty) {
            TypeInner::Array { size, .. } => *size == ArraySize::Dynamic,
            TypeInner::Struct { members, .. } => members
                .last()
                .is_some_and(|last| self.has_runtime_array(last.ty)),
            _ => false,
        }
    }

    /// The type's WGSL name, for messages.
    pub(super) fn type_name(&self, ty: Handle<Type>) -> String {
        if let Some(leaf) = self.leaf(ty, 0, String::new()) {
            return leaf.type_name();
        }
        match self.inner(ty) {
            TypeInner::Array { base, size, .. } => match size {
                ArraySize::Constant(n) => format!("array<{}, {n}>", self.type_name(*base)),
                _ => format!("array<{}>", self.type_name(*base)),
            },
            _ => {
                let name = self.module.types[ty].name.clone();
                name.unwrap_or_else(|| "struct".to_owned())
            }
        }
    }

    /// What an array is made of: its element's type, the bytes between elements, and how many there are;
    /// `None` for a runtime array.
    pub(super) fn array(&self, ty: Handle<Type>) -> Option<(Handle<Type>, u32, Option<u32>)> {
        match *self.inner(ty) {
            TypeInner::Array { base, size, stride } => {
                let count = match size {
                    ArraySize::Constant(n) => Some(n.get()),
                    ArraySize::Pending(_) | ArraySize::Dynamic => None,
                };
                Some((base, stride, count))
            }
            _ => None,
        }
    }

    /// The members of a struct.
    pub(super) fn members(&self, place: &Place) -> Option<Vec<Place>> {
        let TypeInner::Struct { members, .. } = self.inner(place.ty) else {
            return None;
        };
        let named = members.iter().enumerate().map(|(i, member)| {
            let name = member.name.clone().unwrap_or_else(|| i.to_string());
            Place {
                path: format!("{}.{name}", place.path),
                ty: member.ty,
                offset: place.offset + member.offset,
                runtime: place.runtime,
            }
        });
        Some(named.collect())
    }

    /// An element of an array; `None` when it has not so many, or is no array.
    pub(super) fn element(&self, place: &Place, index: u32) -> Option<Place> {
        let (base, stride, count) = self.array(place.ty)?;
        let most = (LARGEST / u64::from(stride.max(1))) as u32;
        (index < count.unwrap_or(most)).then(|| Place {
            path: format!("{}[{index}]", place.path),
            ty: base,
            offset: place.offset.saturating_add(index.saturating_mul(stride)),
            runtime: match count {
                Some(_) => place.runtime,
                None => index + 1,
            },
        })
    }

    fn leaf(&self, ty: Handle<Type>, offset: u32, path: String) -> Option<Leaf> {
        let (columns, rows, scalar, stride) = match *self.inner(ty) {
            TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => (1, 1, scalar, 0),
            TypeInner::Vector { size, scalar } => (1, size as usize, scalar, 0),
            TypeInner::Matrix {
                columns,
                rows,
                scalar,
            } => {
                // Columns are aligned as vectors are: those of three components take the room of four.
                let words = if rows as u32 == 2 { 2 } else { 4 };
                let stride = words * u32::from(scalar.width);
                (columns as usize, rows as usize, scalar, stride)
            }
            _ => return None,
        };
        Some(Leaf {
            path,
            offset,
            columns,
            rows,
            stride,
            kind: scalar.kind,
            width: scalar.width,
        })
    }

    /// The scalars, vectors and matrices of a place, in the order of their offsets, with `runtime` elements
    /// in a runtime array.
    pub(super) fn leaves(&self, place: &Place, runtime: u32) -> Vec<Leaf> {
        let mut leaves = Vec::new();
        self.add_leaves(place, runtime, &mut leaves);
        leaves
    }

    fn add_leaves(&self, place: &Place, runtime: u32, leaves: &mut Vec<Leaf>) {
        if let Some(leaf) = self.leaf(place.ty, place.offset, place.path.clone()) {
            leaves.push(leaf);
        } else if let Some(members) = self.members(place) {
            for member in members {
                self.add_leaves(&member, runtime, leaves);
            }
        } else if let Some((_, _, count)) = self.array(place.ty) {
            for index in 0..count.unwrap_or(runtime) {
                if let Some(element) = self.element(place, index) {
                    self.add_leaves(&element, runtime, leaves);
                }
            }
        }
    }

    /// The part of a buffer that a path leads to from its root, such as `.items[2].colour`.
    ///
    /// # Errors
    /// The place where the path goes wrong: as far as it is right.
    pub(super) fn follow(&self, root: Place, mut path: &str) -> Result<Place, Place> {
        let mut place = root;
        while !path.is_empty() {
            let next = if let Some(rest) = path.strip_prefix('.') {
                let end = rest.find(['.', '[']).unwrap_or(rest.len());
                let wanted = format!("{}.{}", place.path, &rest[..end]);
                path = &rest[end..];
                let members = self.members(&place).unwrap_or_default();
                members.into_iter().find(|m| m.path == wanted)
            } else if let Some((index, rest)) =
                path.strip_prefix('[').and_then(|rest| rest.split_once(']'))
            {
                path = rest;
                let index = index.trim().parse().ok();
                index.and_then(|index| self.element(&place, index))
            } else {
                None
            };
            match next {
                Some(next) => place = next,
                None => return Err(place),
            }
        }
        Ok(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "
        struct Inner { a: f32, b: vec3f, c: f32 }
        struct All {
            x: f32,
            m: mat3x3f,
            n: mat2x2f,
            v: vec3f,
            w: f32,
            inner: array<Inner, 2>,
            t: mat4x2f,
            u: vec2u,
            i: vec4i,
            s: array<vec4f, 3>,
        }
        struct Open { count: u32, items: array<Inner> }
        @group(0) @binding(0) var<uniform> all: All;
        @group(0) @binding(1) var<storage> open: Open;
        @group(0) @binding(2) var<storage> bare: array<vec3f>;";

    fn with<T>(name: &str, test: impl Fn(&Layout, Place) -> T) -> T {
        let module = naga::front::wgsl::parse_str(TEXT).unwrap();
        let (_, variable) = module
            .global_variables
            .iter()
            .find(|(_, v)| v.name.as_deref() == Some(name))
            .unwrap();
        let root = Place {
            path: name.to_owned(),
            ty: variable.ty,
            offset: 0,
            runtime: 0,
        };
        test(&Layout::new(&module), root)
    }

    #[test]
    fn articles_are_as_spoken() {
        for (name, spoken) in [
            ("f32", "an f32"),
            ("i32", "an i32"),
            ("u32", "a u32"),
            ("array<f32, 2>", "an array<f32, 2>"),
            ("vec3<f32>", "a vec3<f32>"),
            ("fog", "a fog"),
        ] {
            assert_eq!(article(name), spoken);
        }
    }

    #[test]
    fn offsets_are_those_of_wgsl() {
        let offsets = with("all", |layout, root| {
            let leaves = layout.leaves(&root, 0);
            leaves
                .into_iter()
                .map(|l| (l.path, l.offset, l.stride))
                .collect::<Vec<_>>()
        });
        let expected = [
            ("all.x", 0, 0),
            ("all.m", 16, 16),
            ("all.n", 64, 8),
            ("all.v", 80, 0),
            ("all.w", 92, 0),
            ("all.inner[0].a", 96, 0),
            ("all.inner[0].b", 112, 0),
            ("all.inner[0].c", 124, 0),
            ("all.inner[1].a", 128, 0),
            ("all.inner[1].b", 144, 0),
            ("all.inner[1].c", 156, 0),
            ("all.t", 160, 8),
            ("all.u", 192, 0),
            ("all.i", 208, 0),
            ("all.s[0]", 224, 0),
            ("all.s[1]", 240, 0),
            ("all.s[2]", 256, 0),
        ];
        assert_eq!(offsets, expected.map(|(p, o, s)| (p.to_owned(), o, s)));
        assert_eq!(with("all", |layout, root| layout.size(root.ty, 0)), 272);
    }

    #[test]
    fn matrices_are_written_column_by_column_with_padding() {
        let bytes = with("all", |layout, root| {
            let leaf = layout.leaves(&root, 0).swap_remove(1);
            let mut bytes = vec![0; 96];
            leaf.write(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], &mut bytes);
            bytes
        });
        let words: Vec<f32> = bytes[16..64]
            .chunks(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        assert_eq!(
            words,
            [1.0, 2.0, 3.0, 0.0, 4.0, 5.0, 6.0, 0.0, 7.0, 8.0, 9.0, 0.0]
        );
    }

    #[test]
    fn numbers_become_words_of_their_kind() {
        let mut leaf = Leaf {
            path: String::new(),
            offset: 0,
            columns: 1,
            rows: 1,
            stride: 0,
            kind: ScalarKind::Sint,
            width: 4,
        };
        let mut word = |kind, number| {
            leaf.kind = kind;
            let mut bytes = [0; 4];
            leaf.write(&[number], &mut bytes);
            u32::from_le_bytes(bytes)
        };
        assert_eq!(word(ScalarKind::Sint, -2.0), 0xffff_fffe);
        assert_eq!(word(ScalarKind::Uint, 4_294_967_295.0), u32::MAX);
        assert_eq!(word(ScalarKind::Float, 1.0), 0x3f80_0000);
    }

    #[test]
    fn runtime_arrays_are_as_long_as_asked() {
        with("open", |layout, root| {
            assert!(layout.has_runtime_array(root.ty));
            assert_eq!(layout.size(root.ty, 3), 16 + 3 * 32);
            let place = layout.follow(root.clone(), ".items[4].b").unwrap();
            assert_eq!((place.offset, place.runtime), (16 + 4 * 32 + 16, 5));
            assert_eq!(layout.leaves(&root, 2).len(), 7);
            assert!(layout.follow(root, ".items[4000000000].b").is_err());
        });
        with("bare", |layout, root| {
            assert_eq!(layout.size(root.ty, 2), 32);
            assert_eq!(layout.type_name(root.ty), "array<vec3<f32>>");
        });
    }

    #[test]
    fn paths_lead_to_their_places_or_say_where_they_end() {
        with("all", |layout, root| {
            let place = layout.follow(root.clone(), ".inner[1].c").unwrap();
            assert_eq!((place.path.as_str(), place.offset), ("all.inner[1].c", 156));
            for (path, end) in [
                (".inner[2].c", "all.inner"),
                (".inner[1].d", "all.inner[1]"),
                (".inner.c", "all.inner"),
                (".x.y", "all.x"),
                ("x", "all"),
                ("[0]", "all"),
                (".inner[", "all.inner"),
                (".inner[-1]", "all.inner"),
            ] {
                assert_eq!(
                    layout.follow(root.clone(), path).unwrap_err().path,
                    end,
                    "{path}"
                );
            }
            let names = ["all.m", "all.u", "all.inner"].map(|p| {
                let place = layout.follow(root.clone(), &p[3..]).unwrap();
                layout.type_name(place.ty)
            });
            assert_eq!(names, ["mat3x3<f32>", "vec2<u32>", "array<Inner, 2>"]);
        });
    }
}
