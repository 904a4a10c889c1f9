//! What several tables say of their columns and of all of their rows.

use super::world::RobotsWorld;
use sidestep_kernel::EntityId;
use sidestep_kernel::view::Isometry2;

pub(super) const CYCLE_DESCRIPTION: &str = "cycle, counted from 0";

/// Returns the notes that turn boxes into meters of the world, and ids into kinds of bodies.
pub(super) fn box_notes(world: &RobotsWorld) -> Vec<(String, String)> {
    let Isometry2 { origin_m: [x, y], yaw_rad } = world.map.plane;
    let box_m = world.map.box_size_m;
    let numbers = [("box_m", box_m), ("origin_x_m", x), ("origin_y_m", y), ("yaw_rad", yaw_rad)];
    let mut about: Vec<_> = numbers.map(|(name, v)| (name.into(), v.to_string())).into();
    let ids: Vec<EntityId> = (0..world.bodies.len() as EntityId).collect();
    // Bodies of one kind have ids in a row.
    for same in ids.chunk_by(|&a, &b| world.visible_kind(a) == world.visible_kind(b)) {
        if let (Some(first), Some(last)) = (same.first(), same.last()) {
            let kind = world.visible_kind(*first);
            about.push((format!("ids_{kind}"), format!("{first}-{last}")));
        }
    }
    about
}
