#version 450
layout(location = 0) in vec3 facing;
layout(location = 1) in vec2 surface;
layout(location = 2) flat in int side;
layout(location = 0) out vec4 colour;

layout(set = 0, binding = 0) uniform Camera {
    mat4 view_proj;
    vec3 eye;
} camera;

void main() {
    float lit = max(dot(normalize(facing), normalize(camera.eye)), 0.0);
    vec3 tint = side == 1 ? vec3(0.8, 0.5, 0.3) : vec3(0.3, 0.5, 0.8);
    colour = vec4(tint * lit + 0.1 * surface.xyx, 1.0);
}
