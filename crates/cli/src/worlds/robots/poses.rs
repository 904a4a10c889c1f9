//! Where every body is.

use super::Said;
use serde_json::{Value, json};
use sidestep::worlds::robots::simulation::{HEADING_NAMES, RobotsSimulation};
use sidestep::worlds::robots::state::BodyRecord;

/// Every body by entity id.
pub(super) fn said(simulation: &RobotsSimulation) -> Said {
    let snapshot = simulation.snapshot();
    let bodies: Vec<Body<'_>> = snapshot
        .bodies
        .iter()
        .enumerate()
        .map(|(id, record)| Body { simulation, id: id as u32, record })
        .collect();
    let heading = "  body  kind        col_boxes  row_boxes  heading\n".to_string();
    let text = bodies.iter().fold(heading, |text, body| text + &body.row());
    Said { json: bodies.iter().map(Body::json).collect(), text }
}

struct Body<'a> {
    simulation: &'a RobotsSimulation,
    id: u32,
    record: &'a BodyRecord,
}

impl Body<'_> {
    fn kind(&self) -> &str {
        let world = self.simulation.world();
        &world.kinds[usize::from(world.type_of(self.id).kind)]
    }

    fn is_door(&self) -> bool {
        let world = self.simulation.world();
        world.is_door(self.id)
    }

    fn heading(&self) -> &'static str {
        HEADING_NAMES[usize::from(self.record.facing % 4)]
    }

    fn json(&self) -> Value {
        let (col, row) = self.record.at;
        let place = json!({
            "body": self.id, "kind": self.kind(), "col_boxes": col, "row_boxes": row,
        });
        let Value::Object(mut place) = place else { return place };
        match self.is_door() {
            true => place.insert("open".into(), (self.record.facing == 1).into()),
            false => place.insert("heading".into(), self.heading().into()),
        };
        Value::Object(place)
    }

    fn row(&self) -> String {
        let (col, row) = self.record.at;
        let look = match (self.is_door(), self.record.facing) {
            (true, 1) => "open",
            (true, _) => "closed",
            (false, _) => self.heading(),
        };
        format!("  {:<4}  {:<10}  {col:>9}  {row:>9}  {look}\n", self.id, self.kind())
    }
}
