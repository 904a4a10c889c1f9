//! Remarks that need the sections of a scenario: on effectors, and on goals and tasks out of reach.

use super::super::RobotsFile;
use super::bodies::BodyGroup;
use super::*;
use crate::errand_fields::MAX_WATCHED_BOXES;
use sidestep_planners::Dispatcher;

/// Returns warnings of effectors that move otherwise than their author may expect.
pub(super) fn effector_remarks(
    file: &RobotsFile,
    effectors: &BTreeMap<String, LocatedSection<EffectorSection>>,
) -> Vec<Remark> {
    let mut remarks = Vec::new();
    for (k, section) in file.robots.0.iter().enumerate() {
        let Some(name) = section.get_ref().effector.as_ref().map(Spanned::get_ref) else {
            continue;
        };
        let Some(at) = effectors.get(name) else { continue };
        for words in misleading_transitions(name, at) {
            remarks.push(Remark::warning(format!("robots.{k}.effector"), words));
        }
    }
    remarks
}

/// Behaviors that never say anything.
const SILENT: [&str; 5] = ["wander", "shuttle", "goto", "replay", "random"];

/// Returns a note on a radio over which no robot speaks.
pub(super) fn radio_remark(file: &RobotsFile) -> Option<Remark> {
    let is_idle = file.radio.is_some() && !file.robots.0.iter().any(may_broadcast);
    is_idle.then(|| Remark::note("radio", "has no effect: no robot has a behavior that broadcasts"))
}

/// Returns whether the robots of a section have a behavior that may broadcast, as a user's own may.
fn may_broadcast(section: &Spanned<RobotSection>) -> bool {
    let behaviour = section.get_ref().behaviour.as_ref();
    behaviour.is_some_and(|b| !SILENT.contains(&b.get_ref().kind.get_ref().as_str()))
}

/// Refuses effectors that were learned for boxes of another size: a slip of a box is another length
/// there, and how often it happens depends on the box.
pub(super) fn refuse_other_boxes(
    source: &Source,
    file: &RobotsFile,
    map_m: f64,
    effectors: &BTreeMap<String, LocatedSection<EffectorSection>>,
) -> Result<(), InputError> {
    let named = file.robots.0.iter().filter_map(|section| section.get_ref().effector.as_ref());
    for name in named {
        let learned = effectors.get(name.get_ref()).and_then(|at| at.section.get_ref().box_m);
        let Some(box_m) = learned.map(|m| m.get()) else { continue };
        // But for rounding, since both are written in decimal.
        if (box_m - map_m).abs() > 1e-9 * map_m {
            let cause = format!(
                "the effector `{}` was learned for boxes of {box_m} m, and those of the map are \
                 {map_m} m: its slips would be other lengths",
                name.get_ref()
            );
            let remedy = format!(
                "learn it from the same log with --box {map_m}, or set map.box_size_m = {box_m}"
            );
            return Err(source.error(Some(name.span()), cause, remedy));
        }
    }
    Ok(())
}

/// Returns words for each action that mostly ends in a transition other than its first.
fn misleading_transitions(name: &str, at: &LocatedSection<EffectorSection>) -> Vec<String> {
    let Ok(model) = tables::effector(name, at) else { return Vec::new() };
    let actions = model.actions.iter().zip(&model.transitions);
    let wrong = actions.filter_map(|(action, transitions)| {
        let meant = &transitions[0];
        let likeliest = transitions.iter().max_by(|a, b| a.p.total_cmp(&b.p))?;
        (likeliest.p > meant.p).then(|| {
            format!(
                "`{action}` of `{name}` mostly comes to {} ({}), not to {} ({}), which is meant \
                 because it is its first transition",
                describe(likeliest),
                percent(likeliest.p),
                describe(meant),
                percent(meant.p),
            )
        })
    });
    wrong.collect()
}

fn describe(transition: &Transition) -> String {
    let path: String = transition.path.iter().map(|side| side.letter()).collect();
    let turn_deg = [0, 90, 180, -90][usize::from(transition.turn % 4)];
    match (path.as_str(), turn_deg) {
        ("", 0) => "staying in place".into(),
        ("", _) => format!("a turn of {turn_deg} degrees"),
        (_, 0) => format!("the path {path:?}"),
        _ => format!("the path {path:?} and a turn of {turn_deg} degrees"),
    }
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

impl Compiler<'_> {
    /// Warns of robots that cannot reach all their goals; `groups` are those of the sections of
    /// robots, in order, and each comes with the id of its first body.
    pub(super) fn warn_of_unreachable_goals<'g>(
        &mut self,
        groups: impl Iterator<Item = (&'g BodyGroup, EntityId)>,
        placed: &Placement,
    ) {
        for (k, (group, first)) in groups.enumerate() {
            let ids = first..first + group.count as EntityId;
            let missed: Vec<usize> = ids.map(|id| self.unreachable_goals(placed, id)).collect();
            let robots = missed.iter().filter(|goals| **goals > 0).count();
            if robots > 0 {
                let all = group.count;
                let goals: usize = missed.iter().sum();
                let words = format!(
                    "{robots} of {all} robots cannot reach a goal, {goals} goals in all: walls are \
                     between it and their start, or the way is too narrow for them"
                );
                self.remarks.push(Remark::warning(format!("robots.{k}"), words));
            }
        }
    }

    /// Warns where a run should end by a gridlock of robots that are not watched.
    pub(super) fn warn_of_unwatched_tasks<'g>(
        &mut self,
        groups: impl Iterator<Item = (&'g BodyGroup, EntityId)>,
    ) {
        let boxes = self.map.cells().len();
        if !self.file.stop.gridlock || boxes <= MAX_WATCHED_BOXES {
            return;
        }
        for (k, _) in groups.enumerate().filter(|(_, (group, _))| group.tasks.is_some()) {
            let words = format!(
                "the run does not end by gridlocks of these robots: those with tasks are watched on floors of up to \
                 {MAX_WATCHED_BOXES} boxes, and this one has {boxes}. Leave out `[stop] gridlock`, or give a smaller map"
            );
            self.remarks.push(Remark::warning(format!("robots.{k}.tasks"), words));
        }
    }

    /// Warns of tasks that none of the robots which have them can ever carry out; `groups` are as those of goals.
    pub(super) fn warn_of_unreachable_tasks<'g>(
        &mut self,
        groups: impl Iterator<Item = (&'g BodyGroup, EntityId)>,
        placed: &Placement,
    ) {
        let free = FreeSpace::from_map(&self.map);
        for (k, (group, first)) in groups.enumerate() {
            let Some(tasks) = &group.tasks else { continue };
            let ids = first..first + group.count as EntityId;
            let starts: Vec<(u32, u32)> = ids.map(|id| placed.start[id as usize].0).collect();
            let Some(body) = placed.bodies.get(first as usize) else { continue };
            let size = self.types[usize::from(body.ty)].size.0;
            // The errands were checked: bodies fit there.
            let Ok(dispatcher) = Dispatcher::new(&free, size, tasks) else { continue };
            let missed = dispatcher.tasks_out_of_reach(&starts);
            if let Some(&task) = missed.first() {
                let errands: Vec<[u32; 2]> =
                    dispatcher.places(task).into_iter().map(<[u32; 2]>::from).collect();
                let words = format!(
                    "no robot can ever carry out {} of {} tasks; they stay open, and fewer others are known. The first \
                     one has the errands {errands:?}: walls are between them and all starts, or the way is too narrow. Give \
                     errands that a robot can come to",
                    missed.len(),
                    tasks.tasks.len(),
                );
                self.remarks.push(Remark::warning(format!("robots.{k}.tasks"), words));
            }
        }
    }

    fn unreachable_goals(&self, placed: &Placement, id: EntityId) -> usize {
        let ty = &self.types[usize::from(placed.bodies[id as usize].ty)];
        let Role::Robot(model) = &ty.role else { return 0 };
        // Paths lead back as well, so a robot that reaches a goal from its start reaches it from other goals.
        let (col, row) = placed.start[id as usize].0;
        let fields = model.behaviour.flow_fields().iter();
        fields.filter(|field| !field.reaches_goal(col, row)).count()
    }
}
