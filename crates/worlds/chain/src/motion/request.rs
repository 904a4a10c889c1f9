//! One motion of a chain: by propagation or, where a connector is held, of all parts at once.

use sidestep_arms::ik::{ChainIkGoal, IkEngine, IkSolver};
use sidestep_kernel::InputError;
use sidestep_rods::geometry::{Point, distance, lerp};
use sidestep_rods::{
    Chain, CompletedMotion, Connector, Mobility, MotionOutcome, MotionRequest, Obstacles,
    Propagator, ReachOutcome, ReachRequest, ReactionRules, RequestedMotion, Veto, VetoReason,
    is_in_range, reach_target,
};

/// What moves a chain, and what it may meet.
struct MotionEnvironment<'a, const D: usize> {
    propagator: &'a mut Propagator<D>,
    obstacles: &'a Obstacles<D>,
}

/// Moves a chain as requested. A chain with a connector that must stay at its position, on its line or plane, or in
/// its box moves all parts at once, by as little as it takes; where that is blocked, by propagation and by
/// [`reach_target`].
///
/// # Errors
/// As [`Propagator::propagate`].
pub(crate) fn execute_request<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    request: &MotionRequest<D>,
) -> Result<MotionOutcome<D>, InputError> {
    let RequestedMotion::Connector { k, to } = request.motion else {
        return propagator.propagate(chain, obstacles, request);
    };
    let Some(hold) = Hold::of_chain(chain) else {
        let scene = &mut MotionEnvironment { propagator, obstacles };
        return propagate_slowed(scene, chain, request, (k, to));
    };
    let order = ReachRequest { k, target: to, base: hold.connector, tolerance_m: TOLERANCE_M };
    let scene = &mut MotionEnvironment { propagator, obstacles };
    let joints_m = max_cycle_step_m(chain, &scene.propagator.rules);
    try_slowed(chain, k, to, joints_m, |chain, before, target| {
        let order = ReachRequest { target, ..order };
        move_held_chain(scene, chain, before, &order, request)
    })
}

/// Moves a chain that nothing holds by propagation, and its initiator less far where a rod that turns aside would throw
/// some part too far.
fn propagate_slowed<const D: usize>(
    scene: &mut MotionEnvironment<'_, D>,
    chain: &mut Chain<D>,
    request: &MotionRequest<D>,
    (k, to): (usize, Point<D>),
) -> Result<MotionOutcome<D>, InputError> {
    let most_m = scene.propagator.rules.free_step_max_m;
    if most_m == f64::INFINITY {
        return scene.propagator.propagate(chain, scene.obstacles, request);
    }
    try_slowed(chain, k, to, most_m, |chain, _, target| {
        let motion = RequestedMotion::Connector { k, to: target };
        let request = MotionRequest { motion, ..*request };
        Ok((scene.propagator.propagate(chain, scene.obstacles, &request)?, f64::INFINITY))
    })
}

/// Returns the longest displacement of any connector of a chain in a cycle, meters: held chains have joints, whose
/// speed is limited.
pub(crate) fn max_cycle_step_m<const D: usize>(chain: &Chain<D>, rules: &ReactionRules) -> f64 {
    let has_joints = Hold::of_chain(chain).is_some_and(|hold| hold.has_joints);
    if has_joints { rules.joint_step_max_m } else { f64::INFINITY }
}

/// How a chain is held.
#[derive(Debug, Clone, Copy)]
struct Hold {
    /// The first connector that is not free to go anywhere.
    connector: usize,
    /// Whether the chain hangs on a connector that is fixed, or on a line, a plane or in a box, so that its joints
    /// have a speed limit; parts that hang on a failed connector swing freely.
    has_joints: bool,
}

impl Hold {
    fn of_chain<const D: usize>(chain: &Chain<D>) -> Option<Self> {
        // Most chains are held nowhere, and would be searched for each motion.
        if chain.is_plain() {
            return None;
        }
        let connectors = chain.connectors();
        let is_bound = |connector: &Connector<D>| connector.mobility != Mobility::Free;
        let connector = connectors.iter().position(|c| c.failed || is_bound(c))?;
        let has_joints = connectors.iter().any(|c| !c.failed && is_bound(c));
        Some(Self { connector, has_joints })
    }
}

/// Moves a held chain: all of it at once, or by propagation and return passes where something is in the way of that.
/// Also returns the longest displacement of a connector with which the outcome still counts as a motion, meters.
fn move_held_chain<const D: usize>(
    scene: &mut MotionEnvironment<'_, D>,
    chain: &mut Chain<D>,
    before: &[Point<D>],
    order: &ReachRequest<D>,
    request: &MotionRequest<D>,
) -> Result<(MotionOutcome<D>, f64), InputError> {
    let ReachRequest { k, target, .. } = *order;
    let longest_m = chain.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max);
    let jump_m = scene.propagator.rules.slave_step_max_m.min(MAX_JUMP * longest_m);
    let initiator = chain.connectors()[k];
    let may_lead = !initiator.is_still() && initiator.mobility.allows(target, before[k]);
    if may_lead && is_in_range(&target) {
        let Err(veto) = scene.propagator.move_at_once(chain, scene.obstacles, k, target) else {
            return Ok((MotionOutcome::Moved(motion_since(before, chain, k)), jump_m));
        };
        // Rods that turn one by one find ways past obstacles. Out of the chain's own way all parts at once move as
        // well, and far more cheaply.
        if veto.reason == VetoReason::SelfCollision {
            return Ok((MotionOutcome::Vetoed(veto), f64::INFINITY));
        }
    }
    let motion = RequestedMotion::Connector { k, to: target };
    let request = MotionRequest { motion, ..*request };
    let outcome = scene.propagator.propagate(chain, scene.obstacles, &request)?;
    let MotionOutcome::Vetoed(veto) = &outcome else { return Ok((outcome, f64::INFINITY)) };
    // A reach leads others back; it is of no use to an initiator that is held itself.
    if !is_held_veto(veto.reason) || veto.by == k {
        return Ok((outcome, f64::INFINITY));
    }
    let order = ReachRequest { base: veto.by, ..*order };
    if let Some(by) = reach_limiting_connector(chain, &order) {
        let veto = Veto { by, reason: VetoReason::OutOfReach, ..*veto };
        return Ok((MotionOutcome::Vetoed(veto), f64::INFINITY));
    }
    move_to_target(scene, chain, before, &order, veto)
}

/// Returns whether a return pass may answer a veto.
fn is_held_veto(reason: VetoReason) -> bool {
    matches!(reason, VetoReason::Fixed | VetoReason::Failed | VetoReason::Mobility)
}

/// Tries a motion, shortened until no connector moves farther than `joints_m`: near a singular posture
/// connectors move much farther than the initiator. An attempt also returns the longest displacement of a connector
/// with which its outcome still counts as a motion, meters.
fn try_slowed<const D: usize>(
    chain: &mut Chain<D>,
    k: usize,
    to: Point<D>,
    joints_m: f64,
    mut attempt: impl FnMut(
        &mut Chain<D>,
        &[Point<D>],
        Point<D>,
    ) -> Result<(MotionOutcome<D>, f64), InputError>,
) -> Result<MotionOutcome<D>, InputError> {
    let before = chain.points().to_vec();
    let from = before[k];
    let mut fraction = 1.0;
    let mut fastest = k;
    for _ in 0..MAX_SLOWED_TRIES {
        // The target itself, and not an interpolation that rounds.
        let target = if fraction < 1.0 { lerp(from, to, fraction) } else { to };
        let (outcome, jump_m) = attempt(chain, &before, target)?;
        let moved = match outcome {
            MotionOutcome::Moved(moved) => moved,
            vetoed @ MotionOutcome::Vetoed(_) => return Ok(vetoed),
        };
        let most_m = joints_m.min(jump_m);
        let moved_range = moved.touched.start..moved.touched.end.min(before.len());
        let (by, longest_m) =
            max_displacement(&before[moved_range.clone()], &chain.points()[moved_range.clone()]);
        let by = by + moved_range.start;
        if longest_m <= most_m {
            let cut_short = if fraction < 1.0 {
                Some(speed_veto(k, by, chain.points()[k]))
            } else {
                moved.cut_short
            };
            return Ok(MotionOutcome::Moved(CompletedMotion { cut_short, ..moved }));
        }
        chain.points_mut().copy_from_slice(&before);
        fraction = fraction * SLOWED_FRACTION * most_m / longest_m;
        fastest = by;
    }
    Ok(MotionOutcome::Vetoed(speed_veto(k, fastest, from)))
}

/// Returns the veto of the connector that has moved farther than `most_m` from the positions before a cycle, if one
/// has.
pub(crate) fn find_speed_veto<const D: usize>(
    before: &[Point<D>],
    points: &[Point<D>],
    k: usize,
    most_m: f64,
) -> Option<Veto<D>> {
    let (by, longest_m) = max_displacement(before, points);
    (longest_m > most_m * (1.0 + ROUNDING)).then(|| speed_veto(k, by, before[k]))
}

/// Returns the veto of connector `by`, which would be too fast, against a motion of connector `k`.
fn speed_veto<const D: usize>(k: usize, by: usize, reached: Point<D>) -> Veto<D> {
    Veto { by, from: k, reason: VetoReason::StepLimit, obstacle: None, reached }
}

/// Returns the connector that has moved farthest, and its displacement, meters.
fn max_displacement<const D: usize>(before: &[Point<D>], points: &[Point<D>]) -> (usize, f64) {
    let mut most = (0, 0.0);
    for (k, (from, to)) in before.iter().zip(points).enumerate() {
        let displacement_m = distance(*from, *to);
        if displacement_m > most.1 {
            most = (k, displacement_m);
        }
    }
    most
}

/// Moves a chain whose base has vetoed by forward and backward passes, or straight to a posture; also returns the
/// longest displacement of a connector with which the outcome still counts as a motion, meters.
fn move_to_target<const D: usize>(
    scene: &mut MotionEnvironment<'_, D>,
    chain: &mut Chain<D>,
    before: &[Point<D>],
    order: &ReachRequest<D>,
    objection: &Veto<D>,
) -> Result<(MotionOutcome<D>, f64), InputError> {
    Ok(match reach_target(scene.propagator, chain, scene.obstacles, order)? {
        ReachOutcome::There { .. } => {
            (MotionOutcome::Moved(motion_since(before, chain, order.k)), f64::INFINITY)
        }
        ReachOutcome::Short { veto: Some(veto), .. } => {
            (MotionOutcome::Vetoed(veto), f64::INFINITY)
        }
        ReachOutcome::Short { nearest, veto: None } => {
            let objection = Veto { reached: nearest, ..*objection };
            let rules = scene.propagator.rules;
            let longest_m = chain.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max);
            let jump_m = rules.slave_step_max_m.min(MAX_JUMP * longest_m);
            (move_by_ik(scene, chain, before, order, objection)?, jump_m)
        }
    })
}

/// Most attempts to find the distance that an initiator may go: as an elbow moves with the square root of the tool's
/// motion at worst, each halves the excess in orders of magnitude, so that few are needed.
const MAX_SLOWED_TRIES: usize = 16;
/// Relative tolerance for motions at exactly the maximum speed.
const ROUNDING: f64 = 1e-9;
/// Fraction of the limit that an attempt aims at, because near singular postures joints slow down less
/// than the initiator.
const SLOWED_FRACTION: f64 = 0.9;

/// Finds a posture, or reports that the target is out of reach. Passes converge slowly if a chain
/// is nearly straight, and not at all along a straight line, so damped least squares find the nearest
/// posture that reaches the target, and the chain moves straight to it if neither the posture nor the motion is
/// blocked.
fn move_by_ik<const D: usize>(
    scene: &mut MotionEnvironment<'_, D>,
    chain: &mut Chain<D>,
    before: &[Point<D>],
    order: &ReachRequest<D>,
    objection: Veto<D>,
) -> Result<MotionOutcome<D>, InputError> {
    let ReachRequest { k, target, base, tolerance_m } = *order;
    let goal = ChainIkGoal {
        engine: IkEngine::Dls,
        restarts: 0,
        tolerance_m,
        ..ChainIkGoal::new(k, base, target)
    };
    let answer = IkSolver::new(scene.propagator.rules).solve(chain, scene.obstacles, &goal)?;
    // The solver knows of no held connector other than the base.
    let mut motions = chain.connectors().iter().zip(chain.points().iter().zip(&answer.points));
    let is_allowed = motions.all(|(connector, (at, to))| may_move(connector, *at, *to));
    if !answer.reached || !is_allowed {
        return Ok(MotionOutcome::Vetoed(objection));
    }
    chain.points_mut().copy_from_slice(&answer.points);
    if let Some(veto) = scene.propagator.find_path_veto(chain, scene.obstacles, before, k) {
        chain.points_mut().copy_from_slice(before);
        return Ok(MotionOutcome::Vetoed(Veto { reached: objection.reached, ..veto }));
    }
    Ok(MotionOutcome::Moved(motion_since(before, chain, k)))
}

/// Returns whether a connector may move from one position to another.
fn may_move<const D: usize>(connector: &Connector<D>, at: Point<D>, to: Point<D>) -> bool {
    if connector.is_still() { at == to } else { connector.mobility.allows(to, at) }
}

/// Returns the connector, if there is one, from whose positions the rods do not reach the target.
fn reach_limiting_connector<const D: usize>(
    chain: &Chain<D>,
    order: &ReachRequest<D>,
) -> Option<usize> {
    for (i, connector) in chain.connectors().iter().enumerate() {
        // A failed connector may be repaired, so it is reported as failed.
        if i == order.k || connector.failed {
            continue;
        }
        let rods = &chain.rods()[order.k.min(i)..order.k.max(i)];
        let reach_m: f64 = rods.iter().map(|rod| rod.max_m).sum();
        let nearest = connector.mobility.project(order.target, chain.points()[i]);
        if distance(nearest, order.target) > reach_m + order.tolerance_m {
            return Some(i);
        }
    }
    None
}

/// Longest move of a connector, as a fraction of the longest rod, with which a posture is accepted as a
/// motion: farther apart, two postures are not one motion of the chain. An elbow that changes its side moves by up to
/// two rods; that of a straight arm that is drawn in moves with the square root of the tool's motion, and has to be
/// allowed more than small steps. The half between the two was chosen, not measured.
const MAX_JUMP: f64 = 0.5;

/// Distance at which a connector's step counts as complete, meters.
pub(crate) const TOLERANCE_M: f64 = 1e-7;

/// Returns a motion that no propagation has counted: how far connectors have moved, by comparison.
fn motion_since<const D: usize>(
    before: &[Point<D>],
    chain: &Chain<D>,
    k: usize,
) -> CompletedMotion<D> {
    let moves_m = before.iter().zip(chain.points()).map(|(a, b)| distance(*a, *b));
    let slaves_m = moves_m.enumerate().filter(|(i, _)| *i != k).map(|(_, m)| m);
    CompletedMotion {
        touched: 0..before.len(),
        changed: before.iter().zip(chain.points()).filter(|(a, b)| a != b).count(),
        rotated: 0,
        max_slave_step_m: slaves_m.fold(0.0, f64::max),
        cut_short: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_rods::{RequestSource, Rod, VetoEffect};

    /// An arm of two rods, bent a little; the base is fixed.
    fn arm() -> Chain<2> {
        let points = vec![[0.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let mut arm = Chain::new(
            points,
            vec![Connector::free(0.05); 3],
            vec![Rod::with_fixed_length(1.0, 0.02); 2],
        )
        .unwrap();
        arm.set_mobility(0, Mobility::Fixed).unwrap();
        arm
    }

    /// Drags the tool out to 0.1 mm less than the reach; returns the longest way of any connector in a
    /// request, and the greatest distance of the tool from the base.
    fn dragged_out(joint_step_max_m: f64) -> (f64, f64) {
        let (mut chain, step_m) = (arm(), 0.01);
        let mut propagator =
            Propagator::new(ReactionRules { joint_step_max_m, ..ReactionRules::default() });
        let mut most_m = 0.0;
        for _ in 0..400 {
            let (before, at) = (chain.points().to_vec(), chain.points()[2]);
            let to = sidestep_rods::geometry::move_toward(at, [1.199_94, 1.599_92], step_m);
            let motion = RequestedMotion::Connector { k: 2, to };
            let request = MotionRequest {
                motion,
                source: RequestSource::Autonomous,
                mode: VetoEffect::Exact,
            };
            execute_request(&mut propagator, &mut chain, &Obstacles::default(), &request).unwrap();
            most_m = f64::max(most_m, max_displacement(&before, chain.points()).1);
        }
        (most_m, distance(chain.points()[2], [0.0; 2]))
    }

    #[test]
    fn a_straight_arm_is_drawn_inward_and_no_joint_is_faster_than_it_may_be() {
        let joint_step_max_m = 0.08;
        let rules = ReactionRules { joint_step_max_m, ..ReactionRules::default() };
        for n_rods in [3, 7, 11, 25] {
            let rod = Rod::with_fixed_length(1.0, 0.03);
            let mut arm =
                Chain::straight([0.0; 2], [1.0, 0.0], n_rods, rod, Connector::free(0.05)).unwrap();
            arm.set_mobility(0, Mobility::Fixed).unwrap();
            let target = [0.5 * n_rods as f64, 0.0];
            for _ in 0..4000 {
                let before = arm.points().to_vec();
                let to = sidestep_rods::geometry::move_toward(before[n_rods], target, 0.04);
                let request = MotionRequest::from_operator(n_rods, to);
                execute_request(
                    &mut Propagator::new(rules),
                    &mut arm,
                    &Obstacles::default(),
                    &request,
                )
                .unwrap();
                assert!(max_displacement(&before, arm.points()).1 <= joint_step_max_m);
            }
            let left_m = distance(arm.points()[n_rods], target);
            assert!(left_m < 1e-6, "{n_rods} rods: {left_m} m are left");
        }
    }

    /// Leads connector `k` of seven to places one after the other; returns the remaining distance of
    /// the one farthest from its place, and the longest way of a connector in a request.
    fn led(held: &[(usize, Mobility<2>)], k: usize, places: &[Point<2>]) -> (f64, f64) {
        let points = vec![
            [0.0, 0.0],
            [0.6, 0.8],
            [1.2, 1.6],
            [2.2, 1.6],
            [3.2, 1.6],
            [3.8, 0.8],
            [4.4, 0.0],
        ];
        let rods = vec![Rod::with_fixed_length(1.0, 0.02); 6];
        let mut chain = Chain::new(points, vec![Connector::free(0.05); 7], rods).unwrap();
        for (i, mobility) in held {
            chain.set_mobility(*i, *mobility).unwrap();
        }
        let rules = ReactionRules { joint_step_max_m: 0.02, ..ReactionRules::default() };
        let (mut left_m, mut most_m) = (0.0, 0.0);
        for place in places {
            for _ in 0..2000 {
                let before = chain.points().to_vec();
                let to = sidestep_rods::geometry::move_toward(before[k], *place, 0.01);
                let request = MotionRequest::from_operator(k, to);
                let came = execute_request(
                    &mut Propagator::new(rules),
                    &mut chain,
                    &Obstacles::default(),
                    &request,
                )
                .unwrap();
                assert_eq!(came.veto(), None, "{held:?}, on the way to {place:?}");
                most_m = f64::max(most_m, max_displacement(&before, chain.points()).1);
                assert!(chain.max_rod_violation_m() <= 1e-9);
                assert!(held.iter().all(|(i, m)| m.allows(chain.points()[*i], before[*i])));
            }
            left_m = f64::max(left_m, distance(chain.points()[k], *place));
        }
        (left_m, most_m)
    }

    #[test]
    fn an_initiator_reaches_all_that_a_rail_a_plane_a_box_and_two_ends_allow() {
        let rail = Mobility::OnSegment([[0.0, 0.0], [6.0, 0.0]]);
        let upper = Mobility::OnSegment([[0.0, 1.6], [6.0, 1.6]]);
        let line = Mobility::OnPlane { normal: [0.0, 1.0], offset_m: 0.0 };
        let room = Mobility::InBox { lo: [0.0, -1.0], hi: [6.0, 1.0] };
        let anywhere = [[-2.0, 2.0], [4.0, 3.0], [8.0, -2.0], [3.0, -5.0], [3.0, 5.9]];
        let between = [[2.2, 0.5], [2.0, -1.0], [2.0, 1.2], [2.9, -0.3]];
        let two_rails = [(0, rail), (6, rail)];
        for (held, k, places) in [
            (&[(0, rail)][..], 6, &anywhere[..]),
            (&[(0, line)], 6, &anywhere),
            (&[(0, room)], 6, &anywhere),
            (&[(6, rail)], 0, &anywhere),
            (&[(3, upper)], 0, &[[-1.0, 2.0], [4.0, 3.5], [8.0, 0.0]]),
            (&[(0, Mobility::Fixed), (6, Mobility::Fixed)], 3, &between),
            (&[(0, Mobility::Fixed), (6, rail)], 3, &between),
            (&two_rails, 3, &[[2.2, 0.5], [5.0, -2.0], [1.0, 2.0]]),
        ] {
            let (left_m, most_m) = led(held, k, places);
            assert!(left_m < 1e-6, "{held:?}: {left_m} m are left");
            assert!(most_m <= 0.02, "{held:?}: {most_m} m in a request");
        }
    }

    #[test]
    fn a_target_that_no_position_on_the_rail_reaches_is_out_of_reach() {
        let mut chain = arm();
        chain.set_mobility(0, Mobility::OnSegment([[0.0, 0.0], [1.0, 0.0]])).unwrap();
        let request = MotionRequest::from_operator(2, [1.5, 4.0]);
        let came = execute_request(
            &mut Propagator::default(),
            &mut chain,
            &Obstacles::default(),
            &request,
        )
        .unwrap();
        assert_eq!(
            came.veto().map(|veto| (veto.by, veto.reason)),
            Some((0, VetoReason::OutOfReach))
        );
        assert_eq!(chain, {
            let mut same = arm();
            same.set_mobility(0, Mobility::OnSegment([[0.0, 0.0], [1.0, 0.0]])).unwrap();
            same
        });
    }

    #[test]
    fn joints_keep_their_limit_near_a_singular_posture_and_the_tool_still_gets_there() {
        let (free_m, _) = dragged_out(f64::INFINITY);
        assert!(free_m > 0.04, "without a limit the elbow goes {free_m} m for 0.01 m of the tool");
        let (limited_m, reached_m) = dragged_out(0.02);
        assert!(limited_m <= 0.02, "{limited_m}");
        assert!(reached_m > 1.9998, "{reached_m} of 2 m");
    }
}
