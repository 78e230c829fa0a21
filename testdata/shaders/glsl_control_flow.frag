#version 450
// Cases that go on into the next one, loops that test at their end, parameters that are written.
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 colour;

const vec2 taps[2] = vec2[](vec2(1, 0), vec2(0, 1));

float bumped(inout float x) {
    x += 1.0;
    return x;
}

void main() {
    float weights[3] = float[](1., 2., 3.);
    float y = uv.x;
    colour = vec4(bumped(y), y, taps[1].x, weights[int(uv.y * 3.0)]);
    switch (int(uv.x * 5.0)) {
        case 0: colour.x = y * 0.5;
        case 1:
        case 2: colour.y = 0.25; break;
        case 3: { float half_ = y * 0.5; colour.z = half_ * half_; }
        default: colour.z += 0.125;
    }
    do {
        y += 1.0;
        if (y > 3.0) break;
    } while (y < 10.0);
    colour.w = y;
    if (any(isnan(uv)) || isinf(y)) discard;
    colour.xy += dFdx(uv) + fwidth(uv);
}
