#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 colour;

void main() {
    colour = vec4(vec3(uv, 1.0) * vec2(1.0), 1.0);
}
