//! Every operation: the loops, in all ways in which operands vary, against the table that folding uses;
//! and expressions computed for lanes against the same ones folded.

use super::*;
use crate::machine::kernels::once;
use lodc_passes::semantics::{Op, evaluate};

/// A generator of numbers (xorshift).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub(super) fn below(&mut self, n: u64) -> u64 {
        (self.next() >> 16) % n
    }

    /// A float: often small, sometimes special, sometimes any bits.
    fn float(&mut self) -> u32 {
        let special = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
            f32::MAX,
            f32::MIN_POSITIVE,
            1e-40,
        ];
        match self.below(8) {
            0 => special[self.below(special.len() as u64) as usize].to_bits(),
            1 => self.next() as u32,
            _ => ((self.below(2_000_001) as f32 - 1e6) * 1e-5).to_bits(),
        }
    }

    /// A word: often small, sometimes any bits.
    fn word(&mut self) -> u32 {
        match self.below(4) {
            0 => self.next() as u32,
            1 => (self.below(70) as i32 - 35) as u32,
            _ => self.below(40) as u32,
        }
    }
}

#[test]
fn loops_agree_with_folding() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    for &op in Op::ALL {
        let (kinds, result) = op.signature();
        // Bit i: operand i is uniform. With all of them uniform it is done once.
        for uniform in 0..1u32 << kinds.len() {
            let mut registers = Registers::<f32>::new([4, 4, 4, 4]);
            let mut operands = [Register::NONE; 3];
            for (i, kind) in kinds.iter().enumerate() {
                if uniform >> i & 1 == 1 {
                    operands[i] = Register::uniform(i as u32);
                    let (float, word) = (random.float(), random.word());
                    registers.uniform_floats[i] = f32::from_bits(float);
                    registers.uniform_words[i] = word;
                } else {
                    operands[i] = Register::varying(i as u32);
                    for lane in 0..LANES {
                        registers.floats[i][lane] = f32::from_bits(random.float());
                        registers.words[i][lane] = random.word();
                    }
                }
                if *kind == Kind::W && op_takes_condition(op, i) {
                    registers.uniform_words[i] &= 1;
                    registers.words[i].iter_mut().for_each(|w| *w &= 1);
                }
            }
            let expected: Vec<u32> = (0..LANES)
                .map(|lane| {
                    let row: Vec<u32> = kinds
                        .iter()
                        .enumerate()
                        .map(|(i, kind)| match (kind, uniform >> i & 1 == 1) {
                            (Kind::F, true) => registers.uniform_floats[i].to_bits(),
                            (Kind::F, false) => registers.floats[i][lane].to_bits(),
                            (Kind::W, true) => registers.uniform_words[i],
                            (Kind::W, false) => registers.words[i][lane],
                        })
                        .collect();
                    evaluate(op, &row)
                })
                .collect();
            let got = |registers: &Registers<f32>, lane: usize, to: Register| match (
                result,
                to.is_uniform(),
            ) {
                (Kind::F, true) => words::bits(registers.uniform_floats[to.index()]),
                (Kind::F, false) => words::bits(registers.floats[to.index()][lane]),
                (Kind::W, true) => registers.uniform_words[to.index()],
                (Kind::W, false) => registers.words[to.index()][lane],
            };
            if uniform + 1 == 1 << kinds.len() {
                let to = Register::uniform(3);
                once(&mut registers, op, to, operands);
                assert_eq!(got(&registers, 0, to), expected[0], "{op:?} once");
                continue;
            }
            // In a register of its own, then in an operand's.
            let in_place = (0..kinds.len())
                .find(|&i| uniform >> i & 1 == 0 && kinds[i] == result)
                .map(|i| Register::varying(i as u32));
            let saved = Registers {
                floats: registers.floats.clone(),
                words: registers.words.clone(),
                uniform_floats: registers.uniform_floats.clone(),
                uniform_words: registers.uniform_words.clone(),
                spare_float: registers.spare_float.clone(),
                spare_word: registers.spare_word.clone(),
            };
            for vectors in [Vectors::detect(), None] {
                for to in std::iter::once(Register::varying(3)).chain(in_place) {
                    registers.floats.clone_from(&saved.floats);
                    registers.words.clone_from(&saved.words);
                    f32::apply(vectors, &mut registers, op, to, operands);
                    for (lane, &expected) in expected.iter().enumerate() {
                        let got = got(&registers, lane, to);
                        assert_eq!(
                            got,
                            expected,
                            "{op:?}, lane {lane}, uniform {uniform:b}, {vectors:?}: {} is not {}",
                            f32::from_bits(got),
                            f32::from_bits(expected)
                        );
                    }
                }
            }
        }
    }
}

fn op_takes_condition(op: Op, operand: usize) -> bool {
    matches!(op, Op::SelectFloat | Op::SelectWord) && operand == 0
}

/// Expressions of `a`, `b`, `c` (three-component vectors) and `x`, `y` (scalars), all between -2 and 2, and
/// `j`, `k` (integers); with the number of components of the result, all floats.
const EXPRESSIONS: &[(&str, usize)] = &[
    ("a + b * c - a / b", 3),
    ("a % b", 3),
    ("-a", 3),
    ("a * x + vec3(y)", 3),
    ("vec3f(a < b) + vec3f(a >= b) * 2.0 + vec3f(a == b)", 3),
    (
        "vec3(select(x, y, all(a > b)), select(x, y, any(a > b)), 0.0)",
        3,
    ),
    ("select(a, b, c > vec3(0.0))", 3),
    ("vec3(dot(a, b), length(a), distance(a, b))", 3),
    ("cross(a, b)", 3),
    ("normalize(a)", 3),
    ("reflect(a, normalize(b))", 3),
    ("refract(normalize(a), normalize(b), x)", 3),
    ("faceForward(a, b, c)", 3),
    ("mix(a, b, c)", 3),
    ("mix(a, b, x)", 3),
    ("clamp(a, min(b, c), max(b, c))", 3),
    ("saturate(a)", 3),
    ("smoothstep(a, b, c) + step(a, b)", 3),
    ("min(a, b) + max(b, c) + abs(c) + sign(a)", 3),
    ("floor(a) + ceil(b) + round(c) + trunc(a) + fract(b)", 3),
    ("sqrt(abs(a)) + inverseSqrt(abs(b))", 3),
    ("exp(a) + exp2(b) + log(abs(c)) + log2(abs(a))", 3),
    ("pow(abs(a), b)", 3),
    ("sin(a) + cos(b) + tan(c)", 3),
    ("asin(a * 0.5) + acos(b * 0.5) + atan(c) + atan2(a, b)", 3),
    ("sinh(a) + cosh(b) + tanh(c)", 3),
    ("asinh(a) + acosh(abs(b) + 1.0) + atanh(c * 0.5)", 3),
    ("radians(a) + degrees(b)", 3),
    ("fma(a, b, c)", 3),
    ("quantizeToF16(a)", 3),
    ("ldexp(a, vec3(j, k, 3))", 3),
    ("modf(a).fract + modf(b).whole", 3),
    ("frexp(a).fract + vec3f(frexp(b).exp)", 3),
    ("mat3x3(a, b, c) * a + b * mat3x3(a, b, c)", 3),
    ("(mat3x3(a, b, c) * mat3x3(b, c, a))[1]", 3),
    (
        "transpose(mat3x3(a, b, c))[2] + determinant(mat3x3(a, b, c))",
        3,
    ),
    ("(mat2x3(a, b) + mat2x3(b, c) * 2.0)[1]", 3),
    ("vec3f(vec3(j + k, j * k, j - k))", 3),
    ("vec3f(vec3(j / k, j % k, -j))", 3),
    ("vec3f(vec3(j & k, j | k, j ^ k))", 3),
    (
        "vec3f(vec3(~j, j << bitcast<u32>(k), j >> bitcast<u32>(k)))",
        3,
    ),
    ("vec3f(vec3(min(j, k), max(j, k), clamp(j, 1, 3)))", 3),
    ("vec3f(vec3(abs(j), sign(j), i32(x * 9.0)))", 3),
    (
        "vec3f(vec3(bitcast<u32>(j) / bitcast<u32>(k), bitcast<u32>(j) >> 3u, u32(x)))",
        3,
    ),
    (
        "vec3f(vec3(countOneBits(j), countLeadingZeros(k), countTrailingZeros(j)))",
        3,
    ),
    (
        "vec3f(vec3(reverseBits(j), firstLeadingBit(k), firstTrailingBit(j)))",
        3,
    ),
    (
        "vec3f(vec3(extractBits(j, 1u, 3u), insertBits(j, k, 2u, 4u), dot(vec2(j, k), vec2(k, 2))))",
        3,
    ),
    ("vec3f(vec3(f32(j), f32(bitcast<u32>(k)), f32(j < k)))", 3),
    ("unpack4x8unorm(pack4x8unorm(vec4(a, x))).xyz", 3),
    ("unpack4x8snorm(pack4x8snorm(vec4(a, x))).xyz", 3),
    (
        "vec3(unpack2x16float(pack2x16float(a.xy)), unpack2x16unorm(pack2x16unorm(b.xy)).x)",
        3,
    ),
    (
        "vec3(unpack2x16snorm(pack2x16snorm(a.xy)), f32(bitcast<u32>(x) >> 9u))",
        3,
    ),
];

/// The same expression of inputs that differ from lane to lane, of a uniform buffer, and of overrides,
/// which the compiler folds: the same bits.
#[test]
fn lanes_uniforms_and_folding_agree() {
    let names = [
        "a.x", "a.y", "a.z", "b.x", "b.y", "b.z", "c.x", "c.y", "c.z", "x", "y",
    ];
    let mut random = Random(77);
    for &(expression, components) in EXPRESSIONS {
        let program = |declare: &str, bind: &str| {
            let source = format!(
                "{declare}
                @fragment fn main(in: In) -> @location(0) vec4f {{
                    {bind}
                    return vec4({expression}, 0.0);
                }}"
            );
            compile(&source)
        };
        let inputs =
            "struct In { @location(0) a: vec3f, @location(1) b: vec3f, @location(2) c: vec3f,
            @location(3) x: f32, @location(4) y: f32,
            @location(5) @interpolate(flat) j: i32, @location(6) @interpolate(flat) k: i32 }";
        let varying = program(
            inputs,
            "let a = in.a; let b = in.b; let c = in.c; let x = in.x; let y = in.y; let j = in.j; let k = in.k;",
        );
        let given: Vec<Words> = (0..13)
            .map(|slot| {
                std::array::from_fn(|_| match slot {
                    11 | 12 => (random.below(16) as i32 - 8) as u32,
                    _ => (random.below(4001) as f32 / 1000.0 - 2.0).to_bits(),
                })
            })
            .collect();
        let nothing = Bindings::new();
        let mut machine = Machine::new(&varying, &nothing);
        let mut outputs = vec![[0; LANES]; 4];
        machine.run(&given, Mask::ALL, Mask::ALL, &mut outputs);
        for lane in [0, 17, 255] {
            let value = |slot: usize| given[slot][lane];
            // Folded.
            let mut declare = inputs.to_string();
            for (slot, name) in names.iter().enumerate() {
                let name = name.replace('.', "");
                let number = f32::from_bits(value(slot));
                declare += &format!("override {name}_: f32 = {number:?};\n");
            }
            declare += &format!("override j_: i32 = {};\n", value(11) as i32);
            declare += &format!("override k_: i32 = {};\n", value(12) as i32);
            let folded = program(
                &declare,
                "let a = vec3(ax_, ay_, az_); let b = vec3(bx_, by_, bz_); let c = vec3(cx_, cy_, cz_);
                 let x = x_; let y = y_; let j = j_; let k = k_;",
            );
            let counts =
                |code: &[Instruction]| code.iter().all(|i| matches!(i, Instruction::Count(_)));
            let code = &folded.code;
            assert!(
                counts(&code.instructions) && code.prologue.is_empty(),
                "{expression} is not folded"
            );
            // From a buffer.
            let declare = format!(
                "{inputs} struct U {{ a: vec3f, x: f32, b: vec3f, y: f32, c: vec3f, j: i32, k: i32 }}
                 @group(0) @binding(0) var<uniform> u: U;"
            );
            let uniform = program(
                &declare,
                "let a = u.a; let b = u.b; let c = u.c; let x = u.x; let y = u.y; let j = u.j; let k = u.k;",
            );
            assert!(
                counts(&uniform.code.instructions),
                "{expression} is not done once"
            );
            let order = [0, 1, 2, 9, 3, 4, 5, 10, 6, 7, 8, 11, 12];
            let bytes = order
                .iter()
                .flat_map(|&slot| value(slot).to_le_bytes())
                .collect();
            let bindings = Bindings::from([((0, 0), Resource::Buffer(Arc::new(bytes)))]);
            for (name, program) in [("folded", &folded), ("uniform", &uniform)] {
                let mut machine = Machine::new(program, &bindings);
                let mut alike = vec![[0; LANES]; 4];
                machine.run(&given, Mask::ALL, Mask::ALL, &mut alike);
                for component in 0..components {
                    let (got, want) = (alike[component][lane], outputs[component][lane]);
                    assert_eq!(
                        got,
                        want,
                        "{expression}, {name}, lane {lane}, component {component}: {} is not {}",
                        f32::from_bits(got),
                        f32::from_bits(want)
                    );
                }
            }
        }
    }
}
