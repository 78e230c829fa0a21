// A vertex stage without inputs: a triangle over the screen, from the index of the vertex and a table.
struct Screen {
    @builtin(position) clip: vec4f,
    @location(0) at: vec2f,
}

const CORNERS = array<vec2f, 3>(vec2f(-1.0, -1.0), vec2f(3.0, -1.0), vec2f(-1.0, 3.0));

@vertex
fn vs_main(@builtin(vertex_index) index: u32) -> Screen {
    let corner = CORNERS[index % 3u];
    return Screen(vec4f(corner, 0.5, 1.0), corner * vec2f(0.5, -0.5) + 0.5);
}

@fragment
fn fs_main(screen: Screen) -> @location(0) vec4f {
    let ring = abs(length(screen.at - 0.5) - 0.3);
    return vec4f(smoothstep(0.05, 0.0, ring), screen.at, 1.0);
}
