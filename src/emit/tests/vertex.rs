//! Levels whose vertex stage differs from the author's, and that hand more over than his does.

use super::*;
use naga::{
    BinaryOperator, Binding, BuiltIn, Expression, FunctionArgument, FunctionResult, Interpolation,
    Sampling, Scalar, Span, Statement, StructMember, Type, TypeInner, VectorSize,
};

/// A material, and three levels of it that a pass could have made.
const LIT: &str = "\
// A shape under one lamp.
struct Frame { view_proj: mat4x4f, model: mat4x4f, }
struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) normal: vec3f,
    @location(2) uv: vec2f,
}
@group(0) @binding(0) var<uniform> frame: Frame;

@vertex // moves it
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Varyings {
    let clip = frame.view_proj * frame.model * vec4f(position, 1.0);
    return Varyings(clip, normal, uv);
}

@fragment
fn fs_main(in: Varyings) -> @location(0) vec4f {
    let lit = max(dot(normalize(in.normal), vec3f(0.48, 0.6, 0.64)), 0.0);
    let specular = pow(lit, 8.0) * vec3f(1.0, 0.9, 0.8);
    return vec4f(vec3f(0.3, 0.2, in.uv.x) * lit + specular, 1.0);
}
";

/// Location, name, type and value of something that is handed over.
type Handed<'a> = (u32, &'a str, &'a str, &'a str);

/// The author's text with a vertex stage that also hands over `name`, a `ty` that is `value`, and a fragment stage that
/// returns `colour`.
fn variant(text: &str, handed_over: &[Handed<'_>], colour: &str) -> Shader {
    let each =
        |one: &dyn Fn(&Handed<'_>) -> String| -> String { handed_over.iter().map(one).collect() };
    let members = each(&|(at, name, ty, _)| format!("@location({at}) {name}: {ty},\n"));
    let values = each(&|(_, _, _, value)| format!(", {value}"));
    let arguments = each(&|(at, name, ty, _)| format!(", @location({at}) {name}: {ty}"));
    let authors = "struct Varyings {
        @builtin(position) clip: vec4f, @location(0) normal: vec3f, @location(2) uv: vec2f,\n";
    let (head, _) = text.split_once("struct Varyings").expect("it has one");
    let (_, rest) = text.split_once("@group").expect("it has one");
    let (rest, _) = rest.split_once("@fragment").expect("it has one");
    let rest = rest
        .replace("-> Varyings {", "-> Handed {")
        .replace("return Varyings(clip, normal, uv", &format!("let lit = max(dot(normal, vec3f(0.48, 0.6, 0.64)), 0.0);\nreturn Handed(clip, normal, uv{values}"));
    let text = format!(
        "{head}{authors}}}\n{}{members}}}\n@group{rest}@fragment fn fs_main(in: Varyings{arguments}) -> @location(0) vec4f {{ {colour} }}",
        authors.replace("Varyings", "Handed"),
    );
    base(&source(&text))
}

/// Specular per vertex, nothing per vertex, and both terms per vertex.
fn levels_of_lit() -> Vec<EmitLevel> {
    let specular = "pow(lit, 8.0) * vec3f(1.0, 0.9, 0.8)";
    let lit = "let lit = max(dot(normalize(in.normal), vec3f(0.48, 0.6, 0.64)), 0.0);";
    let first = variant(
        LIT,
        &[(1, "specular", "vec3f", specular)],
        &format!("{lit} return vec4f(vec3f(0.3, 0.2, in.uv.x) * lit + specular, 1.0);"),
    );
    let second = variant(LIT, &[], &format!("{lit} return vec4f(vec3f(lit), 1.0);"));
    let third = variant(
        LIT,
        &[
            (1, "lit", "f32", "lit"),
            (3, "colour", "vec3f", "vec3f(0.3, 0.2, uv.x) * lit"),
        ],
        "return vec4f(colour + pow(lit, 8.0), 1.0);",
    );
    let source = source(LIT);
    [(0.5, first), (1.0, second), (2.0, third)]
        .map(|(autolod, shader)| EmitLevel {
            shader,
            ..level(&source, autolod)
        })
        .into()
}

#[track_caller]
fn spliced(levels: &[EmitLevel], text: &str, form: Form) -> String {
    let source = source(text);
    let files = emit(&source, &base(&source), levels, output(form, Target::Wgsl));
    let files = files.unwrap_or_else(|e| panic!("{e}"));
    String::from_utf8(files[0].1.clone()).expect("it is text")
}

#[test]
fn both_entry_points_choose() {
    let text = spliced(&levels_of_lit(), LIT, Form::Override);
    has(
        &text,
        "\n// moves it\nfn original_vs_main(position: vec3f, normal: vec3f, uv: vec2f) -> Varyings {\n",
    );
    has(&text, "fn original_fs_main(in: Varyings) -> vec4f {\n");
    let (_, generated) = text.split_once("override autoLOD").expect("it is there");
    assert_eq!(
        generated,
        ": f32 = 0.0;

// What the vertex stage hands over: zeros where a level has no use for them.
struct VaryingsOfLevels {
    @builtin(position) clip: vec4f,
    @location(0) normal: vec3f,
    @location(2) uv: vec2f,
    @location(1) specular_or_colour: vec3f,
    @location(3) lit: f32,
}

@vertex // moves it
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> VaryingsOfLevels {
    if !(autoLOD >= 0.5) {
        let original = original_vs_main(position, normal, uv);
        return VaryingsOfLevels(original.clip, original.normal, original.uv, vec3f(), 0.0);
    }
    if !(autoLOD >= 1.0) { return lod_one_vs_main(position, normal, uv); }
    if !(autoLOD >= 2.0) {
        let original = original_vs_main(position, normal, uv);
        return VaryingsOfLevels(original.clip, original.normal, original.uv, vec3f(), 0.0);
    }
    return lod_three_vs_main(position, normal, uv);
}

@fragment
fn fs_main(in: Varyings, @location(1) specular_or_colour: vec3f, @location(3) lit: f32) -> @location(0) vec4f {
    if !(autoLOD >= 0.5) { return original_fs_main(in); }
    if !(autoLOD >= 1.0) { return lod_one_fs_main(in, specular_or_colour); }
    if !(autoLOD >= 2.0) { return lod_two_fs_main(in); }
    return lod_three_fs_main(in, lit, specular_or_colour);
}

// Level 1. Detail left out.
fn lod_one_vs_main(position: vec3f, normal: vec3f, uv: vec2f) -> VaryingsOfLevels {
    let clip = frame.view_proj * frame.model * vec4f(position, 1.0);
    let lit = max(dot(normal, vec3f(0.48, 0.6, 0.64)), 0.0);
    let return_mul = pow(lit, 8.0) * vec3f(1.0, 0.9, 0.8);
    return VaryingsOfLevels(clip, normal, uv, return_mul, 0.0);
}

fn lod_one_fs_main(in: Varyings, specular: vec3f) -> vec4f {
    let lit = max(dot(normalize(in.normal), vec3f(0.48, 0.6, 0.64)), 0.0);
    return vec4f(vec3f(0.3, 0.2, in.uv.x) * lit + specular, 1.0);
}

// Level 2. Detail left out.
fn lod_two_fs_main(in: Varyings) -> vec4f {
    let lit = max(dot(normalize(in.normal), vec3f(0.48, 0.6, 0.64)), 0.0);
    return vec4f(vec3(lit), 1.0);
}

// Level 3. Detail left out.
fn lod_three_vs_main(position: vec3f, normal: vec3f, uv: vec2f) -> VaryingsOfLevels {
    let clip = frame.view_proj * frame.model * vec4f(position, 1.0);
    let lit = max(dot(normal, vec3f(0.48, 0.6, 0.64)), 0.0);
    let return_mul = vec3f(0.3, 0.2, uv.x) * lit;
    return VaryingsOfLevels(clip, normal, uv, return_mul, lit);
}

fn lod_three_fs_main(in: Varyings, lit: f32, colour: vec3f) -> vec4f {
    return vec4f(colour + vec3(pow(lit, 8.0)), 1.0);
}
"
    );
}

#[test]
fn a_file_hands_over_what_its_level_reads() {
    let source = source(LIT);
    let mut levels = levels_of_lit();
    // Lit from its normal alone, with one structure for both ends.
    let (head, _) = LIT.split_once("    let specular").expect("it has it");
    let text = format!("{head}    return vec4f(lit);\n}}\n");
    levels[1].shader = base(&self::source(&text));
    let files = emit(
        &source,
        &base(&source),
        &levels,
        output(Form::Files, Target::Wgsl),
    );
    let files = files.unwrap_or_else(|e| panic!("{e}"));
    let text = |at: usize| String::from_utf8_lossy(&files[at].1).into_owned();
    let second = text(2);
    has(
        &second,
        "struct VaryingsOfLevel {
    @builtin(position) clip: vec4f,
    @location(0) normal: vec3f,
}
",
    );
    has(
        &second,
        "fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> VaryingsOfLevel {",
    );
    has(
        &second,
        "fn fs_main(in: VaryingsOfLevel) -> @location(0) vec4f {",
    );
    assert!(!second.contains("uv"), "{second}");
    // Lit at the vertices: nothing of the author's is handed over, and the locations are those that they were.
    let third = text(3);
    has(
        &third,
        "    @builtin(position) clip: vec4f,
    @location(1) lit: f32,
    @location(3) colour: vec3f,
}
",
    );
    has(&third, "@location(2) uv: vec2f) ->");
    has(
        &third,
        "fn fs_main(@location(1) lit: f32, @location(3) colour: vec3f) -> @location(0) vec4f {",
    );
}

#[test]
fn locations_are_counted_over_all_levels() {
    let (base, levels) = (base(&source(LIT)), levels_of_lit());
    let count =
        |of: &[usize]| shared_locations(&base, of.iter().map(|at| &levels[*at].shader), false);
    assert_eq!([count(&[]), count(&[1]), count(&[0])], [2, 2, 3]);
    assert_eq!([count(&[2]), count(&[0, 1, 2]), count(&[2, 2, 0])], [4; 3]);
}

#[test]
fn the_uniform_is_said_to_be_read_by_both_stages() {
    let text = spliced(&levels_of_lit(), LIT, Form::Uniform);
    has(&text, "0 is the original; both stages read it.\n");
    let chooses = "if !(level_of_detail.autoLOD >= 0.5) {";
    assert_eq!(text.matches(chooses).count(), 2, "{text}");
}

#[test]
fn levels_with_one_vertex_stage_share_its_function() {
    let mut levels = levels_of_lit();
    levels[1].shader = levels[0].shader.clone();
    let text = spliced(&levels[..2], LIT, Form::Override);
    assert_eq!(text.matches("fn lod_one_vs_main(").count(), 1, "{text}");
    assert!(!text.contains("lod_two_vs_main"), "{text}");
    has(
        &text,
        "    return lod_one_vs_main(position, normal, uv);\n}",
    );
    has(&text, "return lod_two_fs_main(in, specular);\n");
}

#[test]
fn a_vertex_stage_that_computes_less_needs_no_struct_of_its_own() {
    // Nothing more is handed over, and one output less is computed.
    let shader = variant(LIT, &[], "return vec4f(in.normal, 1.0);");
    let text = LIT.replace(
        "return Varyings(clip, normal, uv)",
        "return Varyings(clip, normal, sqrt(uv) + sin(uv))",
    );
    let level = EmitLevel {
        shader,
        ..level(&source(&text), 1.0)
    };
    let text = spliced(&[level], &text, Form::Override);
    assert!(!text.contains("OfLevels"), "{text}");
    has(
        &text,
        "normal: vec3f, @location(2) uv: vec2f) -> Varyings {\n    if !(autoLOD >= 1.0) { return original_vs_main(position, normal, uv); }\n    return lod_one_vs_main(position, normal, uv);\n}",
    );
    has(
        &text,
        "    return Varyings(clip, normal, uv);\n}\n\nfn lod_one_fs_main",
    );
}

#[test]
fn a_bare_position_gets_a_struct_around_it() {
    let text = "fn tint() -> f32 { return 0.5; }
        @vertex fn vs_main(
            @builtin(vertex_index) index: u32,
            @location(0) original: vec4<f32>, // where
        ) -> @invariant @builtin(position) vec4<f32> { return original; }
        @fragment fn fs_main() -> @location(0) vec4<f32> { return vec4<f32>(tint()); }";
    let source = source(text);
    let shader = handing_over(&base(&source), &[("tint", VectorSize::Tri)]);
    let level = EmitLevel {
        shader: shader.expect("it has both stages"),
        ..level(&source, 1.0)
    };
    let text = spliced(&[level], text, Form::Override);
    has(
        &text,
        "struct VertexOfLevels {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) tint_2: vec3<f32>,
}

@vertex fn vs_main(
            @builtin(vertex_index) index: u32,
            @location(0) original: vec4<f32>, // where
        ) -> VertexOfLevels {
    if !(autoLOD >= 1.0) { return VertexOfLevels(original_vs_main(index, original), vec3<f32>()); }
    return lod_one_vs_main(index, original);
}

@fragment fn fs_main(@location(0) tint_2: vec3<f32>) -> @location(0) vec4<f32> {
    if !(autoLOD >= 1.0) { return original_fs_main(); }
    return lod_one_fs_main(tint_2);
}
",
    );
    has(
        &text,
        "fn lod_one_vs_main(index: u32, original: vec4<f32>) -> VertexOfLevels {\n    return VertexOfLevels(original, original.yxw);\n}",
    );
}

/// A shader whose vertex stage also hands over some components of the position under these names and at free locations,
/// which the fragment stage adds to its colour. `None` where it has no vertex stage, or returns no colour of floats.
fn handing_over(base: &Shader, named: &[(&str, VectorSize)]) -> Option<Shader> {
    let mut module = base.module().clone();
    let float = |size| TypeInner::Vector {
        size,
        scalar: Scalar::F32,
    };
    let mut types = Vec::new();
    for (_, size) in named {
        let inner = float(*size);
        types.push(
            module
                .types
                .insert(Type { name: None, inner }, Span::UNDEFINED),
        );
    }
    let four = float(VectorSize::Quad);
    let four = module.types.insert(
        Type {
            name: None,
            inner: four,
        },
        Span::UNDEFINED,
    );
    let taken = shared_locations(base, [], false) as u32;
    let free = (0..).filter(|location| {
        *location >= taken && base.module().types.iter().all(|(_, ty)| match &ty.inner {
            TypeInner::Struct { members, .. } => members.iter().all(|member| !matches!(member.binding, Some(Binding::Location { location: at, .. }) if at == *location)),
            _ => true,
        })
    });
    let bindings: Vec<Binding> = free
        .take(named.len())
        .map(|location| Binding::Location {
            location,
            interpolation: Some(Interpolation::Perspective),
            sampling: Some(Sampling::Center),
            blend_src: None,
            per_primitive: false,
        })
        .collect();

    let vertex = base.index(Stage::Vertex)?;
    let mut function = std::mem::take(&mut module.entry_points[vertex].function);
    let all = varyings::outputs(&module, &function);
    let result = function.result.clone()?;
    let Some(Statement::Return { value: Some(value) }) = function.body.last().cloned() else {
        return None;
    };
    let last = function.body.len() - 1;
    function.body.cull(last..);
    let add = |function: &mut naga::Function, expression| {
        let value = function.expressions.append(expression, Span::UNDEFINED);
        let range = naga::Range::new_from_bounds(value, value);
        function.body.push(Statement::Emit(range), Span::UNDEFINED);
        value
    };
    let mut members = Vec::new();
    let mut components = Vec::new();
    for (index, output) in (0..).zip(&all) {
        components.push(match output.member {
            Some(_) => add(
                &mut function,
                Expression::AccessIndex { base: value, index },
            ),
            None => value,
        });
        members.push((output.member.clone(), output.ty, output.binding.clone()));
    }
    let position = all
        .iter()
        .position(|output| matches!(output.binding, Binding::BuiltIn(BuiltIn::Position { .. })))?;
    for (at, (name, size)) in named.iter().enumerate() {
        use naga::SwizzleComponent as C;
        let vector = components[position];
        let pattern = [C::Y, C::X, C::W, C::Z];
        components.push(add(
            &mut function,
            Expression::Swizzle {
                size: *size,
                vector,
                pattern,
            },
        ));
        members.push((Some((*name).to_owned()), types[at], bindings[at].clone()));
    }
    let inner = TypeInner::Struct {
        members: (0..)
            .zip(members)
            .map(|(at, (name, ty, binding))| StructMember {
                name: name.or(Some("position".into())),
                ty,
                binding: Some(binding),
                offset: 64 * at,
            })
            .collect(),
        span: 64 * components.len() as u32,
    };
    let name = module.types[result.ty].name.clone();
    let ty = module.types.insert(Type { name, inner }, Span::UNDEFINED);
    let value = Some(add(&mut function, Expression::Compose { ty, components }));
    function
        .body
        .push(Statement::Return { value }, Span::UNDEFINED);
    function.result = Some(FunctionResult { ty, binding: None });
    let name = module.entry_points[vertex].name.clone();
    module.entry_points[vertex].function = function;

    let fragment = base.index(Stage::Fragment)?;
    let mut function = std::mem::take(&mut module.entry_points[fragment].function);
    let all = varyings::outputs(&module, &function);
    let colour = all
        .iter()
        .position(|output| output.ty == four && varyings::location(&output.binding) == Some(0))?;
    let Some(Statement::Return { value: Some(value) }) = function.body.last().cloned() else {
        return None;
    };
    let last = function.body.len() - 1;
    function.body.cull(last..);
    let mut components = Vec::new();
    for (index, output) in (0..).zip(&all) {
        components.push(match output.member {
            Some(_) => add(
                &mut function,
                Expression::AccessIndex { base: value, index },
            ),
            None => value,
        });
    }
    for (at, (name, _)) in named.iter().enumerate() {
        let index = function.arguments.len() as u32;
        function.arguments.push(FunctionArgument {
            name: Some((*name).to_owned()),
            ty: types[at],
            binding: Some(bindings[at].clone()),
        });
        let argument = function
            .expressions
            .append(Expression::FunctionArgument(index), Span::UNDEFINED);
        let x = add(
            &mut function,
            Expression::AccessIndex {
                base: argument,
                index: 0,
            },
        );
        let all = add(
            &mut function,
            Expression::Splat {
                size: VectorSize::Quad,
                value: x,
            },
        );
        let sum = Expression::Binary {
            op: BinaryOperator::Add,
            left: components[colour],
            right: all,
        };
        components[colour] = add(&mut function, sum);
    }
    let value = match all[colour].member {
        None => components[colour],
        Some(_) => {
            let ty = function.result.as_ref()?.ty;
            add(&mut function, Expression::Compose { ty, components })
        }
    };
    function
        .body
        .push(Statement::Return { value: Some(value) }, Span::UNDEFINED);
    module.entry_points[fragment].function = function;
    let fragment = module.entry_points[fragment].name.clone();
    let shader = lodc_passes::normalize(&module, Some(&name), &fragment, 100_000);
    let shader = shader.unwrap_or_else(|e| panic!("{e}"));
    shader.validate().unwrap_or_else(|e| panic!("{e:?}"));
    Some(shader)
}

/// Two levels that hand over more than the author's shader does, if it is one that can.
fn levels_of(source: &Source, base: &Shader) -> Option<Vec<EmitLevel>> {
    use VectorSize::{Bi, Quad, Tri};
    let first = handing_over(base, &[("shine", Tri), ("sqrt", Bi)])?;
    let second = handing_over(base, &[("sqrt", Bi), ("shine", Quad), ("tint", Tri)])?;
    let levels = [(1.0, first), (2.0, second)].map(|(autolod, shader)| EmitLevel {
        shader,
        ..level(source, autolod)
    });
    Some(levels.into())
}

#[test]
fn every_vertex_stage_is_emitted_in_every_form() {
    let mut seen = 0;
    for path in fixtures::complete() {
        let source = Source::read(&path).unwrap_or_else(|e| panic!("{e}"));
        let base = base(&source);
        let Some(levels) = levels_of(&source, &base) else {
            continue;
        };
        seen += 1;
        for form in [Form::Override, Form::Uniform, Form::Files] {
            // What is emitted is read back before it is returned.
            let files = emit(&source, &base, &levels, output(form, Target::Wgsl));
            let files = files.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            let text = String::from_utf8_lossy(&files[files.len() - 1].1);
            has(&text, "tint: vec3");
            for target in [Target::Spirv, Target::Glsl, Target::Hlsl, Target::Msl] {
                let files = emit(&source, &base, &levels, output(form, target));
                let refused = files.is_err_and(|e| !e.message.contains("override form"));
                assert!(!refused, "{} as {}", path.display(), target.name());
            }
        }
    }
    assert!(seen > 10, "{seen}");
}

#[cfg(feature = "search")]
mod pictures {
    //! Draws what was emitted: every level is its variant's picture, to the bit.

    use super::*;
    use crate::eval::draw::draw;
    use crate::eval::machine::{Bindings, Resource};
    use crate::eval::program::Program;
    use crate::eval::raster::Frame;
    use crate::scene::Scene;
    use lodc_passes::vertex_motion::VertexMotion;
    use lodc_passes::{Facts, Pass};
    use naga::{Module, ShaderStage};
    use rayon::prelude::*;
    use std::sync::Arc;

    /// What a host binds for a module that reads its level from a uniform.
    fn bound(bindings: &Bindings, module: &Module, autolod: f64) -> Bindings {
        let mut bindings = bindings.clone();
        let mut globals = module.global_variables.iter().map(|(_, global)| global);
        let level = globals.find(|global| {
            let name = global.name.as_deref().unwrap_or_default();
            name.starts_with("level_of_detail")
        });
        if let Some(at) = level.and_then(|global| global.binding) {
            let mut bytes = vec![0; 16];
            bytes[..4].copy_from_slice(&(autolod as f32).to_le_bytes());
            bindings.insert((at.group, at.binding), Resource::Buffer(Arc::new(bytes)));
        }
        bindings
    }

    /// The bits of a picture.
    fn picture(module: &Module, source: &Source, frame: &Frame) -> Option<Vec<u32>> {
        let program = |stage, name: &str| {
            let mut entries = module.entry_points.iter();
            let at = entries.position(|e| e.stage == stage && e.name == name)?;
            Program::compile(module, at, &[]).ok()
        };
        let vertex = program(ShaderStage::Vertex, source.vertex.as_deref()?)?;
        let fragment = program(ShaderStage::Fragment, &source.fragment)?;
        let (picture, _) = draw(&vertex, &fragment, frame);
        let all = picture.pixels.iter().flatten().chain(&picture.covered);
        Some(all.map(|x| x.to_bits()).collect())
    }

    /// Holds every form of a source's levels against the variants; whether it was drawn.
    fn drawn_alike(path: &str, source: &Source, levels: &[EmitLevel]) -> bool {
        let base = base(source);
        let scene = Scene::read(source, None).unwrap_or_else(|e| panic!("{path}: {e}"));
        let mut frame = scene.frames(scene.nearest).swap_remove(0);
        (frame.width, frame.height, frame.grid) = (48, 48, 1);
        let of_module = |module: &Module| picture(module, source, &frame);
        let Some(original) = of_module(&source.module) else {
            return false;
        };
        let variants = levels.iter().map(|level| of_module(level.shader.module()));
        let variants: Vec<_> = variants.collect::<Option<_>>().expect("variants are drawn");

        let files = emit(source, &base, levels, output(Form::Files, Target::Wgsl));
        let files = files.unwrap_or_else(|e| panic!("{path}: {e}"));
        for ((_, bytes), variant) in files.iter().skip(1).zip(&variants) {
            let text = String::from_utf8_lossy(bytes);
            let alone = read_back(&text, source).unwrap_or_else(|e| panic!("{path}: {e}"));
            assert!(
                of_module(&alone.module).as_ref() == Some(variant),
                "{path} alone\n{text}"
            );
        }
        let wanted = levels.iter().zip(&variants);
        let wanted = wanted.map(|(level, variant)| (f64::from(level.autolod), variant));
        let wanted: Vec<_> = std::iter::once((0.0, &original)).chain(wanted).collect();
        let whole = |form| {
            let files = emit(source, &base, levels, output(form, Target::Wgsl));
            let mut files = files.unwrap_or_else(|e| panic!("{path}: {e}"));
            String::from_utf8(files.swap_remove(0).1).expect("it is text")
        };
        let text = whole(Form::Uniform);
        if text.contains("level_of_detail") {
            let emitted = read_back(&text, source).unwrap_or_else(|e| panic!("{path}: {e}"));
            for (autolod, wanted) in &wanted {
                let frame = Frame {
                    bindings: bound(&frame.bindings, &emitted.module, *autolod),
                    ..frame.clone()
                };
                let drawn = picture(&emitted.module, source, &frame);
                let place = format!("{path} by a uniform of {autolod}");
                assert!(drawn.as_ref() == Some(wanted), "{place}\n{text}");
            }
        }
        let text = whole(Form::Override);
        if !text.contains("override autoLOD") {
            return true;
        }
        let emitted = read_back(&text, source).unwrap_or_else(|e| panic!("{path}: {e}"));
        for (autolod, wanted) in wanted {
            let constants = [("autoLOD".to_owned(), autolod)].into_iter().collect();
            let (module, _) = naga::back::pipeline_constants::process_overrides(
                &emitted.module,
                &emitted.info,
                None,
                &constants,
            )
            .unwrap_or_else(|e| panic!("{path}: {e}"));
            assert!(
                of_module(&module).as_ref() == Some(wanted),
                "{path} at {autolod}\n{text}"
            );
        }
        true
    }

    #[test]
    fn levels_of_two_stages_draw_their_variants() {
        assert!(drawn_alike("lit", &source(LIT), &levels_of_lit()));
        let paths = fixtures::complete();
        let drawn = paths.par_iter().filter(|path| {
            let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
            let levels = levels_of(&source, &base(&source));
            levels.is_some_and(|levels| drawn_alike(&path.to_string_lossy(), &source, &levels))
        });
        let drawn = drawn.count();
        assert!(drawn > 10, "{drawn}");
    }

    /// A text that hands over so many vectors beside a normal and coordinates, and computes two values to be moved.
    fn crowded(count: usize) -> String {
        let members: String = (0..count)
            .map(|at| format!("@location({at}) v{at}: vec4f,\n"))
            .collect();
        let zeros = "vec4f(), ".repeat(count);
        let read: String = (0..count).map(|at| format!(" + in.v{at}")).collect();
        format!(
            "struct Frame {{ view_proj: mat4x4f, model: mat4x4f, }}
             struct Varyings {{
                 @builtin(position) clip: vec4f,
                 {members}@location({count}) normal: vec3f,
                 @location({}) uv: vec2f,
             }}
             @group(0) @binding(0) var<uniform> frame: Frame;
             @vertex
             fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Varyings {{
                 let clip = frame.view_proj * frame.model * vec4f(position, 1.0);
                 return Varyings(clip, {zeros}normal, uv);
             }}
             @fragment
             fn fs_main(in: Varyings) -> @location(0) vec4f {{
                 let one = exp(-dot(in.normal, vec3f(0.48, 0.6, 0.64))) * in.uv.x;
                 let two = sin(in.normal * 3.0) * cos(in.uv.x * 4.0);
                 return vec4f(two * one + two.zxy, 1.0){read};
             }}",
            count + 1
        )
    }

    #[test]
    fn values_in_one_vector_are_drawn_as_by_themselves() {
        let mut pictures = Vec::new();
        for count in [13, 0] {
            let source = source(&crowded(count));
            let mut shader = base(&source);
            let mut levels = Vec::new();
            for (autolod, value) in [(1.0, "fs_main.one"), (2.0, "fs_main.two")] {
                let candidates = VertexMotion.candidates(&shader, &Facts::default());
                let mut of_value = candidates.iter().filter(|c| c.site.path() == value);
                shader = VertexMotion.apply(&shader, of_value.next().expect("there is room"));
                levels.push(EmitLevel {
                    shader: shader.clone(),
                    ..level(&source, autolod)
                });
            }
            let function = shader
                .function(lodc_passes::Stage::Fragment)
                .expect("it has one");
            assert_eq!(function.arguments.len(), if count > 0 { 2 } else { 3 });
            assert!(drawn_alike("crowded", &source, &levels[1..]));
            let scene = Scene::read(&source, None).unwrap_or_else(|e| panic!("{e}"));
            let mut frame = scene.frames(scene.nearest).swap_remove(0);
            (frame.width, frame.height, frame.grid) = (48, 48, 1);
            pictures.push(picture(shader.module(), &source, &frame).expect("it is drawn"));
        }
        assert_eq!(pictures[0], pictures[1]);
    }

    #[test]
    fn values_that_moved_to_the_vertices_are_drawn_as_their_variants() {
        let paths = fixtures::complete();
        let drawn = paths.par_iter().filter(|path| {
            let source = Source::read(path).unwrap_or_else(|e| panic!("{e}"));
            let mut shader = base(&source);
            let mut levels = Vec::new();
            for autolod in [1.0, 2.0, 3.0] {
                let candidates = VertexMotion.candidates(&shader, &Facts::default());
                let Some(candidate) = candidates.get(candidates.len() / 2) else {
                    break;
                };
                shader = VertexMotion.apply(&shader, candidate);
                levels.push(EmitLevel {
                    shader: shader.clone(),
                    ..level(&source, autolod)
                });
            }
            !levels.is_empty() && drawn_alike(&path.to_string_lossy(), &source, &levels)
        });
        let drawn = drawn.count();
        assert!(drawn > 10, "{drawn}");
    }
}
