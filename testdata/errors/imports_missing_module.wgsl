#import lib::{
    lihgts::lambert,
}
@fragment fn fs() -> @location(0) vec4f { return vec4f(lambert(vec3f(1.0)), 1.0); }
