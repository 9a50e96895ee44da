//! Masks of culls in groups: they begin full where few groups are hidden, and empty elsewhere.
//! Expectations come from the fates.

use super::*;

/// Mostly one fate; one of `rare` groups is of another or mixed, and some members are absent.
fn mostly(fate: Fate, count: usize, rare: u32, absent: bool) -> Vec<Fate> {
    let mut random = Random(count as u64 + u64::from(rare));
    let mut fates = vec![fate; count];
    for group in fates.chunks_mut(GROUP) {
        if rare > 0 && random.below(rare) == 0 {
            let one = random.pick(&[None, Some(Front), Some(Behind), Some(Outside), Some(Aside)]);
            for member in group.iter_mut() {
                *member = one.unwrap_or(random.pick(&[Front, Behind, Outside, Invalid]));
            }
        }
        if absent && random.below(2) == 0 {
            let place = random.below(group.len() as u32) as usize;
            group[place] = Absent;
        }
    }
    fates
}

/// How many bits and listed indices differ from the fates, of what is asked for.
fn wrong_bits(world: &World, tiers: u32, outputs: &Outputs, asked: Option<&[bool]>) -> usize {
    let World { engine, instances, camera, pyramid, fates, .. } = world;
    let among = asked.map(|asked| engine.among(instances, &AmongSource::Mask(asked)).unwrap());
    let extras = CullExtras { among: among.as_ref(), ..CullExtras::default() };
    let options = World::options(tiers);
    let culling =
        engine.cull_given(instances, camera, pyramid, &options, outputs, &extras).unwrap();
    let kept: Vec<bool> = (0..fates.len())
        .map(|i| fates[i].verdict(world.both).is_kept() && asked.is_none_or(|asked| asked[i]))
        .collect();
    let mut wrong = 0;
    if outputs.mask {
        let mask = culling.mask().unwrap();
        wrong += kept.iter().zip(&mask).filter(|(a, b)| a != b).count();
    }
    if outputs.indices {
        let expected = (0..).zip(&kept).filter(|(_, kept)| **kept).map(|(i, _)| i);
        wrong += usize::from(!culling.indices().unwrap().into_iter().eq(expected));
    }
    wrong
}

/// Every size, mostly of what is kept and mostly of what is culled, with the first `ways` of
/// outputs.
fn check_masks(engine: &Arc<Engine>, sizes: &[usize], ways: usize) -> usize {
    let mask = Outputs { mask: true, ..Outputs::NONE };
    let list = Outputs { indices: true, ..Outputs::NONE };
    let told = Outputs { verdicts: true, ..mask.clone() };
    let mut wrong = 0;
    for (i, (count, fate, rare)) in sizes
        .iter()
        .flat_map(|n| [(*n, Front), (*n, Behind)])
        .flat_map(|(n, fate)| [0, 4].map(|rare| (n, fate, rare)))
        .enumerate()
    {
        let fates = mostly(fate, count, rare, i % 3 > 0);
        let asked: Vec<bool> = (0..count).map(|place| place % 5 > 0).collect();
        let both = i % 8 != 5;
        let stored = (StoredOrder::Given, both);
        let world = World::new(Arc::clone(engine), fates, None, stored);
        for (tiers, outputs) in [(1, &list), (2, &mask), (1, &told)].into_iter().take(ways) {
            for asked in [None, Some(&asked[..])] {
                wrong += wrong_bits(&world, tiers, outputs, asked);
            }
        }
    }
    wrong
}

/// Buffers that are used again, as the wall comes and goes.
fn check_frames(engine: &Arc<Engine>) -> usize {
    let fates = mostly(Front, 8300, 12, true);
    let world = World::new(Arc::clone(engine), fates, None, (StoredOrder::Morton, true));
    let World { engine, camera, pyramid, instances, fates, .. } = &world;
    let open = levels(engine, &[0.0; 64 * 64], camera, true);
    let outputs = Outputs { mask: true, ..Outputs::NONE };
    let visible = engine.context().create_visible(instances, &outputs).unwrap();
    let mut wrong = 0;
    for (frame, tiers) in [1, 1, 2, 2, 1, 2, 0, 1].into_iter().enumerate() {
        let is_open = frame % 2 == 0;
        let pyramid = if is_open { &open } else { pyramid };
        let mut encoder = engine.device().create_command_encoder(&Default::default());
        let options = World::options(tiers);
        engine
            .context()
            .record_cull(&mut encoder, instances, camera, pyramid, &visible, &options)
            .unwrap();
        engine.queue().submit([encoder.finish()]);
        let words = read(engine, visible.mask(0).unwrap());
        for (i, fate) in fates.iter().enumerate() {
            let kept = matches!(fate, Front | Invalid) || (is_open && *fate == Behind);
            wrong += usize::from((words[i / 32] >> (i % 32) & 1 == 1) != kept);
        }
    }
    wrong
}

#[test]
fn masks_are_right_however_they_begin() {
    assert_eq!(check_masks(&engine(), &[1, 31, 33, 64, 65, 4097], 3), 0);
    assert_eq!(check_frames(&engine()), 0);
}

#[test]
fn faults_of_masks_are_seen() {
    for (what, by) in [
        // Bits behind the last instance.
        ("let left = piece.count - word * WORD_BITS;", "let left = WORD_BITS;"),
        ("min(begin + WORDS_OF_INVOCATION, piece.words)", "min(begin + 1u, piece.words)"),
        // A full mask where all members of accepted groups count as kept.
        ("(LOOKS_AT_ACCEPTED && survivors.accept_count > 0u)", "false"),
        // Members that are kept, flipped in a full mask.
        ("there(first) & ~kept, parents.is_full != 0u", "kept, parents.is_full != 0u"),
        ("there(first) & ~kept, parents.is_full != 0u", "there(first) & ~kept, false"),
        // Hidden groups that are not cleared, and tested ones that are.
        (
            "} else if verdict < VISIBLE {\n        report_run",
            "} else if false {\n        report_run",
        ),
        ("(!FLIPS || verdict < VISIBLE)", "true"),
        // The groups of the wrong end of the list.
        ("survivor_position(groups - 1u - slot)", "survivor_position(slot)"),
    ] {
        let engine = faulty(&[(what, by)]);
        let wrong = check_masks(&engine, &[65, 4097], 1) + check_frames(&engine);
        eprintln!("{what} -> {by}: {wrong}");
        assert!(wrong > 0, "{what} -> {by}");
    }
}
