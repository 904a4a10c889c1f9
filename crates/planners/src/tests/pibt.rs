use super::floors::{Problem, agent, check_step, draw, problems, small_agents};
use crate::pibt::plan;
use crate::{
    Action, ActionModel, GridPose, Instance, Obstructions, Pibt, PibtConfig, PibtState, Seed,
};
use proptest::prelude::*;

const MODELS: [ActionModel; 2] = [ActionModel::Turns, ActionModel::Classical];

fn config(model: ActionModel, seed: u64) -> PibtConfig {
    PibtConfig { model, seed: Seed(seed), ..PibtConfig::default() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_step_has_a_conflict_whatever_the_bodies(
        problem in problems(9, 3, 20), seed in any::<u64>(), max_cache_bytes in 0usize..200,
    ) {
        let config = PibtConfig { max_cache_bytes, ..config(problem.model, seed) };
        let mut pibt = Pibt::new(&problem.free, &problem.sizes(), config).unwrap();
        let mut state = PibtState::new(problem.agents.len());
        let mut poses: Vec<GridPose> = problem.agents.iter().map(|agent| agent.start).collect();
        for step in 0..30 {
            // Goals move on from agent to agent of a size, some have none.
            let goal_of = |index: usize| {
                let other = &problem.agents[(index + step / 10) % problem.agents.len()];
                let is_equal = other.size == problem.agents[index].size;
                (is_equal && !(index + step / 7).is_multiple_of(5)).then_some(other.goal)
            };
            let goals: Vec<_> = (0..poses.len()).map(goal_of).collect();
            let actions = pibt.step(&mut state, &poses, &goals).unwrap();
            poses = check_step(&problem, &poses, actions);
        }
    }

    #[test]
    fn the_size_of_the_cache_changes_no_action(problem in problems(9, 2, 12), seed in any::<u64>()) {
        let run = |max_cache_bytes| {
            let config = PibtConfig { max_cache_bytes, ..config(problem.model, seed) };
            plan(&problem.instance(), config, 40)
        };
        prop_assert_eq!(run(0), run(1 << 20));
    }

    #[test]
    fn wrong_poses_make_agents_wait_and_nobody_enters_their_boxes(
        problem in problems(8, 2, 12), seed in any::<u64>(),
        wrong in proptest::collection::vec((0u32..10, 0u32..10), 12),
    ) {
        let config = config(problem.model, seed);
        let mut pibt = Pibt::new(&problem.free, &problem.sizes(), config).unwrap();
        let mut state = PibtState::new(problem.agents.len());
        let poses: Vec<GridPose> = problem
            .agents
            .iter()
            .zip(&wrong)
            .map(|(agent, at)| GridPose::new(at.0, at.1, agent.start.heading))
            .collect();
        let goals: Vec<_> = problem.agents.iter().map(|agent| Some(agent.goal)).collect();
        let actions = pibt.step(&mut state, &poses, &goals).unwrap().to_vec();
        let covers = |agent: usize, pose: GridPose, at: (u32, u32)| {
            let size = problem.agents[agent].size;
            (pose.col..pose.col + size).contains(&at.0) && (pose.row..pose.row + size).contains(&at.1)
        };
        for &agent in pibt.misplaced_agents() {
            let agent = agent as usize;
            prop_assert_eq!(actions[agent], Action::Wait);
            for other in (0..poses.len()).filter(|&other| other != agent) {
                let after = poses[other].after(actions[other]).unwrap();
                for at in (0..12).flat_map(|col| (0..12).map(move |row| (col, row))) {
                    let both = covers(agent, poses[agent], at) && covers(other, after, at);
                    prop_assert!(!both || covers(other, poses[other], at));
                }
            }
        }
    }
}

#[test]
fn a_body_that_may_still_have_to_stay_is_not_entered_by_those_it_pushes() {
    // The large body pushes two agents. The first one could make way if the ring of agents rotated into the boxes that
    // the large body leaves, but the second one cannot move at all.
    let free = draw("...\n...\n...");
    let ring = [(2, 1), (2, 2), (2, 0), (1, 0), (0, 0)];
    let mut agents = vec![agent(2, (0, 1), (1, 1))];
    agents.extend(ring.map(|at| agent(1, at, at)));
    let problem = Problem { free, model: ActionModel::Classical, agents };
    let config = config(problem.model, 0);
    let mut pibt = Pibt::new(&problem.free, &problem.sizes(), config).unwrap();
    let poses: Vec<GridPose> = problem.agents.iter().map(|agent| agent.start).collect();
    let goals = [Some((1, 1)), None, None, None, None, None];
    let mut state = PibtState { step: 0, ages: vec![9, 0, 0, 0, 0, 0], goals: goals.to_vec() };
    let actions = pibt.step(&mut state, &poses, &goals).unwrap();
    assert_eq!(check_step(&problem, &poses, actions), poses);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30))]

    /// Theorem 1 of the paper: where each box lies on a circle, each agent comes to its goal in time.
    #[test]
    fn each_agent_comes_to_its_goal_where_there_are_circles(
        seed in any::<u64>(), count in 2usize..24, goals in proptest::collection::vec((0u32..6, 0u32..5), 24),
    ) {
        for model in MODELS {
            let free = sidestep_map::planning::FreeSpace::new(6, 5, |col, row| (col, row) != (2, 2));
            let boxes = (0..30).map(|index| (index % 6, index / 6)).filter(|&at| at != (2, 2));
            let mut poses: Vec<GridPose> =
                boxes.take(count).map(|(col, row)| GridPose::new(col, row, 0)).collect();
            let goals: Vec<_> = goals[..count].iter().map(|&at| Some(if at == (2, 2) { (0, 0) } else { at })).collect();
            let mut pibt = Pibt::new(&free, &vec![1; count], config(model, seed)).unwrap();
            let mut state = PibtState::new(count);
            let mut has_arrived = vec![false; count];
            for _ in 0..600 {
                let actions = pibt.step(&mut state, &poses, &goals).unwrap();
                for (agent, &action) in actions.iter().enumerate() {
                    poses[agent] = poses[agent].after(action).unwrap();
                    has_arrived[agent] |= Some(poses[agent].position()) == goals[agent];
                }
            }
            prop_assert!(has_arrived.iter().all(|&arrived| arrived), "{:?} {:?}", model, has_arrived);
        }
    }
}

#[test]
fn agents_rotate_in_a_full_circle() {
    let circle = [[(0, 0), (1, 0)], [(1, 0), (1, 1)], [(1, 1), (0, 1)], [(0, 1), (0, 0)]];
    for model in MODELS {
        let instance = small_agents("..\n..", model, &circle);
        let plan = plan(&instance, config(model, 1), 20).expect("all arrive");
        assert_eq!(plan.validate(&instance), Ok(()));
        if model == ActionModel::Classical {
            assert_eq!(plan.steps(), 1);
        }
    }
}

#[test]
fn agents_whose_actions_take_several_steps_do_not_go_in_a_circle() {
    let ring = [(0, 0), (1, 0), (1, 1), (0, 1)];
    let poses = ring.map(|(col, row)| GridPose::new(col, row, 0));
    let goals = [1, 2, 3, 0].map(|next: usize| Some(ring[next]));
    let waits = |action_steps| {
        let config = PibtConfig { action_steps, ..config(ActionModel::Classical, 0) };
        let mut pibt = Pibt::new(&draw("..\n.."), &[1; 4], config).unwrap();
        let actions = pibt.step(&mut PibtState::new(4), &poses, &goals).unwrap();
        actions.iter().filter(|&&action| action == Action::Wait).count()
    };
    assert_eq!([waits(1), waits(3)], [0, 4]);
}

#[test]
fn two_agents_swap_in_a_corridor_with_a_pocket() {
    for (art, model) in ["......\n###.##", "......\n#.####"]
        .into_iter()
        .flat_map(|art| MODELS.map(|model| (art, model)))
    {
        let ends = [[(0, 1), (5, 1)], [(5, 1), (0, 1)]];
        let instance = small_agents(art, model, &ends);
        let plan = plan(&instance, config(model, 1), 100).expect("all arrive");
        assert_eq!(plan.validate(&instance), Ok(()));
    }
}

#[test]
fn large_bodies_make_way_for_each_other_to_the_side() {
    for model in MODELS {
        for sizes in [[2, 2], [1, 3], [3, 1]] {
            let free = draw("........\n........\n........\n........\n........\n........");
            let agents = vec![agent(sizes[0], (0, 2), (5, 2)), agent(sizes[1], (5, 2), (0, 2))];
            let instance = Instance::new(&free, model, agents).unwrap();
            let plan = plan(&instance, config(model, 1), 100).expect("all arrive");
            assert_eq!(plan.validate(&instance), Ok(()));
        }
    }
}

#[test]
fn agents_pass_each_other_at_a_t_junction() {
    let art = "#####\n.....\n##.##\n##.##";
    let ways = [[(0, 2), (4, 2)], [(4, 2), (0, 2)]];
    for model in MODELS {
        let instance = small_agents(art, model, &ways);
        let plan = plan(&instance, config(model, 3), 200).expect("all arrive");
        assert_eq!(plan.validate(&instance), Ok(()));
    }
}

#[test]
fn an_agent_turns_before_it_goes_and_one_behind_it_waits_for_that() {
    let free = draw("...\n...");
    let mut pibt = Pibt::new(&free, &[1, 1], config(ActionModel::Turns, 0)).unwrap();
    let mut state = PibtState::new(2);
    let poses = [GridPose::new(0, 0, 0), GridPose::new(1, 0, 0)];
    let goals = [Some((1, 0)), Some((1, 1))];
    let actions = pibt.step(&mut state, &poses, &goals).unwrap();
    assert_eq!(actions, [Action::Wait, Action::TurnLeft]);
    let poses = [poses[0], GridPose::new(1, 0, 1)];
    let actions = pibt.step(&mut state, &poses, &goals).unwrap();
    assert_eq!(actions, [Action::Forward, Action::Forward]);
}

#[test]
fn a_chain_of_thousands_of_agents_moves_in_one_step() {
    let agents = 5000;
    let free = sidestep_map::planning::FreeSpace::new(agents + 1, 1, |_, _| true);
    let mut pibt =
        Pibt::new(&free, &vec![1; agents as usize], config(ActionModel::Turns, 0)).unwrap();
    let poses: Vec<_> = (0..agents).map(|col| GridPose::new(col, 0, 0)).collect();
    let goals = vec![Some((agents, 0)); agents as usize];
    let actions = pibt.step(&mut PibtState::new(agents as usize), &poses, &goals).unwrap();
    assert!(actions.iter().all(|&action| action == Action::Forward));
}

#[test]
fn the_agent_that_was_longest_without_its_goal_has_priority_and_a_new_goal_ends_that() {
    let free = draw("...\n###");
    let mut pibt = Pibt::new(&free, &[1, 1], config(ActionModel::Classical, 0)).unwrap();
    let poses = [GridPose::new(0, 1, 0), GridPose::new(2, 1, 0)];
    let goals = vec![Some((1, 1)), Some((1, 1))];
    for (ages, winner) in [([3, 7], 1), ([7, 3], 0)] {
        let mut state = PibtState { step: 0, ages: ages.to_vec(), goals: goals.clone() };
        let actions = pibt.step(&mut state, &poses, &goals).unwrap();
        assert_ne!(actions[winner], Action::Wait);
        assert_eq!(actions[1 - winner], Action::Wait);
        assert_eq!(state.ages, ages.map(|age| age + 1));
        let new_goals = [goals[0], Some((0, 1))];
        pibt.step(&mut state, &poses, &new_goals).unwrap();
        assert_eq!(state.ages, [ages[0] + 2, 0]);
    }
}

#[test]
fn nobody_enters_boxes_of_others_and_an_agent_that_cannot_act_is_not_pushed() {
    let free = crate::FreeSpace::new(4, 1, |_, _| true);
    let mut pibt = Pibt::new(&free, &[1, 1], config(ActionModel::Turns, 1)).unwrap();
    let poses = [GridPose::new(0, 0, 0), GridPose::new(1, 0, 0)];
    let goals = [Some((3, 0)), Some((3, 0))];
    let mut actions = |boxes: &[(u32, u32)], idle: &[u32]| {
        let obstructions = Obstructions { boxes, idle };
        let mut state = PibtState::new(2);
        pibt.step_among(&mut state, &poses, &goals, obstructions).unwrap().to_vec()
    };
    assert_eq!(actions(&[], &[]), [Action::Forward, Action::Forward]);
    assert_eq!(actions(&[(2, 0)], &[]), [Action::Wait, Action::Wait]);
    assert_eq!(actions(&[], &[1]), [Action::Wait, Action::Wait]);
    assert_eq!(actions(&[], &[0]), [Action::Wait, Action::Forward]);
    // A box outside of the floor and an agent that is not there are nothing.
    assert_eq!(actions(&[(9, 9)], &[7]), [Action::Forward, Action::Forward]);
}

#[test]
fn wrong_input_is_refused_with_its_place() {
    let free = draw("..#");
    assert!(Pibt::new(&free, &[0], PibtConfig::default()).is_err());
    let mut pibt = Pibt::new(&free, &[1], PibtConfig::default()).unwrap();
    let poses = [GridPose::new(0, 0, 0)];
    let error = pibt.step(&mut PibtState::new(1), &poses, &[Some((2, 0))]).unwrap_err();
    assert_eq!(error.place(), "goals[0]");
    let error = pibt.step(&mut PibtState::new(1), &poses, &[]).unwrap_err();
    assert_eq!(error.place(), "goals");
}
