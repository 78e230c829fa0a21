// Integers and truth values are no sites; only what becomes a float of them is.
// expect: 1 candidates
@fragment
fn fs_main(@location(0) @interpolate(flat) cell: vec2u) -> @location(0) vec4f {
    let hash = (cell.x * 1664525u) ^ (cell.y >> 3u);
    let is_odd = (hash & 1u) == 1u && cell.x > 2u;
    if is_odd { discard; }
    return vec4f(0.0, 0.0, 1.0, 1.0);
}
