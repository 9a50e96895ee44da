//! Measures the time of uploads and updates by the number of instances.
//!
//! ```text
//! cargo run --release --example upload -- 10000000
//! ```
//!
//! The argument is the largest number of instances, by default a million.
//! Positions are random, which is the worst case for the sort.

use std::time::Instant;

use hiz_core::headless::Engine;
use hiz_core::{Bounds, Floats, InstanceOptions, StoredOrder};

/// Marsaglia's xorshift.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }
}

fn median_ms(rounds: usize, mut work: impl FnMut()) -> f64 {
    let mut times: Vec<_> = (0..rounds)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[rounds / 2]
}

/// The memory of this process in MiB: resident now, and at most so far.
/// Both are 0 on systems other than Linux.
fn memory() -> [u64; 2] {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    ["VmRSS:", "VmHWM:"].map(|name| {
        let line = status.lines().find_map(|line| line.strip_prefix(name));
        line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) / 1024
    })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let engine = Engine::new(None)?;
    println!("{}", engine.adapter());
    let largest: usize = std::env::args().nth(1).map_or(Ok(1_000_000), |n| n.parse())?;
    println!(
        "instances  kind    morton ms  given ms  update all ms  update 1000 ms  device MiB  \
         host MiB  resident/peak MiB"
    );
    let powers = (3..).map(|p| 10_usize.pow(p)).take_while(|n| *n < largest);
    for n in powers.chain([largest]) {
        let mut random = Random(7);
        let min: Vec<f32> = (0..3 * n).map(|_| 1000.0 * random.unit()).collect();
        let max: Vec<f32> = min.iter().map(|v| v + random.unit()).collect();
        let radii = vec![0.5_f32; n];
        let (min, max, radii) = (Floats::F32(&min), Floats::F32(&max), Floats::F32(&radii));
        let few = n.min(1000);
        let part = |floats, width: usize| match floats {
            Floats::F32(v) => Floats::F32(&v[..width * few]),
            Floats::F64(v) => Floats::F64(&v[..width * few]),
        };
        for (name, bounds, some) in [
            (
                "sphere",
                Bounds::Spheres { centers: min, radii },
                Bounds::Spheres { centers: part(min, 3), radii: part(radii, 1) },
            ),
            (
                "box",
                Bounds::Boxes { min, max },
                Bounds::Boxes { min: part(min, 3), max: part(max, 3) },
            ),
        ] {
            let rounds = if n > 10_000_000 { 1 } else { 7 };
            let upload = |order| -> Result<f64, hiz_core::Error> {
                let options = InstanceOptions { order, ..InstanceOptions::default() };
                engine.instances(&bounds, &options)?;
                Ok(median_ms(rounds, || {
                    engine.instances(&bounds, &options).expect("as before");
                    engine.wait().expect("as before");
                }))
            };
            let (morton, given) = (upload(StoredOrder::Morton)?, upload(StoredOrder::Given)?);
            let instances = engine.instances(&bounds, &InstanceOptions::default())?;
            let update = |bounds: &Bounds<'_>| {
                median_ms(rounds, || {
                    engine.update(&instances, 0, bounds, false).expect("an update");
                    engine.wait().expect("an update");
                })
            };
            update(&some);
            let (all, some) = (update(&bounds), update(&some));
            let (device, host) = (instances.device_bytes() >> 20, instances.host_bytes() >> 20);
            let [resident, peak] = memory();
            println!(
                "{n:>9}  {name:<6} {morton:>10.2} {given:>9.2} {all:>14.2} {some:>15.2} \
                 {device:>11} {host:>9}  {resident}/{peak}"
            );
        }
    }
    Ok(())
}
