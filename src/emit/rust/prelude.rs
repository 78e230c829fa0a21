//! Operations of WGSL as Rust: what is one operator or one call is written where it stands, all else as a function of the
//! module `wgsl`, made once for the shapes that it is used with.
//!
//! What an operation means is not said here: [`expand`] makes scalar operations of it, for the evaluator and for this text
//! alike, so that both do the same in the same order. Below is each scalar operation in Rust.

use super::Written;
use super::text::{Level, Text, snake_case};
use lodc_passes::semantics::{Op, Operation, Scalars, Shape, expand};
use naga::ScalarKind;
use std::collections::BTreeMap;

/// The module that the functions are in.
pub(super) const MODULE: &str = "wgsl";

/// The functions that a text has needed so far, by their names.
#[derive(Default)]
pub(super) struct Prelude {
    functions: BTreeMap<String, String>,
}

impl Prelude {
    /// The value of an operation on operands of these shapes, as the shape of its result or, without one, as a pair.
    pub(super) fn operation(
        &mut self,
        operation: Operation,
        operands: &[(Shape, Text)],
    ) -> Written<Text> {
        let shapes: Vec<Shape> = operands.iter().map(|(shape, _)| *shape).collect();
        let result = operation.result(&shapes);
        if shapes
            .iter()
            .chain(&result)
            .all(|s| matches!(s, Shape::Scalar(_)))
            && result.is_some()
            && let Some(text) = self.in_place(operation, operands, &shapes)?
        {
            return Ok(text);
        }
        let name = name_of(operation, &shapes);
        if !self.functions.contains_key(&name) {
            let text = self.function(&name, operation, &shapes)?;
            self.functions.insert(name.clone(), text);
        }
        let texts: Vec<Text> = operands.iter().map(|(_, text)| text.clone()).collect();
        Ok(Text::call(&format!("{MODULE}::{name}"), &texts))
    }

    /// A scalar operation as an expression over its operands; nothing where one of them is needed twice.
    fn in_place(
        &mut self,
        operation: Operation,
        operands: &[(Shape, Text)],
        shapes: &[Shape],
    ) -> Written<Option<Text>> {
        let mut code = Code::default();
        let given: Vec<Vec<usize>> = (operands.iter())
            .map(|(shape, text)| vec![code.operand(text.clone(), kind_of(*shape))])
            .collect();
        let results = code.expanded(operation, shapes, &given)?;
        let uses = code.uses(&results);
        if (0..code.nodes.len()).any(|node| uses[node] > 1 && !code.is_constant(node)) {
            return Ok(None);
        }
        let [result] = results[..] else {
            return Ok(None);
        };
        let Some(Shape::Scalar(kind)) = operation.result(shapes) else {
            return Ok(None);
        };
        let mut writing = Writing {
            code: &code,
            prelude: self,
            path: "wgsl::",
            named: vec![None; code.nodes.len()],
        };
        let text = writing.node(result)?;
        Ok(Some(writing.coerced(text, kind_of(Shape::Scalar(kind)))))
    }

    /// A function that does an operation on operands of these shapes.
    fn function(&mut self, name: &str, operation: Operation, shapes: &[Shape]) -> Written<String> {
        let mut code = Code::default();
        let mut arguments = Vec::new();
        let mut given = Vec::new();
        for (shape, argument) in shapes.iter().zip(["a", "b", "c", "d"]) {
            arguments.push(format!("{argument}: {}", type_of(*shape)));
            let kind = kind_of(*shape);
            let operand = |at: String| Text::atom(format!("{argument}{at}"));
            let components = (0..shape.components()).map(|component| {
                let text = match shape {
                    Shape::Scalar(_) => operand(String::new()),
                    Shape::Vector(..) => operand(format!("[{component}]")),
                    Shape::Matrix { rows, .. } => {
                        operand(format!("[{}][{}]", component / rows, component % rows))
                    }
                };
                code.operand(text, kind)
            });
            given.push(components.collect());
        }
        let results = code.expanded(operation, shapes, &given)?;
        let uses = code.uses(&results);
        let mut writing = Writing {
            code: &code,
            prelude: self,
            path: "",
            named: vec![None; code.nodes.len()],
        };
        let mut body = String::new();
        for (node, uses) in uses.iter().enumerate() {
            // What is used twice is computed once.
            if *uses > 1 && matches!(code.nodes[node], Node::Op(..)) {
                let (text, ty) = writing.node(node)?;
                let name = format!("t{node}");
                body.push_str(&format!("        let {name} = {};\n", text.text));
                writing.named[node] = Some((Text::atom(name), ty));
            }
        }
        let (result, returned) = match operation.result(shapes) {
            Some(shape) => (type_of(shape), returned(&mut writing, &results, shape)?),
            None => {
                // The members of a pair have the first operand's shape; the exponents of `frexp` are integers.
                let first = *shapes.first().ok_or("an operation without operands")?;
                let (left, right) = results.split_at(first.components());
                let second = match right.first().map(|node| code.ty(*node)) {
                    Some(Ty::Float) => first,
                    _ => with_kind(first, ScalarKind::Sint),
                };
                let left = returned(&mut writing, left, first)?;
                let right = returned(&mut writing, right, second)?;
                (
                    format!("({}, {})", type_of(first), type_of(second)),
                    format!("({left}, {right})"),
                )
            }
        };
        let arguments = arguments.join(", ");
        Ok(format!(
            "    pub(super) fn {name}({arguments}) -> {result} {{\n{body}        {returned}\n    }}\n"
        ))
    }

    /// A function of [`FUNCTIONS`], with those that it calls.
    pub(super) fn known(&mut self, name: &str) -> Written<()> {
        if self.functions.contains_key(name) {
            return Ok(());
        }
        let Some((_, needs, text)) = FUNCTIONS.iter().find(|(known, ..)| *known == name) else {
            return Err(format!("the function `{name}`"));
        };
        self.functions.insert(name.to_owned(), (*text).to_owned());
        needs.iter().try_for_each(|need| self.known(need))
    }

    /// A call of one of [`FUNCTIONS`] from outside of the module.
    pub(super) fn call(&mut self, name: &str, arguments: &[Text]) -> Written<Text> {
        self.known(name)?;
        Ok(Text::call(&format!("{MODULE}::{name}"), arguments))
    }

    /// The module, or nothing where no function was needed.
    pub(super) fn written(&self) -> String {
        if self.functions.is_empty() {
            return String::new();
        }
        let functions: Vec<&str> = self.functions.values().map(String::as_str).collect();
        format!(
            "\n/// What WGSL's operations mean, where Rust has none that means the same.\n\
             #[allow(dead_code, clippy::all, clippy::pedantic)]\nmod {MODULE} {{\n{}}}\n",
            functions.join("\n")
        )
    }
}

/// Components put together as a shape.
fn returned(writing: &mut Writing<'_>, results: &[usize], shape: Shape) -> Written<String> {
    let kind = kind_of(shape);
    let texts: Written<Vec<Text>> = results
        .iter()
        .map(|node| {
            let text = writing.node(*node)?;
            Ok(writing.coerced(text, kind))
        })
        .collect();
    let texts = texts?;
    let array = match shape {
        Shape::Scalar(_) => return Ok(texts.first().map_or(String::new(), |t| t.text.clone())),
        Shape::Vector(..) => texts,
        Shape::Matrix { rows, .. } => texts.chunks(rows).map(Text::array).collect(),
    };
    let short = Text::array(&array).text;
    if short.len() <= 88 {
        return Ok(short);
    }
    let lines = array
        .iter()
        .map(|one| format!("            {},\n", one.text));
    Ok(format!("[\n{}        ]", lines.collect::<String>()))
}

/// The Rust type of a scalar in these functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ty {
    Float,
    Int,
    Uint,
    Bool,
}

fn kind_of(shape: Shape) -> Ty {
    match shape.kind() {
        ScalarKind::Sint => Ty::Int,
        ScalarKind::Uint => Ty::Uint,
        ScalarKind::Bool => Ty::Bool,
        _ => Ty::Float,
    }
}

fn with_kind(shape: Shape, kind: ScalarKind) -> Shape {
    match shape {
        Shape::Vector(size, _) => Shape::Vector(size, kind),
        _ => Shape::Scalar(kind),
    }
}

fn type_of(shape: Shape) -> String {
    let scalar = match kind_of(shape) {
        Ty::Float => "f32",
        Ty::Int => "i32",
        Ty::Uint => "u32",
        Ty::Bool => "bool",
    };
    match shape {
        Shape::Scalar(_) => scalar.to_owned(),
        Shape::Vector(size, _) => format!("[{scalar}; {size}]"),
        Shape::Matrix { columns, rows } => format!("[[{scalar}; {rows}]; {columns}]"),
    }
}

/// What a function is called: `dot_3`, `multiply_4x4_4`, `min_2i`.
fn name_of(operation: Operation, shapes: &[Shape]) -> String {
    let word = |kind: ScalarKind| match kind {
        ScalarKind::Sint => "i32",
        ScalarKind::Uint => "u32",
        ScalarKind::Bool => "bool",
        _ => "f32",
    };
    let name = match operation {
        Operation::Unary(op) => snake_case(&format!("{op:?}")),
        Operation::Binary(op) => snake_case(&format!("{op:?}")),
        Operation::Select => "select".to_owned(),
        Operation::Relational(fun) => snake_case(&format!("{fun:?}")),
        Operation::Math(fun) => snake_case(&format!("{fun:?}")),
        Operation::Convert(kind) => format!("{}_from", word(kind)),
        Operation::Bitcast(kind) => format!("bits_as_{}", word(kind)),
    };
    let letter = |kind| match kind {
        ScalarKind::Sint => "i",
        ScalarKind::Uint => "u",
        ScalarKind::Bool => "b",
        _ => "",
    };
    let suffix = |shape: &Shape| match shape {
        Shape::Scalar(kind) => format!("1{}", letter(*kind)),
        Shape::Vector(size, kind) => format!("{size}{}", letter(*kind)),
        Shape::Matrix { columns, rows } => format!("{columns}x{rows}"),
    };
    let mut suffixes: Vec<String> = shapes.iter().map(suffix).collect();
    if suffixes.iter().all(|one| *one == suffixes[0]) {
        suffixes.truncate(1);
    }
    format!("{name}_{}", suffixes.join("_"))
}

/// Scalar operations that an operation was made of.
#[derive(Default)]
struct Code {
    nodes: Vec<Node>,
}

enum Node {
    Operand(Text, Ty),
    Float(f32),
    Word(u32),
    Op(Op, Vec<usize>),
}

impl Scalars for Code {
    type Value = usize;

    fn word(&mut self, bits: u32) -> usize {
        self.add(Node::Word(bits))
    }

    fn float(&mut self, x: f32) -> usize {
        self.add(Node::Float(x))
    }

    fn apply(&mut self, op: Op, operands: &[usize]) -> usize {
        self.add(Node::Op(op, operands.to_vec()))
    }
}

impl Code {
    fn add(&mut self, node: Node) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn operand(&mut self, text: Text, ty: Ty) -> usize {
        self.add(Node::Operand(text, ty))
    }

    fn expanded(
        &mut self,
        operation: Operation,
        shapes: &[Shape],
        given: &[Vec<usize>],
    ) -> Written<Vec<usize>> {
        let operands: Vec<(Shape, &[usize])> = (shapes.iter().copied())
            .zip(given.iter().map(Vec::as_slice))
            .collect();
        expand(self, operation, &operands).ok_or_else(|| format!("{operation:?}"))
    }

    fn is_constant(&self, node: usize) -> bool {
        matches!(self.nodes[node], Node::Float(_) | Node::Word(_))
    }

    /// How often each node is used by others that are, and as a result.
    fn uses(&self, results: &[usize]) -> Vec<usize> {
        let mut uses = vec![0; self.nodes.len()];
        for result in results {
            uses[*result] += 1;
        }
        for (at, node) in self.nodes.iter().enumerate().rev() {
            if let (Node::Op(_, operands), true) = (node, uses[at] > 0) {
                for operand in operands {
                    uses[*operand] += 1;
                }
            }
        }
        uses
    }

    /// The type that a node has by itself.
    fn ty(&self, node: usize) -> Ty {
        match &self.nodes[node] {
            Node::Operand(_, ty) => *ty,
            Node::Float(_) => Ty::Float,
            Node::Word(_) => Ty::Uint,
            Node::Op(op, operands) => {
                let given: Vec<Ty> = operands.iter().map(|operand| self.ty(*operand)).collect();
                meaning(*op, &given).ty
            }
        }
    }
}

/// Writes nodes.
struct Writing<'c> {
    code: &'c Code,
    prelude: &'c mut Prelude,
    /// The way to the functions.
    path: &'static str,
    /// Nodes that have been computed already.
    named: Vec<Option<(Text, Ty)>>,
}

impl Writing<'_> {
    fn node(&mut self, node: usize) -> Written<(Text, Ty)> {
        if let Some(named) = &self.named[node] {
            return Ok(named.clone());
        }
        let code = self.code;
        Ok(match &code.nodes[node] {
            Node::Operand(text, ty) => (text.clone(), *ty),
            Node::Float(x) => (Text::float(*x), Ty::Float),
            Node::Word(bits) => (Text::integer(*bits, false), Ty::Uint),
            Node::Op(op, operands) => {
                let given: Vec<Ty> = operands.iter().map(|operand| code.ty(*operand)).collect();
                let is_not = given.first() == Some(&Ty::Bool)
                    && (operands.get(1)).is_some_and(|b| matches!(code.nodes[*b], Node::Word(1)));
                if let (Op::Xor, true) = (op, is_not) {
                    let (a, ty) = self.node(operands[0])?;
                    return Ok((self.formed(Form::Prefix("!"), &[a])?, ty));
                }
                let Meaning {
                    form,
                    operands: wanted,
                    ty,
                } = meaning(*op, &given);
                let mut texts = Vec::new();
                for (operand, wanted) in operands.iter().zip(wanted) {
                    texts.push(match (&code.nodes[*operand], wanted) {
                        (Node::Word(bits), Ty::Int) => Text::integer(*bits, true),
                        (Node::Word(bits), Ty::Bool) => Text::atom((*bits != 0).to_string()),
                        _ => {
                            let text = self.node(*operand)?;
                            self.coerced(text, wanted)
                        }
                    });
                }
                (self.formed(form, &texts)?, ty)
            }
        })
    }

    /// A number as another type; what it stands for stays.
    fn coerced(&self, (text, from): (Text, Ty), to: Ty) -> Text {
        let cast =
            |to: &str| Text::new(format!("{} as {to}", text.within(Level::Cast)), Level::Cast);
        match (from, to) {
            (Ty::Int | Ty::Bool, Ty::Uint) => cast("u32"),
            (Ty::Uint | Ty::Bool, Ty::Int) => cast("i32"),
            (Ty::Uint | Ty::Int, Ty::Bool) => {
                Text::binary(&text, "!=", &Text::atom("0"), Level::Compare)
            }
            _ => text,
        }
    }

    fn formed(&mut self, form: Form, operands: &[Text]) -> Written<Text> {
        Ok(match (form, operands) {
            (Form::Infix(operator, level), [a, b]) => match level {
                Level::Compare => Text::binary(&a.pinned(), operator, b, level),
                _ => Text::binary(a, operator, b, level),
            },
            (Form::Prefix(operator), [a]) => Text {
                is_loose: a.is_loose,
                ..Text::new(format!("{operator}{}", a.within(Level::Atom)), Level::Unary)
            },
            (Form::Method(method), [a, rest @ ..]) => Text::call(
                &format!("{}.{method}", a.pinned().within(Level::Atom)),
                rest,
            ),
            (Form::Call(function), all) => Text::call(function, all),
            (Form::Known(function), all) => {
                self.prelude.known(function)?;
                Text::call(&format!("{}{function}", self.path), all)
            }
            (Form::Cast(ty), [a]) => {
                Text::new(format!("{} as {ty}", a.within(Level::Cast)), Level::Cast)
            }
            (Form::Choice, [condition, accept, reject]) => Text {
                is_loose: accept.is_loose && reject.is_loose,
                ..Text::new(
                    format!(
                        "if {} {{ {} }} else {{ {} }}",
                        condition.text, accept.text, reject.text
                    ),
                    Level::Block,
                )
            },
            (Form::InverseSquareRoot, [a]) => {
                let root = Text::call("libm::sqrtf", std::slice::from_ref(a));
                Text::binary(&Text::float(1.0), "/", &root, Level::Product)
            }
            (Form::MultiplyAdd, [a, b, c]) => {
                let product = Text::binary(a, "*", b, Level::Product);
                Text::binary(&product, "+", c, Level::Sum)
            }
            (Form::Shift(operator), [a, b]) => {
                let amount = Text::binary(b, "&", &Text::atom("31"), Level::BitAnd);
                Text::binary(a, operator, &amount, Level::Shift)
            }
            _ => return Err("an operation with other operands".into()),
        })
    }
}

/// How a scalar operation is written.
#[derive(Clone, Copy)]
enum Form {
    Infix(&'static str, Level),
    Prefix(&'static str),
    Method(&'static str),
    /// A function of `libm` or of `core`.
    Call(&'static str),
    /// One of [`FUNCTIONS`].
    Known(&'static str),
    Cast(&'static str),
    Choice,
    InverseSquareRoot,
    MultiplyAdd,
    Shift(&'static str),
}

/// A scalar operation in Rust.
struct Meaning {
    form: Form,
    operands: Vec<Ty>,
    ty: Ty,
}

/// What a scalar operation is in Rust, for operands of these types. Words are of the type that the operation is about, or
/// of that of its first operand.
fn meaning(op: Op, given: &[Ty]) -> Meaning {
    use Form::{Call, Cast, Choice, Infix, Known, Method, Prefix, Shift};
    use Ty::{Bool, Float, Int, Uint};
    let is = |form, operands: &[Ty], ty| Meaning {
        form,
        operands: operands.to_vec(),
        ty,
    };
    let float = |form| is(form, &vec![Float; given.len()], Float);
    let test = |operator| is(Infix(operator, Level::Compare), &[Float, Float], Bool);
    let int = |form| is(form, &vec![Int; given.len()], Int);
    let uint = |form| is(form, &vec![Uint; given.len()], Uint);
    // Of words that are used alike whatever they are.
    let word = match given.first() {
        Some(Int) => Int,
        Some(Bool) if given.iter().all(|ty| *ty == Bool) => Bool,
        _ => Uint,
    };
    let integer = if word == Bool { Uint } else { word };
    let wrapping = |method| is(Method(method), &vec![integer; given.len()], integer);
    let bits = |operator, level| is(Infix(operator, level), &[word, word], word);
    let equal = |operator| is(Infix(operator, Level::Compare), &[word, word], Bool);
    match op {
        Op::Add => float(Infix("+", Level::Sum)),
        Op::Sub => float(Infix("-", Level::Sum)),
        Op::Mul => float(Infix("*", Level::Product)),
        Op::Div => float(Infix("/", Level::Product)),
        Op::Rem => float(Known("rem")),
        Op::Neg => float(Prefix("-")),
        Op::Abs => float(Call("libm::fabsf")),
        Op::Sign => float(Known("sign")),
        Op::Min => float(Known("min")),
        Op::Max => float(Known("max")),
        Op::Clamp => float(Known("clamp")),
        Op::Saturate => float(Known("saturate")),
        Op::Floor => float(Call("libm::floorf")),
        Op::Ceil => float(Call("libm::ceilf")),
        Op::Round => float(Call("libm::rintf")),
        Op::Trunc => float(Call("libm::truncf")),
        Op::Fract => float(Known("fract")),
        Op::Mix => float(Known("mix")),
        Op::Step => float(Known("step")),
        Op::SmoothStep => float(Known("smooth_step")),
        Op::Fma => float(Form::MultiplyAdd),
        Op::Sqrt => float(Call("libm::sqrtf")),
        Op::InverseSqrt => float(Form::InverseSquareRoot),
        Op::Exp => float(Call("libm::expf")),
        Op::Exp2 => float(Call("libm::exp2f")),
        Op::Log => float(Call("libm::logf")),
        Op::Log2 => float(Call("libm::log2f")),
        Op::Pow => float(Known("pow")),
        Op::Sin => float(Call("libm::sinf")),
        Op::Cos => float(Call("libm::cosf")),
        Op::Tan => float(Call("libm::tanf")),
        Op::Asin => float(Call("libm::asinf")),
        Op::Acos => float(Call("libm::acosf")),
        Op::Atan => float(Call("libm::atanf")),
        Op::Atan2 => float(Call("libm::atan2f")),
        Op::Sinh => float(Call("libm::sinhf")),
        Op::Cosh => float(Call("libm::coshf")),
        Op::Tanh => float(Call("libm::tanhf")),
        Op::Asinh => float(Call("libm::asinhf")),
        Op::Acosh => float(Call("libm::acoshf")),
        Op::Atanh => float(Call("libm::atanhf")),
        Op::Quantize => float(Known("quantize")),
        Op::Ldexp => is(Known("ldexp"), &[Float, Int], Float),
        Op::FrexpFraction => float(Known("frexp_fraction")),
        Op::FrexpExponent => is(Known("frexp_exponent"), &[Float], Int),
        Op::Equal => test("=="),
        Op::NotEqual => test("!="),
        Op::Less => test("<"),
        Op::LessEqual => test("<="),
        Op::IsNan => is(Method("is_nan"), &[Float], Bool),
        Op::IsInf => is(Method("is_infinite"), &[Float], Bool),
        Op::SelectFloat => is(Choice, &[Bool, Float, Float], Float),
        Op::FloatToInt => is(Known("i32_from"), &[Float], Int),
        Op::FloatToUint => is(Known("u32_from"), &[Float], Uint),
        Op::IntToFloat => is(Cast("f32"), &[Int], Float),
        Op::UintToFloat => is(Cast("f32"), &[Uint], Float),
        Op::FloatToBits => is(Known("bits"), &[Float], Uint),
        Op::BitsToFloat => is(Call("f32::from_bits"), &[Uint], Float),
        Op::FloatToHalf => is(Known("half"), &[Float], Uint),
        Op::HalfToFloat => is(Known("float_of_half"), &[Uint], Float),
        Op::SignedNorm => is(Known("signed_norm"), &[Float, Float], Int),
        Op::UnsignedNorm => is(Known("unsigned_norm"), &[Float, Float], Int),
        Op::AddWord => wrapping("wrapping_add"),
        Op::SubWord => wrapping("wrapping_sub"),
        Op::MulWord => wrapping("wrapping_mul"),
        Op::NegWord => wrapping("wrapping_neg"),
        Op::DivInt => int(Known("div_int")),
        Op::DivUint => uint(Known("div_uint")),
        Op::RemInt => int(Known("rem_int")),
        Op::RemUint => uint(Known("rem_uint")),
        Op::AbsInt => int(Method("wrapping_abs")),
        Op::SignInt => int(Method("signum")),
        Op::MinInt => int(Method("min")),
        Op::MaxInt => int(Method("max")),
        Op::MinUint => uint(Method("min")),
        Op::MaxUint => uint(Method("max")),
        Op::And => bits("&", Level::BitAnd),
        Op::Or => bits("|", Level::BitOr),
        Op::Xor if given.first() == Some(&Bool) => {
            is(Infix("^", Level::BitXor), &[Bool, Bool], Bool)
        }
        Op::Xor => bits("^", Level::BitXor),
        Op::Not => is(Prefix("!"), &[word], word),
        Op::ShiftLeft => is(Shift("<<"), &[integer, Uint], integer),
        Op::ShiftRightInt => is(Shift(">>"), &[Int, Uint], Int),
        Op::ShiftRightUint => is(Shift(">>"), &[Uint, Uint], Uint),
        Op::EqualWord => equal("=="),
        Op::NotEqualWord => equal("!="),
        Op::LessInt => is(Infix("<", Level::Compare), &[Int, Int], Bool),
        Op::LessEqualInt => is(Infix("<=", Level::Compare), &[Int, Int], Bool),
        Op::LessUint => is(Infix("<", Level::Compare), &[Uint, Uint], Bool),
        Op::LessEqualUint => is(Infix("<=", Level::Compare), &[Uint, Uint], Bool),
        Op::SelectWord => {
            let rest = given.get(1..).unwrap_or(&[]);
            let chosen = match rest.first() {
                Some(Bool) if rest.iter().all(|ty| *ty == Bool) => Bool,
                Some(Int) => Int,
                _ => Uint,
            };
            is(Choice, &[Bool, chosen, chosen], chosen)
        }
        Op::CountOnes => uint(Method("count_ones")),
        Op::CountLeadingZeros => uint(Method("leading_zeros")),
        Op::CountTrailingZeros => uint(Method("trailing_zeros")),
        Op::ReverseBits => uint(Method("reverse_bits")),
        Op::FirstTrailingBit => uint(Known("first_trailing_bit")),
        Op::FirstLeadingBit => uint(Known("first_leading_bit")),
        Op::FirstLeadingBitInt => is(Known("first_leading_bit_int"), &[Int], Uint),
        Op::Extract => uint(Known("extract")),
        Op::ExtractInt => is(Known("extract_int"), &[Uint, Uint, Uint], Int),
        Op::Field => uint(Known("field")),
    }
}

/// Functions that are written by hand: the name, those that it calls, the text.
const FUNCTIONS: &[(&str, &[&str], &str)] = &[
    ("rem", &[], "    /// The remainder of truncated division.
    pub(super) fn rem(a: f32, b: f32) -> f32 {
        a - b * libm::truncf(a / b)
    }
"),
    ("sign", &[], "    /// -1, 0 or 1; 0 of what is not a number.
    pub(super) fn sign(a: f32) -> f32 {
        if a < 0.0 {
            -1.0
        } else if 0.0 < a {
            1.0
        } else {
            0.0
        }
    }
"),
    ("min", &[], "    /// The smaller; where one is not a number, the other.
    pub(super) fn min(a: f32, b: f32) -> f32 {
        if b < a || a.is_nan() { b } else { a }
    }
"),
    ("max", &[], "    /// The larger; where one is not a number, the other.
    pub(super) fn max(a: f32, b: f32) -> f32 {
        if a < b || a.is_nan() { b } else { a }
    }
"),
    ("clamp", &["min", "max"], "    pub(super) fn clamp(a: f32, low: f32, high: f32) -> f32 {
        min(max(a, low), high)
    }
"),
    ("saturate", &["clamp"], "    pub(super) fn saturate(a: f32) -> f32 {
        clamp(a, 0.0, 1.0)
    }
"),
    ("fract", &[], "    pub(super) fn fract(a: f32) -> f32 {
        a - libm::floorf(a)
    }
"),
    ("mix", &[], "    pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
        a * (1.0 - t) + b * t
    }
"),
    ("step", &[], "    pub(super) fn step(edge: f32, a: f32) -> f32 {
        if edge <= a { 1.0 } else { 0.0 }
    }
"),
    ("smooth_step", &["saturate"], "    pub(super) fn smooth_step(low: f32, high: f32, a: f32) -> f32 {
        let t = saturate((a - low) / (high - low));
        t * t * (3.0 - 2.0 * t)
    }
"),
    ("pow", &[], "    /// As GPUs have it; 1 where the exponent is 0.
    pub(super) fn pow(a: f32, b: f32) -> f32 {
        if b == 0.0 { 1.0 } else { libm::exp2f(b * libm::log2f(a)) }
    }
"),
    ("quantize", &["half", "float_of_half"], "    pub(super) fn quantize(a: f32) -> f32 {
        float_of_half(half(a))
    }
"),
    ("ldexp", &[], "    /// In three steps, so that each power of two is a number.
    pub(super) fn ldexp(a: f32, exponent: i32) -> f32 {
        let n = exponent.clamp(-300, 300);
        let first = n / 3;
        let power = |n: i32| f32::from_bits(((n + 127) as u32) << 23);
        a * power(first) * power(first) * power(n - 2 * first)
    }
"),
    ("frexp_fraction", &[], "    pub(super) fn frexp_fraction(a: f32) -> f32 {
        if a == 0.0 || !a.is_finite() {
            return a;
        }
        // A small number is made larger, so that its first digit stands where it does in others.
        let a = if libm::fabsf(a) < f32::MIN_POSITIVE { a * 8_388_608.0 } else { a };
        f32::from_bits((a.to_bits() & 0x807f_ffff) | 0x3f00_0000)
    }
"),
    ("frexp_exponent", &[], "    pub(super) fn frexp_exponent(a: f32) -> i32 {
        if a == 0.0 || !a.is_finite() {
            return 0;
        }
        let is_small = libm::fabsf(a) < f32::MIN_POSITIVE;
        let (a, shift) = if is_small { (a * 8_388_608.0, 23) } else { (a, 0) };
        ((a.to_bits() >> 23) & 0xff) as i32 - 126 - shift
    }
"),
    ("i32_from", &[], "    /// Truncated to the nearest that is both an integer and a float.
    pub(super) fn i32_from(a: f32) -> i32 {
        let a = if a < -2147483600.0 { -2147483600.0 } else { a };
        (if a > 2147483500.0 { 2147483500.0 } else { a }) as i32
    }
"),
    ("u32_from", &[], "    /// Truncated to the nearest that is both an integer and a float.
    pub(super) fn u32_from(a: f32) -> u32 {
        (if a > 4294967000.0 { 4294967000.0 } else { a }) as u32
    }
"),
    ("bits", &[], "    pub(super) fn bits(a: f32) -> u32 {
        if a.is_nan() { 0x7fc0_0000 } else { a.to_bits() }
    }
"),
    ("half", &[], "    /// Half precision, rounded to nearest, ties to even; too large is infinite.
    pub(super) fn half(a: f32) -> u32 {
        let sign = (a.to_bits() >> 16) & 0x8000;
        let size = a.to_bits() & 0x7fff_ffff;
        let half = if size > 0x7f80_0000 {
            0x7e00
        } else if size >= 65520f32.to_bits() {
            0x7c00
        } else if size < 113 << 23 {
            // A multiple of 2^-24: the sum with 0.5 rounds to it.
            (f32::from_bits(size) + 0.5).to_bits().wrapping_sub(0.5f32.to_bits())
        } else {
            (size - (112 << 23) + 0xfff + ((size >> 13) & 1)) >> 13
        };
        sign | half
    }
"),
    ("float_of_half", &[], "    /// The number of the low 16 bits.
    pub(super) fn float_of_half(half: u32) -> f32 {
        let size = half & 0x7fff;
        let a = if size > 0x7c00 {
            f32::NAN
        } else if size == 0x7c00 {
            f32::INFINITY
        } else {
            f32::from_bits(size << 13) * f32::from_bits((112 + 127) << 23)
        };
        if half & 0x8000 == 0 { a } else { -a }
    }
"),
    ("signed_norm", &["clamp"], "    pub(super) fn signed_norm(a: f32, scale: f32) -> i32 {
        libm::floorf(0.5 + scale * clamp(a, -1.0, 1.0)) as i32
    }
"),
    ("unsigned_norm", &["clamp"], "    pub(super) fn unsigned_norm(a: f32, scale: f32) -> i32 {
        libm::floorf(0.5 + scale * clamp(a, 0.0, 1.0)) as i32
    }
"),
    ("div_int", &[], "    pub(super) fn div_int(a: i32, b: i32) -> i32 {
        if b == 0 { a } else { a.wrapping_div(b) }
    }
"),
    ("div_uint", &[], "    pub(super) fn div_uint(a: u32, b: u32) -> u32 {
        a.checked_div(b).unwrap_or(a)
    }
"),
    ("rem_int", &[], "    pub(super) fn rem_int(a: i32, b: i32) -> i32 {
        if b == 0 { 0 } else { a.wrapping_rem(b) }
    }
"),
    ("rem_uint", &[], "    pub(super) fn rem_uint(a: u32, b: u32) -> u32 {
        a.checked_rem(b).unwrap_or(0)
    }
"),
    ("first_trailing_bit", &[], "    pub(super) fn first_trailing_bit(a: u32) -> u32 {
        if a == 0 { u32::MAX } else { a.trailing_zeros() }
    }
"),
    ("first_leading_bit", &[], "    pub(super) fn first_leading_bit(a: u32) -> u32 {
        if a == 0 { u32::MAX } else { 31 - a.leading_zeros() }
    }
"),
    ("first_leading_bit_int", &["first_leading_bit"], "    pub(super) fn first_leading_bit_int(a: i32) -> u32 {
        first_leading_bit((if a < 0 { !a } else { a }) as u32)
    }
"),
    ("field", &[], "    /// Ones in `count` bits from `offset` up.
    pub(super) fn field(offset: u32, count: u32) -> u32 {
        let offset = offset.min(32);
        let count = count.min(32 - offset);
        (((1u64 << count) - 1) << offset) as u32
    }
"),
    ("extract", &["field"], "    pub(super) fn extract(a: u32, offset: u32, count: u32) -> u32 {
        (u64::from(a & field(offset, count)) >> offset.min(32)) as u32
    }
"),
    ("extract_int", &[], "    pub(super) fn extract_int(a: u32, offset: u32, count: u32) -> i32 {
        let offset = offset.min(32);
        let count = count.min(32 - offset);
        if count == 0 {
            return 0;
        }
        ((a << (32 - offset - count)) as i32) >> (32 - count)
    }
"),
    ("at", &[], "    /// A place in a list, or the last.
    pub(super) fn at(index: u32, length: usize) -> usize {
        (index as usize).min(length - 1)
    }
"),
    ("element", &[], "    /// An element of a list, or the last, or `none` of an empty one.
    pub(super) fn element<T: Copy>(list: &[T], index: u32, none: T) -> T {
        list.get(index as usize).or(list.last()).copied().unwrap_or(none)
    }
"),
    ("three", &[], "    /// A vector of three without its padding.
    pub(super) fn three<T: Copy>(padded: [T; 4]) -> [T; 3] {
        [padded[0], padded[1], padded[2]]
    }
"),
    ("padded", &[], "    /// A vector of three in the place of four.
    pub(super) fn padded<T: Copy + Default>(a: [T; 3]) -> [T; 4] {
        [a[0], a[1], a[2], T::default()]
    }
"),
    ("pick", &[], "    /// Some components of a vector, in another order.
    pub(super) fn pick<T: Copy, const N: usize, const M: usize>(a: [T; N], at: [usize; M]) -> [T; M] {
        at.map(|at| a[at])
    }
"),
    ("join_2_1", &[], "    pub(super) fn join_2_1<T: Copy>(a: [T; 2], b: T) -> [T; 3] {
        [a[0], a[1], b]
    }
"),
    ("join_1_2", &[], "    pub(super) fn join_1_2<T: Copy>(a: T, b: [T; 2]) -> [T; 3] {
        [a, b[0], b[1]]
    }
"),
    ("join_3_1", &[], "    pub(super) fn join_3_1<T: Copy>(a: [T; 3], b: T) -> [T; 4] {
        [a[0], a[1], a[2], b]
    }
"),
    ("join_1_3", &[], "    pub(super) fn join_1_3<T: Copy>(a: T, b: [T; 3]) -> [T; 4] {
        [a, b[0], b[1], b[2]]
    }
"),
    ("join_2_2", &[], "    pub(super) fn join_2_2<T: Copy>(a: [T; 2], b: [T; 2]) -> [T; 4] {
        [a[0], a[1], b[0], b[1]]
    }
"),
    ("join_2_1_1", &[], "    pub(super) fn join_2_1_1<T: Copy>(a: [T; 2], b: T, c: T) -> [T; 4] {
        [a[0], a[1], b, c]
    }
"),
    ("join_1_2_1", &[], "    pub(super) fn join_1_2_1<T: Copy>(a: T, b: [T; 2], c: T) -> [T; 4] {
        [a, b[0], b[1], c]
    }
"),
    ("join_1_1_2", &[], "    pub(super) fn join_1_1_2<T: Copy>(a: T, b: T, c: [T; 2]) -> [T; 4] {
        [a, b, c[0], c[1]]
    }
"),
    ("put", &[], "    /// Writes words into bytes, from a place on.
    pub(super) fn put<const N: usize>(bytes: &mut [u8], at: usize, words: [u32; N]) {
        for (i, word) in words.into_iter().enumerate() {
            bytes[at + 4 * i..][..4].copy_from_slice(&word.to_le_bytes());
        }
    }
"),
];
