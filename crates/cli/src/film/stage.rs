//! Bodies of a frame as figures of a film.

use sidestep::kernel::view::{
    Body, Condition, Floor, Frame, Kind, Occupancy, Place, Pose, Scenery, Shape,
};
use sidestep_draw::{Camera, DrawError, Figure, Form, Stage};

/// Colors by which numbered bodies are told apart: Okabe and Ito's, without yellow and black.
pub(super) const COLORS: [[u8; 3]; 6] = [
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xE6, 0x9F, 0x00],
    [0x56, 0xB4, 0xE9],
];
pub(super) const WALL: [u8; 3] = [0x40, 0x40, 0x40];
pub(super) const UNKNOWN: [u8; 3] = [0xC8, 0xC8, 0xC8];
pub(super) const OBSTACLE: [u8; 3] = [0x80, 0x80, 0x80];
pub(super) const DOOR: [u8; 3] = [0x8B, 0x5A, 0x2B];
pub(super) const PERSON: [u8; 3] = [0x20, 0x20, 0x20];
pub(super) const ALERT: [u8; 3] = [0xE0, 0x10, 0x10];
pub(super) const INK: [u8; 3] = [0xFF, 0xFF, 0xFF];

/// Corners of a circle.
const CORNERS: usize = 32;
/// Air around what is shown, compared with its size.
const MARGIN: f64 = 0.05;

/// The rectangle that all frames stay in, and what never moves in it. A floor is shown whole;
/// without one, wherever agents come to be.
///
/// # Errors
/// When there is nothing to show.
pub(super) fn stage(
    scenery: &Scenery,
    frames: &[Frame],
    width_px: u32,
) -> Result<Stage, DrawError> {
    let camera = camera(scenery);
    let mut bounds = Bounds::nothing();
    if let Some(floor) = &scenery.floor {
        let [x, y] = floor.origin_m;
        bounds.hold([x, y]);
        bounds.hold([
            x + f64::from(floor.width) * floor.box_m,
            y + f64::from(floor.height) * floor.box_m,
        ]);
    } else {
        for body in frames.iter().flat_map(|frame| &frame.bodies) {
            if body.kind != Kind::Obstacle {
                bounds.hold_body(camera, body);
            }
        }
        bounds.grow();
    }
    let still: Vec<Figure> = scenery
        .floor
        .iter()
        .flat_map(boxes)
        .chain(scenery.bodies.iter().flat_map(figures))
        .collect();
    Stage::new(camera, [bounds.lo, bounds.hi], width_px, &still)
}

fn camera(scenery: &Scenery) -> Camera {
    if scenery.dimensions == 2 { Camera::ABOVE } else { Camera::CORNER }
}

/// A rectangle that grows.
struct Bounds {
    lo: [f64; 2],
    hi: [f64; 2],
}

impl Bounds {
    fn nothing() -> Self {
        Self { lo: [f64::INFINITY; 2], hi: [f64::NEG_INFINITY; 2] }
    }

    fn hold(&mut self, at: [f64; 2]) {
        for (i, x) in at.into_iter().enumerate().filter(|(_, x)| x.is_finite()) {
            self.lo[i] = self.lo[i].min(x);
            self.hi[i] = self.hi[i].max(x);
        }
    }

    fn hold_body(&mut self, camera: Camera, body: &Body) {
        let extent_m = match &body.shape {
            Shape::Line { points_m, .. } => {
                return points_m.iter().for_each(|&p| self.hold(camera.seen(p)));
            }
            Shape::Cuboid { size_m: [x, y, _] } => 0.5 * x.max(*y),
            Shape::Cylinder { radius_m, .. } | Shape::Sphere { radius_m } => *radius_m,
            Shape::Dart { length_m, .. } => 0.5 * length_m,
        };
        let [x, y] = camera.seen(body.pose.at_m);
        self.hold([x - extent_m, y - extent_m]);
        self.hold([x + extent_m, y + extent_m]);
    }

    /// Air on all sides, and no side that is hardly there beside the other.
    fn grow(&mut self) {
        if self.lo[0] > self.hi[0] {
            (self.lo, self.hi) = ([0.0; 2], [1.0; 2]);
        }
        let longest_m = (self.hi[0] - self.lo[0]).max(self.hi[1] - self.lo[1]).max(1e-3);
        for i in 0..2 {
            let wanting_m = (0.3 * longest_m - (self.hi[i] - self.lo[i])).max(0.0);
            self.lo[i] -= MARGIN * longest_m + 0.5 * wanting_m;
            self.hi[i] += MARGIN * longest_m + 0.5 * wanting_m;
        }
    }
}

/// Boxes of the floor that are not free, a row's neighbors together.
fn boxes(floor: &Floor) -> Vec<Figure> {
    let mut figures = Vec::new();
    for (row, boxes) in floor.boxes.chunks(floor.width.max(1) as usize).enumerate() {
        let mut col = 0;
        for run in boxes.chunk_by(|a, b| a == b) {
            let color = match run[0] {
                Occupancy::Free => None,
                Occupancy::Wall => Some(WALL),
                Occupancy::Unknown => Some(UNKNOWN),
            };
            let at = |col: usize, row: usize| -> Place {
                let [x, y] = floor.origin_m;
                [x + col as f64 * floor.box_m, y + row as f64 * floor.box_m, 0.0]
            };
            let end = col + run.len();
            let area = vec![at(col, row), at(end, row), at(end, row + 1), at(col, row + 1)];
            figures.extend(color.map(|color| figure(Form::Area(area), color, 1.0, 0)));
            col = end;
        }
    }
    figures
}

fn figure(form: Form, color: [u8; 3], opacity: f64, layer: u8) -> Figure {
    Figure { form, color, opacity, layer }
}

/// Color and opacity of a body.
fn look(body: &Body) -> ([u8; 3], f64) {
    let own = COLORS[body.number as usize % COLORS.len()];
    match (body.kind, body.state) {
        (Kind::Zone, Condition::Touching) => (ALERT, 0.4),
        (Kind::Zone, _) => (own, 0.2),
        (_, Condition::Touching | Condition::Failed) => (ALERT, 1.0),
        (Kind::Door, Condition::Open) => (DOOR, 0.25),
        (Kind::Door, _) => (DOOR, 1.0),
        (Kind::Person, _) => (PERSON, 1.0),
        // Balls are of worlds in space, where they would hide what is behind them.
        (Kind::Obstacle, _) if matches!(body.shape, Shape::Sphere { .. }) => (OBSTACLE, 0.06),
        (Kind::Obstacle, _) => (OBSTACLE, 0.7),
        (Kind::Goal, _) => (own, 0.35),
        (Kind::Robot | Kind::Connector | Kind::Rods | Kind::Airplane, _) => (own, 1.0),
    }
}

/// A body as it is drawn.
pub(super) fn figures(body: &Body) -> Vec<Figure> {
    let (color, opacity) = look(body);
    // Things in space cover each other by their depth alone.
    let layer = match body.kind {
        Kind::Goal => 1,
        Kind::Zone => 2,
        _ => 3,
    };
    let one = |form| vec![figure(form, color, opacity, layer)];
    let mut figures = match &body.shape {
        Shape::Cuboid { size_m } => {
            let faces = faces(&body.pose, *size_m).into_iter();
            faces
                .map(|(face, shade)| figure(Form::Area(face), darker(color, shade), opacity, layer))
                .collect()
        }
        Shape::Cylinder { radius_m, .. } => one(Form::Area(circle(&body.pose, *radius_m))),
        Shape::Sphere { radius_m } => one(Form::Ball { at: body.pose.at_m, radius_m: *radius_m }),
        Shape::Line { points_m, thickness_m } => {
            one(Form::Line { points: points_m.clone(), width_m: *thickness_m })
        }
        Shape::Dart { length_m, width_m } => one(Form::Area(dart(&body.pose, *length_m, *width_m))),
    };
    if body.kind == Kind::Robot {
        figures.extend(heading(body));
    }
    figures
}

/// The corners of a box's upright sides and its top, and how dark each is.
fn faces(pose: &Pose, size_m: Place) -> Vec<(Vec<Place>, f64)> {
    let [x, y, z] = size_m.map(|side_m| 0.5 * side_m);
    let face = |corners: [Place; 4]| corners.map(|corner| pose.place(corner)).to_vec();
    let side = |[a, b]: [[f64; 2]; 2]| {
        face([[a[0], a[1], -z], [b[0], b[1], -z], [b[0], b[1], z], [a[0], a[1], z]])
    };
    let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
    let sides = (0..4).map(|k| (side([corners[k], corners[(k + 1) % 4]]), 0.25));
    let top = face([[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]]);
    let bottom = face([[-x, -y, -z], [x, -y, -z], [x, y, -z], [-x, y, -z]]);
    sides.chain([(bottom, 0.25), (top, 0.0)]).collect()
}

fn darker(color: [u8; 3], by: f64) -> [u8; 3] {
    color.map(|part| (f64::from(part) * (1.0 - by)) as u8)
}

fn circle(pose: &Pose, radius_m: f64) -> Vec<Place> {
    let corner = |k: usize| {
        let angle = k as f64 * std::f64::consts::TAU / CORNERS as f64;
        pose.place([radius_m * angle.cos(), radius_m * angle.sin(), 0.0])
    };
    (0..CORNERS).map(corner).collect()
}

/// An arrowhead whose middle is at the pose.
fn dart(pose: &Pose, length_m: f64, width_m: f64) -> Vec<Place> {
    let (tip, tail, notch, wing) =
        (0.5 * length_m, -0.5 * length_m, -0.25 * length_m, 0.5 * width_m);
    let corners = [[tip, 0.0, 0.0], [tail, wing, 0.0], [notch, 0.0, 0.0], [tail, -wing, 0.0]];
    corners.map(|corner| pose.place(corner)).to_vec()
}

/// A line from the middle to the front.
fn heading(body: &Body) -> Option<Figure> {
    let (front_m, top_m) = match body.shape {
        Shape::Cuboid { size_m: [x, _, z] } => (0.5 * x, 0.5 * z),
        Shape::Cylinder { radius_m, .. } => (radius_m, 0.0),
        _ => return None,
    };
    let points =
        vec![body.pose.place([0.0, 0.0, top_m]), body.pose.place([0.9 * front_m, 0.0, top_m])];
    Some(figure(Form::Line { points, width_m: 0.3 * front_m }, INK, 1.0, 4))
}

/// Where agents were in the frames before the last of `frames`, where they are few enough to tell
/// their ways apart.
pub(super) fn trails(frames: &[Frame]) -> Vec<Figure> {
    const MOST: usize = 60;
    let Some(last) = frames.last() else { return Vec::new() };
    // Of a chain, its first connector.
    let leads = |body: &&Body| body.kind.is_agent() && body.part.unwrap_or(0) == 0;
    let agents: Vec<&Body> = last.bodies.iter().filter(leads).collect();
    if agents.len() > MOST {
        return Vec::new();
    }
    let trail = |agent: &&Body| {
        let is_it = |body: &&Body| {
            (body.kind, body.number, body.part) == (agent.kind, agent.number, agent.part)
        };
        let before = frames.iter().filter_map(|frame| frame.bodies.iter().find(is_it));
        let points: Vec<Place> = before.map(|body| body.pose.at_m).collect();
        let color = COLORS[agent.number as usize % COLORS.len()];
        figure(Form::Line { points, width_m: 0.0 }, color, 0.6, 2)
    };
    agents.iter().map(trail).collect()
}
