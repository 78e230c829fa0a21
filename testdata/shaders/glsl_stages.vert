#version 450
// The vertex stage of the fragment shader beside it: a block that both read, a flat output, a loop.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;

layout(set = 0, binding = 0) uniform Camera {
    mat4 view_proj;
    vec3 eye;
} camera;

layout(location = 0) out vec3 facing;
layout(location = 1) out vec2 surface;
layout(location = 2) flat out int side;

float wave(float x) {
    float sum = 0.0;
    for (int i = 1; i < 4; i++) {
        sum += sin(x * float(i)) / float(i);
    }
    return sum;
}

void main() {
    vec3 place = position + normal * (0.02 * wave(uv.x * 12.0));
    facing = normal;
    surface = uv;
    side = normal.x > 0.0 ? 1 : 2;
    gl_Position = camera.view_proj * vec4(place, 1.0);
}
