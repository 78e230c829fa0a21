@fragment
fn fs_main(@builtin(position) at: vec4f) -> @builtin(frag_depth) f32 {
    return at.z * 0.5;
}
