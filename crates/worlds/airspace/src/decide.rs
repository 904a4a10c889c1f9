//! What the airplanes of a group want to do: by the method of the world.

use super::Scratch;
use super::airplane::{Action, Pilot, Point, Pose};
use super::baseline::{Moving, mvp, orca};
use super::deploy::contact::Contacts;
use super::deploy::{Decided, Deployment, Traffic};
use super::events::{Event, EventKind};
use super::levels::Levels;
use super::objective::{Options, game};
use super::orders::Stage;
use super::shield::Way;
use super::world::{AirspaceWorld, Method};
use serde::{Deserialize, Serialize};
use sidestep_collectives::{Estimator, Order, optimize};
use sidestep_kernel::math;
use sidestep_kernel::{Cycle, EntityId, Slot};

/// An airplane of a group, as the group knows it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    pub(super) slot: Slot,
    pub(super) pose: Pose,
    pub(super) next: usize,
    /// Orders carried out.
    pub(super) orders: u32,
    pub(super) altitude_m: f64,
}

/// One optimization: of a group, in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Optimization {
    /// When.
    pub cycle: Cycle,
    /// The member of the group with the smallest id,
    pub airplane: EntityId,
    /// and how many they are.
    pub airplanes: u32,
    /// Rounds, of that airplane's agent.
    pub rounds: u32,
    /// Whether the distributions had settled.
    pub converged: bool,
    /// What went over the network.
    pub traffic: Traffic,
}

/// What optimizations took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Effort {
    /// Optimizations.
    pub optimizations: u64,
    /// Their rounds.
    pub rounds: u64,
    /// Those that ended before they had converged.
    pub unconverged: u64,
    /// What went over the network, the shield's exchanges included.
    pub traffic: Traffic,
}

impl Effort {
    /// Adds one optimization.
    pub fn add(&mut self, one: &Optimization) {
        self.optimizations += 1;
        self.rounds += u64::from(one.rounds);
        self.unconverged += u64::from(!one.converged);
        self.traffic.add(one.traffic);
    }
}

impl AirspaceWorld {
    /// The ways that each airplane of a group may fly in the next `dt`, the wanted one first.
    pub(super) fn wanted(
        &self,
        group: &[Known],
        now: Cycle,
        contacts: &mut [Contacts],
        scratch: &mut Scratch,
    ) -> Vec<Vec<Way>> {
        let wishes = match self.method {
            _ if group.len() < 2 => group.iter().map(|known| self.straight(*known)).collect(),
            Method::None => group.iter().map(|known| self.straight(*known)).collect(),
            Method::Pc => self.optimized(group, now, contacts, scratch),
            Method::Mvp | Method::Orca => self.by_velocity(group),
        };
        group.iter().zip(wishes).map(|(known, wishes)| self.ways(*known, &wishes)).collect()
    }

    /// By a method that tells each airplane a velocity of which the direction is taken.
    fn by_velocity(&self, group: &[Known]) -> Vec<Vec<Action>> {
        let all: Vec<Moving> = group.iter().map(|known| self.moving(*known)).collect();
        let horizon_s = self.timing.horizon as f64 * self.timing.dtau_s;
        let margin = self.objective.inflation;
        let toward = |(k, own): (usize, &Moving)| {
            let near = |other: &Moving| other.levels.meets(&own.levels, self.vertical_m);
            let others = all.iter().enumerate().filter(|(j, m)| *j != k && near(m)).map(|(_, m)| m);
            let [vx, vy] = match self.method {
                Method::Orca => orca::velocity(own, others, horizon_s, self.timing.dt_s, margin),
                _ => mvp::velocity(own, others, horizon_s, margin),
            };
            if [vx, vy] == own.preferred {
                return self.straight(group[k]);
            }
            let pose = group[k].pose;
            let omega_max = self.airplanes[group[k].slot as usize].model.omega_max_rad_s;
            let goal = [pose.at[0] + vx, pose.at[1] + vy];
            let omega_rad_s = pose.steer(goal, omega_max, self.timing.dt_s);
            let turn = Action::Then { omega_rad_s, hold_s: self.timing.dt_s };
            let mut wishes = vec![turn];
            wishes.extend(self.by_turn(group[k], omega_rad_s));
            wishes
        };
        all.iter().enumerate().map(toward).collect()
    }

    fn moving(&self, known: Known) -> Moving {
        let Stage { model, mission, .. } = self.stage(known.slot, known.orders);
        let Pose { at, psi_rad } = known.pose;
        let v = model.v_m_s;
        let toward = mission.get(known.next).map_or(psi_rad, |&goal| {
            let aim = self.aim(at, goal, v);
            math::atan2(aim[1] - at[1], aim[0] - at[0])
        });
        Moving {
            at,
            velocity: [v * math::cos(psi_rad), v * math::sin(psi_rad)],
            preferred: [v * math::cos(toward), v * math::sin(toward)],
            separation_m: model.separation_m,
            levels: self.levels(known),
        }
    }

    /// Straight to the way-point, and the other actions by how little they differ from that.
    fn straight(&self, known: Known) -> Vec<Action> {
        let Stage { model, mission, .. } = self.stage(known.slot, known.orders);
        self.by_turn(known, self.steer(&self.pilot(model, mission), known.pose, known.next))
    }

    /// Proceeding, and the other actions by how little they differ from a turn rate.
    fn by_turn(&self, known: Known, wanted: f64) -> Vec<Action> {
        let mut others: Vec<Action> = self.actions[known.slot as usize].clone();
        let turn = |action: &Action| match *action {
            Action::Hold { omega_rad_s }
            | Action::Then { omega_rad_s, .. }
            | Action::Leg { omega_rad_s, .. } => (omega_rad_s - wanted).abs(),
            Action::Proceed => -1.0,
        };
        others.sort_by(|a, b| turn(a).total_cmp(&turn(b)));
        others
    }

    /// By probability collectives: the chosen action, and the others by what the optimizer
    /// expects of them.
    fn optimized(
        &self,
        group: &[Known],
        now: Cycle,
        contacts: &mut [Contacts],
        scratch: &mut Scratch,
    ) -> Vec<Vec<Action>> {
        if self.group_takes_bytes(group) > self.group_bytes {
            let event = Event::of(now, EventKind::GroupTooLarge, group[0].slot);
            scratch.events.push(event.with(group.len() as f64));
            return group.iter().map(|known| self.straight(*known)).collect();
        }
        let (decided, traffic) = match self.deployment {
            Deployment::Direct => (self.direct(group, now), Traffic::default()),
            _ => self.deployed(group, now, contacts, &mut scratch.events),
        };
        let first = decided.iter().flatten().next();
        scratch.optimizations.push(Optimization {
            cycle: now,
            airplane: group[0].slot,
            airplanes: group.len() as u32,
            rounds: first.map_or(0, |decided| decided.rounds),
            converged: first.is_some() && decided.iter().flatten().all(|d| d.converged),
            traffic,
        });
        let ranked = |(decided, known): (&Option<Decided>, &Known)| match decided {
            Some(decided) => self.ranked(decided, *known),
            // Nobody has told it what to do.
            None => self.straight(*known),
        };
        decided.iter().zip(group).map(ranked).collect()
    }

    /// The chosen action, and then the others, what is expected of them rising.
    fn ranked(&self, Decided { chosen, expected, .. }: &Decided, known: Known) -> Vec<Action> {
        let chosen = *chosen;
        let mut order: Vec<usize> = (0..expected.len()).collect();
        order.sort_by(|&a, &b| {
            (a != chosen).cmp(&(b != chosen)).then(expected[a].total_cmp(&expected[b]))
        });
        order.iter().map(|&k| self.actions_of(known.slot)[k]).collect()
    }

    /// One process decides for all.
    fn direct(&self, group: &[Known], now: Cycle) -> Vec<Option<Decided>> {
        let options: Vec<Options> = group.iter().map(|known| self.options(*known)).collect();
        let game = game(&self.objective, &options);
        let uniform = |player: usize, k: u64| self.uniform(group[player].slot, now, k);
        let outcome = optimize(&game, &self.settings, uniform);
        let (rounds, converged) = (outcome.rounds, outcome.converged);
        let each = outcome.joint.into_iter().zip(outcome.expected);
        each.map(|(chosen, expected)| Some(Decided { chosen, expected, rounds, converged }))
            .collect()
    }

    /// Where each action would lead an airplane. In the air, way-points drift against the
    /// wind; over one horizon they are taken where they will be met on a straight way.
    pub(super) fn options(&self, known: Known) -> Options {
        self.options_towards(known, self.stage(known.slot, known.orders).mission)
    }

    /// The levels that an airplane is on and comes to.
    pub(super) fn levels(&self, known: Known) -> Levels {
        Levels::between(known.altitude_m, self.stage(known.slot, known.orders).altitude_m)
    }

    /// The same for a mission that was told.
    pub(super) fn options_towards(&self, known: Known, mission: &[Point]) -> Options {
        let model = self.stage(known.slot, known.orders).model;
        let mission = self.drifted(mission, known);
        let pilot = self.pilot(model, &mission);
        let predict =
            |action: &Action| pilot.predict(*action, known.pose, known.next, &self.timing);
        let predictions = self.actions_of(known.slot).iter().map(predict).collect();
        Options::new(predictions, model.separation_m, self.levels(known))
    }

    /// The mission as seen from the moving air: each way-point where it will be when the
    /// airplane comes to it.
    fn drifted(&self, mission: &[Point], known: Known) -> Vec<Point> {
        let model = self.stage(known.slot, known.orders).model;
        let [wx, wy] = self.wind_m_s;
        if wx == 0.0 && wy == 0.0 {
            return mission.to_vec();
        }
        let (mut at, mut flown_s) = (known.pose.at, 0.0);
        let mut drifted = mission.to_vec();
        for goal in drifted.iter_mut().skip(known.next) {
            let heading = self.aim(at, *goal, model.v_m_s);
            let ground = [heading[0] - at[0] + wx, heading[1] - at[1] + wy];
            let speed_m_s = sidestep_kernel::math::hypot(ground[0], ground[1]).max(1e-3);
            flown_s += super::airplane::distance_m(at, *goal) / speed_m_s;
            at = *goal;
            *goal = [goal[0] - wx * flown_s, goal[1] - wy * flown_s];
        }
        drifted
    }

    /// The different motions of the next `dt` among some actions, in their order.
    fn ways(&self, known: Known, wishes: &[Action]) -> Vec<Way> {
        let mut ways: Vec<Way> = Vec::new();
        for &action in wishes {
            let way = self.way(known, action);
            if !ways.contains(&way) {
                ways.push(way);
            }
        }
        ways
    }

    fn way(&self, known: Known, action: Action) -> Way {
        let Stage { model, mission, .. } = self.stage(known.slot, known.orders);
        let pilot: Pilot<'_> = self.pilot(model, mission);
        let (mut pose, mut next) = (known.pose, known.next);
        let mut omegas_rad_s = Vec::new();
        for k in 0..self.timing.points_per_dt() {
            let held = action.held_rad_s(k as f64 * self.timing.dtau_s);
            let omega = held.unwrap_or_else(|| self.steer(&pilot, pose, next));
            omegas_rad_s.push(omega);
            pose = self.blown(pose.step(model.v_m_s, omega, self.timing.dtau_s));
            next = pilot.next(pose, next);
        }
        Way { omegas_rad_s }
    }

    /// Numbers that one optimization may draw from an airplane's stream at most; none if that
    /// is beyond all counting.
    pub(super) fn most_samples(&self) -> Option<u64> {
        let Estimator::Sampled { block, .. } = self.settings.estimator else { return Some(1) };
        let blocks_per_round = match self.settings.order {
            Order::Parallel => 1,
            // One at the beginning of a round, and one after each player of the largest group.
            Order::Sequence => self.airplanes.len() as u64 + 1,
        };
        let per_round = (block as u64).checked_mul(blocks_per_round)?;
        // And the final draw.
        per_round.checked_mul(self.settings.stop.max_rounds.into())?.checked_add(1)
    }
}
