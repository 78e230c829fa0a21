#import lib::sum
@fragment fn fs() -> @location(0) vec4f { var l: array<lib::lights::Light, 3>; return vec4f(sum::all(vec3f(1.0), l), 1.0); }
