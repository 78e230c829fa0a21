// Names that writers like to change: digits at the end, doubled underscores, words of other languages.
struct Mat1 {
    rough1: f32,
    rough_1: f32,
    tint__x: vec3f,
    float4: f32,
    sample_: f32,
    main: f32,
}

@group(0) @binding(0) var<uniform> mat_1: Mat1;
@group(0) @binding(1) var<uniform> mat1: vec4f;

const e1 = 0.5;
const _e2 = 0.25;
var<private> input2: f32;

fn f1(a0: f32, a_0: f32, a__0: f32) -> f32 {
    let _e3 = a0 * e1;
    let _e3_ = a_0 * _e2;
    var local = a__0;
    local += _e3;
    return local + _e3_;
}

fn f_1(double: vec2f) -> vec2f {
    let double2 = double * 0.5;
    return double2 + double;
}

fn größe(höhe: f32) -> f32 {
    return höhe * 0.5;
}

@fragment
fn fs1(@location(0) uv0: vec2f) -> @location(0) vec4f {
    input2 = mat_1.rough1 * uv0.x;
    let uv1 = f_1(uv0);
    let uv_1 = f_1(uv1) * mat_1.float4;
    let vec4f_ = vec4f(uv_1, mat_1.tint__x.xy);
    let texture2D = f1(uv1.x, uv_1.y, input2) + mat_1.sample_;
    let half3 = vec3f(texture2D, größe(mat_1.rough_1), mat_1.main) * mat_1.tint__x;
    return vec4f(half3 + mat1.rgb * vec4f_.x, mat1.a);
}
