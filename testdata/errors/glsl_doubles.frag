#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 colour;

void main() {
    double d = 1.0lf;
    colour = vec4(float(d));
}
