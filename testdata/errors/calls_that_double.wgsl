fn double_a(x: f32) -> f32 { return x * 1.5; }
fn double_b(x: f32) -> f32 { return double_a(x) + double_a(x + 1.0); }
fn double_c(x: f32) -> f32 { return double_b(x) + double_b(x + 1.0); }
fn double_d(x: f32) -> f32 { return double_c(x) + double_c(x + 1.0); }
fn double_e(x: f32) -> f32 { return double_d(x) + double_d(x + 1.0); }
fn double_f(x: f32) -> f32 { return double_e(x) + double_e(x + 1.0); }
fn double_g(x: f32) -> f32 { return double_f(x) + double_f(x + 1.0); }
fn double_h(x: f32) -> f32 { return double_g(x) + double_g(x + 1.0); }
fn double_i(x: f32) -> f32 { return double_h(x) + double_h(x + 1.0); }
fn double_j(x: f32) -> f32 { return double_i(x) + double_i(x + 1.0); }
fn double_k(x: f32) -> f32 { return double_j(x) + double_j(x + 1.0); }
fn double_l(x: f32) -> f32 { return double_k(x) + double_k(x + 1.0); }
fn double_m(x: f32) -> f32 { return double_l(x) + double_l(x + 1.0); }
fn double_n(x: f32) -> f32 { return double_m(x) + double_m(x + 1.0); }
fn double_o(x: f32) -> f32 { return double_n(x) + double_n(x + 1.0); }
fn double_p(x: f32) -> f32 { return double_o(x) + double_o(x + 1.0); }
fn double_q(x: f32) -> f32 { return double_p(x) + double_p(x + 1.0); }
fn double_r(x: f32) -> f32 { return double_q(x) + double_q(x + 1.0); }
fn double_s(x: f32) -> f32 { return double_r(x) + double_r(x + 1.0); }
fn double_t(x: f32) -> f32 { return double_s(x) + double_s(x + 1.0); }
fn double_u(x: f32) -> f32 { return double_t(x) + double_t(x + 1.0); }
fn double_v(x: f32) -> f32 { return double_u(x) + double_u(x + 1.0); }
fn double_w(x: f32) -> f32 { return double_v(x) + double_v(x + 1.0); }
fn double_x(x: f32) -> f32 { return double_w(x) + double_w(x + 1.0); }
fn double_y(x: f32) -> f32 { return double_x(x) + double_x(x + 1.0); }
fn double_z(x: f32) -> f32 { return double_y(x) + double_y(x + 1.0); }

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    return vec4f(double_z(uv.x));
}
