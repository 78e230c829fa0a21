@group(0) @binding(0) var<uniform> tint: vec4f;
@group(0) @binding(0) var<uniform> gloss: vec4f;

@fragment
fn fs_main() -> @location(0) vec4f {
    return tint * gloss;
}
