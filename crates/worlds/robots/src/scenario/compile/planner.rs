//! Teams that a planner leads: what their robots must be like, and how they are led.

use super::super::{
    KnownPlaces, PlanExecutor, PlannerMethod, PlannerSection, RobotSection, StartPose,
};
use super::bodies::{BodyGroup, GroupTeam, action_cycles, period_cycles};
use super::random::UnlocatedError;
use super::robots::side_boxes;
use super::unused_keys::BEHAVIOURS;
use super::*;
use crate::belief::Reports;
use crate::effector::{LEFT, RIGHT, STANDARD_ACTIONS, STAY, Side};
use crate::team::{TeamLeader, TeamOrders};
use sidestep_kernel::Seed;
use sidestep_kernel::distr::Bernoulli;
use sidestep_planners::{Executor, Method, TeamPlannerConfig, plan_file};
use sidestep_scenario::file::read_text;
use std::path::PathBuf;

/// The team of a section with a planner, as far as other sections can join it.
pub(super) struct JoinableTeam {
    name: String,
    leader: TeamLeader,
    size: u32,
    period: u32,
    phase: Option<u32>,
    action_cycles: u32,
    method: PlannerMethod,
    has_tasks: bool,
}

/// Behaviors that have goals, which is all that a planner asks of them.
const WITH_GOALS: [&str; 2] = ["shuttle", "goto"];

/// The transition that each standard action is meant to make where a planner chooses it: steps, and quarter turns to the
/// left.
const PLANNED_TRANSITIONS: [(ActionId, &[Side], u8); 4] =
    [(FORWARD, &[Side::Front], 0), (LEFT, &[], 1), (RIGHT, &[], 3), (STAY, &[], 0)];

/// Expansions of a search without `budget_expansions`: of 30 robots in a hall, which plan anew at each arrival, they take
/// some ten milliseconds.
const DEFAULT_BUDGET: u64 = 300;

/// Orders of the robots that prioritized planning tries: most problems that it solves at all take one to three.
const MAX_ORDERS: u32 = 10;

/// Actions for which `replan` uses a plan unless the scenario says otherwise: about the way through a room.
const DEFAULT_REPLAN_EVERY: u32 = 20;

/// Actions of a plan that a caller orders unless the scenario says otherwise: about the way through a room.
const DEFAULT_ORDERED_ACTIONS: u32 = 20;

/// Most actions of a plan that a caller orders: each order has as many numbers for each robot.
const MAX_ORDERED_ACTIONS: u32 = 10_000;

/// Most bytes of a plan: 10,000 robots with 10,000 actions each.
const MAX_PLAN_BYTES: u64 = 100 << 20;

impl Compiler<'_> {
    /// Returns the team of the robots of a section, and refuses those that no planner can lead.
    pub(super) fn team(
        &mut self,
        s: &RobotSection,
        effector: &EffectorModel,
    ) -> Result<Option<GroupTeam>, InputError> {
        let number = match (&s.planner, &s.team) {
            (None, None) => None,
            (Some(planner), None) => {
                let leader = self.leader(s, planner, effector)?;
                self.teams.push(JoinableTeam::new(s, planner.get_ref(), leader));
                Some(self.teams.len() - 1)
            }
            (None, Some(team)) => Some(self.team_of_section_before(s, team, effector)?),
            (Some(_), Some(team)) => {
                let cause =
                    "the section has a planner of its own and belongs to the team of another one";
                return Err(self.source.error(
                    team.span(),
                    cause,
                    "leave out `team`, or `planner`",
                ));
            }
        };
        self.last_team = number;
        Ok(number.map(|number| GroupTeam { number, leader: self.teams[number].leader.clone() }))
    }

    /// Returns the team that a section names, by its number. Its robots must be like those of the section with the planner.
    fn team_of_section_before(
        &self,
        s: &RobotSection,
        team: &Spanned<String>,
        effector: &EffectorModel,
    ) -> Result<usize, InputError> {
        let refuse =
            |cause: String, remedy: String| Err(self.source.error(team.span(), cause, remedy));
        let name = team.get_ref();
        if name.is_empty() {
            let remedy = "give the name of the section whose planner leads these robots, or leave out `team`";
            return refuse("the team has no name".to_string(), remedy.to_string());
        }
        let mut namesakes =
            (0..self.teams.len()).filter(|&number| self.teams[number].name == *name);
        let Some(number) = namesakes.next() else {
            let cause = format!("no section before this one has a planner and the name `{name}`");
            return refuse(cause, self.remedy_for_unknown_team(name));
        };
        if namesakes.next().is_some() {
            let cause = format!("several sections have a planner and the name `{name}`");
            return refuse(cause, "give each of them another name".to_string());
        }
        if self.last_team != Some(number) {
            let cause = format!("another section stands between this one and its team `{name}`");
            return refuse(
                cause,
                "move this section up, behind the others of its team".to_string(),
            );
        }
        if let Some((cause, remedy)) = self.teams[number].unlike(s) {
            return refuse(cause, remedy);
        }
        self.check_planned_robots(s, effector, &team.span(), "`team`")?;
        Ok(number)
    }

    /// Returns what to do where no section before has a planner and the name.
    fn remedy_for_unknown_team(&self, name: &str) -> String {
        let names = self.teams.iter().map(|team| team.name.as_str());
        let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
        if names.is_empty() {
            format!(
                "add name = {name:?} to the section with the planner, and let it stand before this one"
            )
        } else {
            suggestion(name, &names)
        }
    }

    /// Returns who leads the robots of a section with a planner, and refuses those that it cannot lead.
    fn leader(
        &self,
        s: &RobotSection,
        planner: &Spanned<PlannerSection>,
        effector: &EffectorModel,
    ) -> Result<TeamLeader, InputError> {
        let span = planner.span();
        let planner = planner.get_ref();
        self.check_planned_robots(s, effector, &span, "the planner")?;
        self.check_planner_keys(planner)?;
        let config = TeamPlannerConfig {
            method: self.planner_method(planner, &span)?,
            executor: executor(planner),
            window: window(planner),
            may_fall_back: planner.places == KnownPlaces::Believed,
            may_follow: self.file.conflict_policy == ConflictPolicy::Simultaneous,
            action_steps: action_cycles(s),
            seed: Seed(0),
        };
        let reports = reports(planner, action_cycles(s));
        Ok(TeamLeader { config, orders: orders(planner), reports })
    }

    fn planner_method(
        &self,
        planner: &PlannerSection,
        span: &Range<usize>,
    ) -> Result<Method, InputError> {
        let budget = planner.budget_expansions.as_ref();
        let budget_expansions = budget.map_or(DEFAULT_BUDGET, |budget| budget.get_ref().get());
        match planner.method {
            PlannerMethod::External if planner.executor.is_some() => Ok(Method::Ordered),
            // What a caller orders action by action needs no plan that is kept, as PIBT does not.
            PlannerMethod::Pibt | PlannerMethod::External => Ok(Method::Pibt),
            PlannerMethod::Lacam => Ok(Method::Lacam { budget_expansions }),
            PlannerMethod::Prioritized => Ok(Method::Prioritized { max_orders: MAX_ORDERS }),
            PlannerMethod::Cbs => Ok(Method::Cbs { budget_expansions }),
            PlannerMethod::File => {
                let Some(file) = &planner.file else {
                    let remedy = "add file = \"NAME.plan\", with a line for each robot: column, row, heading, actions";
                    return Err(self.source.error(span.clone(), "`file` has no plan", remedy));
                };
                let plan = self.plan_file(file)?.plan;
                Ok(Method::Given(Arc::new(plan)))
            }
        }
    }

    /// Refuses keys that do nothing beside the method or the executor.
    fn check_planner_keys(&self, planner: &PlannerSection) -> Result<(), InputError> {
        let method = planner.method;
        let executor = planner.executor.as_ref().map(|executor| *executor.get_ref());
        let is_external = method == PlannerMethod::External;
        let is_stepwise = method == PlannerMethod::Pibt || is_external && executor.is_none();
        // Plans that the planner does not make itself.
        let is_made_elsewhere = method == PlannerMethod::File || is_external;
        let is_given = method == PlannerMethod::File;
        let has_budget = matches!(method, PlannerMethod::Lacam | PlannerMethod::Cbs);
        let is_replan = executor == Some(PlanExecutor::Replan);
        let executor_span = planner.executor.as_ref().map(Spanned::span);
        let window_span = planner.window.as_ref().map(Spanned::span);
        let every_span = planner.replan_every.as_ref().map(Spanned::span);
        let deviation_span = planner.max_deviation.as_ref().map(Spanned::span);
        let budget_span = planner.budget_expansions.as_ref().map(Spanned::span);
        let has_reports = planner.places == KnownPlaces::Believed;
        let report_every_span = planner.report_every.as_ref().map(Spanned::span);
        let report_loss_span = planner.report_loss.as_ref().map(Spanned::span);
        let ordered_actions = window(planner).unwrap_or(DEFAULT_ORDERED_ACTIONS);
        let file_span = planner.file.as_ref().map(Spanned::span);
        let faults = [
            (
                executor_span.clone().filter(|_| is_stepwise),
                "`pibt` chooses anew in each cycle, so it has no executor",
                "leave out `executor`, or give method = \"lacam\"",
            ),
            (
                executor_span.filter(|_| is_made_elsewhere && is_replan),
                "a plan that is made elsewhere cannot be made anew",
                "give executor = \"adg\" or \"blind\"",
            ),
            (
                window_span.clone().filter(|_| is_external && is_stepwise),
                "`window` has no effect on a program that orders action by action",
                "leave out `window`, or add executor = \"adg\": then it orders plans of up to so many actions",
            ),
            (
                window_span.clone().filter(|_| is_stepwise || is_given),
                "`window` has no effect: only `lacam`, `prioritized` and `cbs` plan in windows",
                "leave out `window`",
            ),
            (
                every_span.filter(|_| !is_replan),
                "`replan_every` has no effect without executor = \"replan\"",
                "leave it out, or add executor = \"replan\"",
            ),
            (
                deviation_span.filter(|_| !is_replan),
                "`max_deviation` has no effect without executor = \"replan\"",
                "leave it out, or add executor = \"replan\"",
            ),
            (
                budget_span.filter(|_| !has_budget),
                "`budget_expansions` has no effect: only `lacam` and `cbs` have a budget",
                "leave it out, or give method = \"lacam\"",
            ),
            (
                file_span.filter(|_| !is_given),
                "`file` has no effect without method = \"file\"",
                "leave it out, or give method = \"file\"",
            ),
            (
                window_span.filter(|_| is_external && ordered_actions > MAX_ORDERED_ACTIONS),
                "a plan that a program orders has at most 10,000 actions",
                "give window = 20, or another number up to 10000",
            ),
            (
                report_every_span.filter(|_| !has_reports),
                "`report_every` has no effect on a planner that knows the true places",
                "leave it out, or give places = \"believed\"",
            ),
            (
                report_loss_span.filter(|_| !has_reports),
                "`report_loss` has no effect on a planner that knows the true places",
                "leave it out, or give places = \"believed\"",
            ),
        ];
        for (span, cause, remedy) in faults {
            if let Some(span) = span {
                return Err(self.source.error(span, cause, remedy));
            }
        }
        Ok(())
    }

    fn plan_file(&self, file: &Spanned<PathBuf>) -> Result<plan_file::PlanFile, InputError> {
        let path = self.source.path(file.get_ref());
        let place = path.display().to_string();
        let text = read_text(&path, MAX_PLAN_BYTES)
            .map_err(|e| self.source.with_key_at(file.span(), e))?;
        let plan = plan_file::read(&place, &text);
        plan.map_err(|error| self.source.with_key_at(file.span(), error))
    }

    /// Lets the robots of a plan from a file start as that says: where places or headings are given, they have to be the
    /// same.
    pub(super) fn start_as_planned(
        &self,
        s: &RobotSection,
        mut group: BodyGroup,
    ) -> Result<BodyGroup, InputError> {
        let file = s.planner.as_ref().and_then(|planner| planner.get_ref().file.as_ref());
        let Some(file) = file else { return Ok(group) };
        let plan_file = self.plan_file(file)?;
        let place = self.source.path(file.get_ref()).display().to_string();
        let at_key = |error: InputError| self.source.with_key_at(file.span(), error);
        let size = side_boxes(s);
        let sizes = vec![size; group.count as usize];
        plan_file.check(&place, &FreeSpace::from_map(&self.map), &sizes).map_err(at_key)?;
        let mut places = Vec::with_capacity(sizes.len());
        for (robot, &line) in plan_file.lines.iter().enumerate() {
            let start = plan_file.plan.pose(robot, 0);
            let given = group.places.get(robot).map(|place| *place.get_ref());
            let is_other = given.is_some_and(|given| {
                given.at != start.position() || given.facing.is_some_and(|f| f != start.heading)
            });
            if is_other {
                let (col, row) = given.map_or((0, 0), |given| given.at);
                let cause = format!(
                    "robot {robot} of the section starts at column {col}, row {row}, and its plan elsewhere or with \
                     another heading"
                );
                let remedy = "give a plan from there, or leave out the robots' places: then they start as planned";
                return Err(at_key(InputError::new(&place, cause, remedy).with_position(line, 1)));
            }
            let pose = StartPose { at: start.position(), facing: Some(start.heading) };
            let span = group.places.get(robot).map_or(file.span(), Spanned::span);
            places.push(Spanned::new(span, pose));
        }
        group.places = places;
        Ok(group)
    }

    /// Refuses robots that no planner can lead; `key` is what says that one does.
    fn check_planned_robots(
        &self,
        s: &RobotSection,
        effector: &EffectorModel,
        span: &Range<usize>,
        key: &str,
    ) -> Result<(), InputError> {
        self.check_planned_behaviour(s, span.clone(), key)?;
        if period_cycles(s.period) > 1 && s.phase.is_none() {
            let cause = "the planner leads robots whose period starts in cycles that are drawn";
            let remedy = "add phase = 0, because a team acts in the same cycles";
            return Err(self.source.error(span.clone(), cause, remedy));
        }
        let executor = s.planner.as_ref().and_then(|planner| planner.get_ref().executor.as_ref());
        let by_clock = executor.filter(|executor| *executor.get_ref() != PlanExecutor::Adg);
        if let Some(executor) = by_clock.filter(|_| action_cycles(s) > 1) {
            let cause =
                "robots whose actions take several cycles get out of step with the clock of a plan";
            let remedy = "give executor = \"adg\", or leave out `action_cycles`";
            return Err(self.source.error(executor.span(), cause, remedy));
        }
        for (action, path, turn) in PLANNED_TRANSITIONS {
            let action = usize::from(action);
            let meant = &effector.transitions[action][0];
            if meant.path != path || meant.turn != turn {
                let cause = format!(
                    "the planner plans with steps of one box and quarter turns, and the first transition of `{}` of \
                     effector `{}` is another one",
                    STANDARD_ACTIONS[action], effector.name
                );
                let remedy = "give an effector like forward = [{ p = 0.9, path = \"F\" }, { p = 0.1 }], whose first \
                              transitions are forward one box, left and right 90 degrees, and stay nothing";
                return Err(self.source.error(span.clone(), cause, remedy));
            }
        }
        Ok(())
    }

    fn check_planned_behaviour(
        &self,
        s: &RobotSection,
        span: Range<usize>,
        key: &str,
    ) -> Result<(), InputError> {
        // A list of starts and goals is the behavior `goto`, and errands are goals.
        if s.scen.is_some() || s.tasks.is_some() {
            return Ok(());
        }
        let behaviour = s.behaviour.as_ref().map(Spanned::get_ref);
        let kind = behaviour.map_or("wander", |b| b.kind.get_ref().as_str());
        // A word that is no behavior is told where it stands.
        let is_known =
            BEHAVIOURS.iter().any(|(name, _)| *name == kind) || self.own.contains_key(kind);
        if is_known && !WITH_GOALS.contains(&kind) {
            let cause = format!(
                "the planner leads robots that go somewhere, and the behavior of these is `{kind}`"
            );
            let remedy = format!(
                "give them behaviour = {{ kind = \"shuttle\", a = [...], b = [...] }} or {{ kind = \"goto\", goals = [...] }}, \
                 or leave out {key}"
            );
            return Err(self.source.error(span, cause, remedy));
        }
        if behaviour.is_some_and(|b| b.avoidance.is_some()) {
            let cause = "robots with a planner have `avoidance`, which is the way of robots that decide alone";
            let remedy = format!("leave out `avoidance`, or {key}");
            return Err(self.source.error(span, cause, remedy));
        }
        Ok(())
    }
}

impl JoinableTeam {
    fn new(s: &RobotSection, planner: &PlannerSection, leader: TeamLeader) -> Self {
        Self {
            name: s.name.clone(),
            leader,
            size: side_boxes(s),
            period: period_cycles(s.period),
            phase: s.phase,
            action_cycles: action_cycles(s),
            method: planner.method,
            has_tasks: s.tasks.is_some(),
        }
    }

    /// Returns why the robots of another section cannot be in the same team, and a remedy; none for those that can.
    fn unlike(&self, s: &RobotSection) -> Option<UnlocatedError> {
        let name = &self.name;
        match self.method {
            PlannerMethod::File => {
                let cause =
                    format!("the plan in the file of `{name}` leads the robots of one section");
                let remedy =
                    "replace `team` by planner = { method = \"file\", file = \"NAME.plan\" }";
                return Some((cause, remedy.to_string()));
            }
            PlannerMethod::External => {
                let cause = format!(
                    "the program that leads `{name}` observes and orders the robots of one section"
                );
                let remedy = "replace `team` by planner = { method = \"external\" }";
                return Some((cause, remedy.to_string()));
            }
            _ => {}
        }
        if self.has_tasks || s.tasks.is_some() {
            let cause = "robots with tasks are in a team of several sections";
            let remedy =
                "leave out `team`, and put all robots that share the tasks into one section";
            return Some((cause.to_string(), remedy.to_string()));
        }
        if period_cycles(s.period) > 1 && s.phase.is_none() {
            // Without one, it would be drawn: the check of all robots with a planner says so.
            return None;
        }
        let phase = |phase: Option<u32>| phase.unwrap_or(0);
        let numbers = [
            ("size", side_boxes(s), self.size),
            ("period", period_cycles(s.period), self.period),
            ("phase", phase(s.phase), phase(self.phase)),
            ("action_cycles", action_cycles(s), self.action_cycles),
        ];
        let (key, own, of_team) = numbers.into_iter().find(|(_, own, of_team)| own != of_team)?;
        let cause = format!(
            "these robots have {key} = {own}, and those of their team `{name}` have {of_team}"
        );
        Some((
            cause,
            format!("give {key} = {of_team}, or replace `team` by a planner of their own"),
        ))
    }
}

/// Returns the actions for which a plan is used, if the scenario says so.
fn window(planner: &PlannerSection) -> Option<u32> {
    planner.window.as_ref().map(|window| window.get_ref().get() as u32)
}

/// Returns what a caller orders: plans where there is an executor for them.
fn orders(planner: &PlannerSection) -> Option<TeamOrders> {
    let actions = window(planner).unwrap_or(DEFAULT_ORDERED_ACTIONS);
    match (planner.method, &planner.executor) {
        (PlannerMethod::External, Some(_)) => Some(TeamOrders::Plans { actions }),
        (PlannerMethod::External, None) => Some(TeamOrders::Actions),
        _ => None,
    }
}

/// Returns how robots report to a planner that does not know the true places.
fn reports(planner: &PlannerSection, action_cycles: u32) -> Option<Reports> {
    let every = planner.report_every.as_ref();
    let loss = planner.report_loss.as_ref();
    (planner.places == KnownPlaces::Believed).then(|| Reports {
        // Where an action takes several cycles, the planner has a turn in each of these.
        every_steps: every.map_or(1, |every| every.get_ref().get() * u64::from(action_cycles)),
        loss: Bernoulli::new(loss.map_or(0.0, |loss| f64::from(*loss.get_ref()))),
    })
}

/// Returns how plans are carried out; of `pibt`, which has none, it means nothing.
fn executor(planner: &PlannerSection) -> Executor {
    let name = planner.executor.as_ref().map_or(PlanExecutor::Adg, |executor| *executor.get_ref());
    match name {
        PlanExecutor::Blind => Executor::Blind,
        PlanExecutor::Adg => Executor::Adg,
        PlanExecutor::Replan => {
            let every = planner.replan_every.as_ref();
            let deviation = planner.max_deviation.as_ref();
            Executor::Replan {
                every_steps: every
                    .map_or(DEFAULT_REPLAN_EVERY, |every| every.get_ref().get() as u32),
                max_deviation: deviation.map_or(0, |deviation| *deviation.get_ref()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compiled(robots: &str) -> Result<Compiled, InputError> {
        let text = format!(
            "format = 1\nworld = \"robots\"\nmap.ascii = \"......\"\n[[robots]]\ncount = 2\n{robots}\n"
        );
        let source = Source::new("s.toml", text, "");
        Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial)
    }

    const GOES: &str = "behaviour = { kind = \"shuttle\", a = [0, 0, 1, 1], b = [5, 0, 1, 1] }\n";

    fn assert_refused(robots: &str, cause: &str, remedy: &str) {
        let error = compiled(robots).map(|_| ()).expect_err(robots);
        let line = 6 + robots.lines().position(|line| line.contains("planner")).expect("has one");
        assert_eq!(error.line_and_column().map(|at| at.0), Some(line), "{error}");
        assert!(error.cause().contains(cause), "{error}");
        assert!(error.remedy().contains(remedy), "{error}");
    }

    #[test]
    fn a_planner_of_robots_that_it_cannot_lead_is_refused() {
        let planner = "planner = { method = \"pibt\" }\n";
        assert!(compiled(&format!("{GOES}{planner}")).is_ok());
        assert!(compiled(&format!("{GOES}{planner}period = 3\nphase = 1\n")).is_ok());
        assert_refused(planner, "behavior of these is `wander`", "kind = \"shuttle\"");
        let avoids = GOES.replace(" }", ", avoidance = \"touch\" }");
        assert_refused(&format!("{avoids}{planner}"), "`avoidance`", "leave out `avoidance`");
        assert_refused(&format!("{GOES}{planner}period = 3\n"), "drawn", "phase = 0");
        let whole = planner.replace("\"pibt\"", "\"lacam\", executor = \"adg\"");
        assert!(compiled(&format!("{GOES}{whole}action_cycles = 2\n")).is_ok());
        let blind = whole.replace("adg", "blind");
        assert_refused(&format!("{GOES}{blind}action_cycles = 2\n"), "out of step", "adg");
        let unknown = "planner = { method = \"astar\" }\n";
        let error = compiled(&format!("{GOES}{unknown}")).map(|_| ()).expect_err(unknown);
        assert!(error.to_string().contains("pibt"), "{error}");
        let fast = format!(
            "{GOES}{planner}effector = \"fast\"\n[effectors.fast]\nforward = [{{ p = 1.0, path = \"FF\" }}]\n"
        );
        assert_refused(&fast, "`forward` of effector `fast`", "path = \"F\"");
    }

    #[test]
    fn a_section_that_cannot_be_in_the_team_it_names_is_refused_with_a_remedy() {
        let planner = "planner = { method = \"pibt\" }\n";
        let first = format!("name = \"first\"\n{GOES}{planner}");
        let joining =
            |keys: &str| format!("{first}[[robots]]\ncount = 1\n{GOES}team = \"first\"\n{keys}");
        assert!(compiled(&joining("")).is_ok());
        let refused = |robots: &str, cause: &str, remedy: &str| {
            let error = compiled(robots).map(|_| ()).expect_err(robots);
            let line =
                6 + robots.lines().position(|line| line.contains("team =")).expect("has one");
            assert_eq!(error.line_and_column().map(|at| at.0), Some(line), "{error}");
            assert!(error.cause().contains(cause), "{error}");
            assert!(error.remedy().contains(remedy), "{error}");
        };
        refused(&joining(planner), "planner of its own", "leave out `team`");
        refused(&joining("size = 2\n"), "size = 2", "size = 1");
        refused(&joining("action_cycles = 3\n"), "action_cycles = 3", "action_cycles = 1");
        refused(
            &joining("").replace("team = \"first", "team = \"frist"),
            "the name `frist`",
            "first",
        );
        refused(
            &joining("").replace("name = \"first\"\n", ""),
            "the name `first`",
            "name = \"first\"",
        );
        let between = format!("[[robots]]\ncount = 1\n{GOES}[[robots]]\ncount = 1\n{GOES}team = ");
        let apart = joining("").replace(&format!("[[robots]]\ncount = 1\n{GOES}team = "), &between);
        refused(&apart, "stands between", "move this section");
        refused(
            &joining("").replace("team = \"first\"", "team = \"\""),
            "no name",
            "leave out `team`",
        );
        let method = |method: &str| joining("").replace("\"pibt\"", method);
        refused(&method("\"external\""), "the program", "replace `team`");
        refused(&joining("period = 2\n"), "drawn", "phase = 0");
        let tasks = joining("").replace(GOES, "tasks = { list = [[[0, 0], [5, 0]]] }\n");
        refused(&tasks, "tasks", "one section");
        let wanders = joining("").replacen(&format!("{GOES}team"), "team", 1);
        refused(&wanders, "`wander`", "kind = \"shuttle\"");
    }
}
