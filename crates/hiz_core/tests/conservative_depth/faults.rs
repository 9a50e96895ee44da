//! Planted faults of the search and of the proof let rays through.

use hiz_core::testing::PlantedFault;

use crate::borders::{
    borders, closed_from_behind, cut_borders, facing_walls, rounded_thresholds, slanted_borders,
    walls_at_the_near_plane,
};
use crate::rays::campaign;
use crate::{Tally, Way};

#[test]
fn planted_faults_of_the_search_let_rays_through() {
    let way = Way::Search;
    let past = |tallies: &[Tally]| tallies.iter().map(|t| t.past).sum::<u32>();
    let with = |fault| past(&campaign(way, 1, 150, Some(fault)));
    let contours = with(PlantedFault::ContoursIgnored);
    let centre = with(PlantedFault::DepthAtCentre);
    let folds = with(PlantedFault::FoldsIgnored);
    let nearest = with(PlantedFault::RoundedToNearest);
    let exact = borders(way, 2, 300, Some(PlantedFault::NoWidening)).past;
    for (name, past) in [
        ("before the near plane", with(PlantedFault::BeforeNear)),
        ("a cut's side joined", past(&campaign(way, 1, 1000, Some(PlantedFault::CutSidesJoined)))),
        (
            "points at the near plane unproved",
            walls_at_the_near_plane(way, 9, Some(PlantedFault::NearPointsUnproved)).past,
        ),
        ("exact depths", facing_walls(way, 3, Some(PlantedFault::DepthsExact)).past),
        (
            "exact depths of corners",
            facing_walls(way, 3, Some(PlantedFault::CornerDepthsExact)).past,
        ),
        ("exact cuts", cut_borders(way, 4, Some(PlantedFault::CutPointsExact)).past),
        ("facing unproved", closed_from_behind(way, 5, Some(PlantedFault::FacingUnproved)).past),
    ] {
        println!("{name}: {past} rays past");
        assert!(past > 0, "{name}: stayed green");
    }
    println!(
        "rays past a pixel's depth: contours ignored {contours}, depth at the centre {centre}, \
         folds ignored {folds}, rounded to nearest {nearest}, no widening {exact}"
    );
    assert!(contours > 100 && centre > 100 && exact > 10, "{contours} {centre} {exact}");
    assert!(folds > 10 && nearest > 10, "{folds} {nearest}");
}

/// Pixels that no threshold proves are searched with facets in integers.
#[test]
fn planted_faults_of_the_search_in_integers_let_rays_through() {
    for fault in [
        PlantedFault::ContoursIgnored,
        PlantedFault::DepthAtCentre,
        PlantedFault::FoldsIgnored,
        PlantedFault::CentreForQuarter,
    ] {
        let of = |way| campaign(way, 1, 600, Some(fault)).iter().map(|t| t.past).sum::<u32>();
        let (usual, any) = (of(Way::Usual), of(Way::AnyCentres));
        println!("{fault:?}: {usual} and {any} rays past a pixel's depth");
        assert!(usual > 0 && any > 0, "{fault:?}: stayed green");
    }
}

#[test]
fn planted_faults_of_the_proof_let_rays_through() {
    for fault in [
        PlantedFault::BordersIgnored,
        PlantedFault::PlaneWithoutReach,
        PlantedFault::FoldsCancel,
        PlantedFault::RoundedToNearest,
        PlantedFault::BeforeNear,
        PlantedFault::VerticesInFloat32,
        PlantedFault::LeftOutNeighboursIgnored,
        PlantedFault::CentreForSquare,
        PlantedFault::BoxesTooSmall,
    ] {
        let of = |way| campaign(way, 1, 600, Some(fault)).iter().map(|t| t.past).sum::<u32>();
        let (usual, any) = (of(Way::Usual), of(Way::AnyCentres));
        println!("{fault:?}: {usual} and {any} rays past a pixel's depth");
        assert!(usual > 0 && any > 0, "{fault:?}: stayed green");
    }
    let slanted = |fault| slanted_borders(6, 1500, fault);
    let (sound, faulty) = (slanted(None), slanted(Some(PlantedFault::NoEdgeMargin)).past);
    println!("no edge margin: {faulty} rays past a pixel's depth; without the fault {sound:?}");
    assert!(faulty > 0 && sound.past == 0 && sound.deep > 100, "no edge margin");
    let rounded = |fault| rounded_thresholds(7, 200, fault);
    let (sound, faulty) = (rounded(None), rounded(Some(PlantedFault::MembershipInFloat32)).past);
    println!("membership in float32: {faulty} rays past a pixel's depth; without {sound:?}");
    assert!(faulty > 0 && sound.past == 0 && sound.deep > 10, "membership in float32");
}
