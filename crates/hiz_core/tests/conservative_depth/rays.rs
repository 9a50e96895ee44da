//! Random meshes: no ray through a pixel gets past its depth.

use hiz_core::testing::PlantedFault;
use hiz_core::{ConservativeDepthOptions, FaceCull};

use crate::common::Random;
use crate::{KINDS, Tally, Way, examine, viewed};

pub(crate) fn campaign(way: Way, seed: u64, cases: u32, fault: Option<PlantedFault>) -> Vec<Tally> {
    let mut random = Random(seed);
    let mut tallies = vec![Tally::default(); KINDS.len()];
    for case in 0..cases {
        let kind = case as usize % KINDS.len();
        let mesh = KINDS[kind](&mut random);
        let (camera, mesh) = viewed(&mut random, &mesh);
        let cull_mode =
            random.pick(&[FaceCull::None, FaceCull::None, FaceCull::Back, FaceCull::Front]);
        let options = ConservativeDepthOptions { refinement: random.below(4) };
        examine(&mut random, (way, fault), &camera, &mesh, cull_mode, &options, &mut tallies[kind]);
    }
    tallies
}

#[test]
fn no_ray_gets_past_a_pixels_depth() {
    let ways = [(Way::Usual, 1500), (Way::AnyCentres, 1500), (Way::Search, 500)];
    for (way, cases) in ways {
        no_ray_gets_past(way, cases);
    }
}

fn no_ray_gets_past(way: Way, cases: u32) {
    let tallies = campaign(way, 1, cases, None);
    for (name, tally) in ["tangle", "soup", "boxes", "terrain", "planks"].iter().zip(&tallies) {
        println!("{way:?}, {name}: {tally:?}");
        assert_eq!(tally.past, 0, "{way:?}, {name}");
        assert!(
            tally.deep > cases / 8 && tally.rays > 2 * cases,
            "a test without depths proves nothing: {way:?}, {name} {tally:?}"
        );
    }
}

#[test]
#[ignore = "minutes: make soak"]
fn no_ray_gets_past_a_pixels_depth_in_many_cases() {
    for seed in 100..140 {
        let way = [Way::Usual, Way::AnyCentres][seed as usize % 2];
        let tallies = campaign(way, seed, 2500, None);
        println!("seed {seed}: {:?}", tallies.iter().map(|t| t.rays).sum::<u32>());
        assert!(tallies.iter().all(|t| t.past == 0), "seed {seed}: {tallies:?}");
    }
}
