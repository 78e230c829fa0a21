#define_import_path lib::left
#import lib::right
fn left() -> f32 { return right::right(); }
