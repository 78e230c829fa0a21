const a = b + 1.0;
const b = a * 0.5;

@fragment
fn fs_main() -> @location(0) vec4f {
    return vec4f(a);
}
