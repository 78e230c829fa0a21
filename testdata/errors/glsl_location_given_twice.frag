#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 colour;

layout(location = 0) in vec3 normal;

void main() {
    colour = vec4(normal, uv.x);
}
