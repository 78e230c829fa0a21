struct Layer { colour: vec3f, weights: array<f32, 2> }

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var layers: array<Layer, 2>;
    layers[0].colour = vec3f(uv, 0.5);
    layers[0].weights[1] = uv.x;
    layers[1] = layers[0];
    layers[1].colour.z = uv.y;
    if uv.x > uv.y {
        layers[1].weights[0] = sin(uv.x);
    }
    let top = layers[1];
    return vec4f(top.colour * top.weights[0], top.weights[1]);
}
