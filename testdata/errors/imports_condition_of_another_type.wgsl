#if QUALITY > 2
const STEPS = 8;
#endif
@fragment fn fs() -> @location(0) vec4f { return vec4f(f32(STEPS)); }
