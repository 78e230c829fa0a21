//! Times that are taken on a device. What they are depends on the machine: only what must hold on any is looked at.

use super::pictures::open;
use super::worker::worker;
use super::{INTERFACES, written};
use lodc::gpu::worker::{Failure, Variant};
use lodc::time::{Effort, Verdict};
use std::time::Duration;

/// A fragment stage that goes round a loop so many times.
fn rounds(count: u32) -> String {
    format!(
        "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {{
            var x = uv.x;
            for (var i = 0u; i < {count}u; i++) {{ x = fract(x * 1.7 + uv.y) + 0.1 * x * x; }}
            return vec4f(x, uv, 1.0);
        }}"
    )
}

fn variant(text: String) -> Variant {
    Variant {
        text: Some(text),
        auto_lod: None,
    }
}

const QUICK: Effort = Effort {
    rounds_at_least: 7,
    rounds_at_most: 15,
    half_width: 0.1,
    budget: Duration::from_millis(500),
};

#[test]
fn ten_times_the_work_takes_longer_and_the_same_does_not() {
    for interface in INTERFACES {
        if open(interface).is_none() {
            continue;
        }
        let subject = written(
            &format!("timed-{interface}"),
            &rounds(300),
            "object = \"plane\"",
        );
        let mut worker = worker(interface);
        let all = [
            Variant::default(),
            variant(rounds(3000)),
            variant("fn".to_owned()),
            variant(rounds(10)),
        ];
        let timed = worker.time(&subject, &all, 4.0, &QUICK);
        let timed = timed.unwrap_or_else(|failure| panic!("{failure:?}"));
        let [same, slow, broken, fast] = <[_; 4]>::try_from(timed).expect("as many as asked for");
        assert!(matches!(broken, Err(Failure::Refused(_))), "{broken:?}");
        let [same, slow, fast] = [same, slow, fast].map(|t| t.unwrap_or_else(|f| panic!("{f:?}")));
        for timing in [&same, &slow, &fast] {
            assert!(timing.ms > 0.0 && timing.compile_ms > 0.0, "{timing:?}");
            assert!(timing.low <= timing.ratio && timing.ratio <= timing.high);
            eprintln!("{interface}: {timing:?}");
        }
        assert_eq!(slow.verdict(), Verdict::Slower, "{slow:?}");
        assert!(fast.ratio < 1.0, "{fast:?}");
    }
}
