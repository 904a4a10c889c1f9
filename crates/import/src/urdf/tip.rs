//! The tip of an arm whose file does not give it.

use super::Model;
use super::tree::quote_names;
use crate::report::{Finding, ImportReport, Treatment};

/// The end of the rule about a tip that is chosen.
const TIP_RULE_END: &str = "where none is given";

/// Words in the names of the parts of a gripper that move: no goal of an arm is meant for them.
const JAW_WORDS: [&str; 5] = ["jaw", "finger", "knuckle", "claw", "pincer"];

/// Words in the names of joints that turn a whole gripper.
const WRIST_WORDS: [&str; 5] = ["wrist", "roll", "pitch", "yaw", "rot"];

/// Words in the names of frames that goals are meant for.
const TOOL_WORDS: [&str; 7] = ["tool", "tcp", "gripper", "grasp", "effector", "hand", "pinch"];

/// Such words that are also parts of others, and so count only between separators.
const SHORT_TOOL_WORDS: [&str; 4] = ["ee", "eef", "tip", "tips"];

/// Words in the names of frames of sensors, which are on many hands.
const SENSOR_WORDS: [&str; 8] =
    ["cam", "optical", "sensor", "imu", "laser", "depth", "lidar", "ft_frame"];

impl Model {
    /// Returns the link that is the tip unless another is given: the leaf with the most movable joints on its
    /// path from the root, of several one that has the name of a tool, then one that has none of a sensor, then the first
    /// in the file. If that leaf is a finger, it is the hand
    /// that carries the fingers, or the only frame that is fixed to the hand and carries nothing. One finger
    /// alone is told from a wrist by the names of its joint and link, or by that frame's.
    pub fn default_tip(&self) -> usize {
        let search = TipSearch::new(self);
        let leaf = search.farthest_leaf();
        let path = self.joint_path(self.root, leaf).expect("every link hangs on the root");
        let hand = (0..path.len()).find_map(|k| search.hand(&path, k));
        if let Some(hand) = hand.or_else(|| search.hand_of_jaw(&path)) {
            return search.tool_frame(hand);
        }
        search.frame_beside_last_joint(&path).unwrap_or(leaf)
    }

    /// Returns what of the report holds where the tip is given: all but the choice of one.
    pub fn findings_with_tip(&self) -> impl Iterator<Item = &Finding> {
        self.report.findings.iter().filter(|finding| !finding.rule.ends_with(TIP_RULE_END))
    }

    /// Records the tip where the file leaves a choice.
    pub(super) fn record_tip(&self, report: &mut ImportReport) {
        let tip = self.default_tip();
        let others: Vec<usize> = self.leaves().into_iter().filter(|leaf| *leaf != tip).collect();
        if others.is_empty() {
            return;
        }
        let rule = format!("the tip is `{}` {TIP_RULE_END}", self.links[tip]);
        let names = others.iter().map(|&link| format!("`{}`", self.links[link]));
        let remedy = format!("another end can be given as the tip: {}", quote_names(names));
        report.record(Treatment::Guessed, rule, "", &remedy);
    }
}

/// A model as the search for its tip sees it. Each list has an entry per link.
struct TipSearch<'a> {
    model: &'a Model,
    /// The link nearest to the root from which no movable joint leads to this one: the same for all links of a rigid
    /// body.
    body: Vec<usize>,
    /// Number of movable joints between the root and the link.
    joints_before: Vec<usize>,
    /// The largest number of movable joints on a path that begins at the link.
    joints_after: Vec<usize>,
}

impl<'a> TipSearch<'a> {
    fn new(model: &'a Model) -> Self {
        let count = model.links.len();
        let mut children = vec![Vec::new(); count];
        for (joint, it) in model.joints.iter().enumerate() {
            children[it.parent].push(joint);
        }
        let mut search = Self {
            model,
            body: (0..count).collect(),
            joints_before: vec![0; count],
            joints_after: vec![0; count],
        };
        // Joints from the root outward, so that each is after the one that carries it.
        let mut joints = children[model.root].clone();
        let mut next = 0;
        while let Some(&joint) = joints.get(next) {
            search.visit_outward(joint);
            joints.extend(&children[model.joints[joint].child]);
            next += 1;
        }
        for &joint in joints.iter().rev() {
            let after = search.branch_length(joint);
            let longest = &mut search.joints_after[model.joints[joint].parent];
            *longest = after.max(*longest);
        }
        search
    }

    fn visit_outward(&mut self, joint: usize) {
        let parent = self.model.joints[joint].parent;
        let child = self.model.joints[joint].child;
        let is_movable = self.is_movable(joint);
        if !is_movable {
            self.body[child] = self.body[parent];
        }
        self.joints_before[child] = self.joints_before[parent] + usize::from(is_movable);
    }

    /// Returns the largest number of movable joints on a path that begins with a joint.
    fn branch_length(&self, joint: usize) -> usize {
        let after = self.joints_after[self.model.joints[joint].child];
        after + usize::from(self.is_movable(joint))
    }

    fn is_movable(&self, joint: usize) -> bool {
        self.model.joints[joint].kind.has_one_value()
    }

    fn farthest_leaf(&self) -> usize {
        let mut best = self.model.root;
        let mut best_rank = (0, 0);
        for leaf in self.model.leaves() {
            let rank = (self.joints_before[leaf], self.name_rank(leaf));
            // Any leaf is better than the root, even where no joint moves.
            if rank > best_rank || best == self.model.root {
                best = leaf;
                best_rank = rank;
            }
        }
        best
    }

    /// Returns how likely the name of a frame is that of a goal: sensors come last.
    fn name_rank(&self, link: usize) -> u8 {
        match () {
            () if self.is_sensor(link) => 0,
            () if self.is_tool(link) => 2,
            () => 1,
        }
    }

    fn is_sensor(&self, link: usize) -> bool {
        has_word(&self.model.links[link].to_lowercase(), &SENSOR_WORDS)
    }

    /// Returns the parent link of joint `path[k]`, if that joint is a finger's: it moves, other joints
    /// move on the same rigid body, and none of these branches has as many movable joints as there are before. A torso
    /// with two arms branches too, but its arms are longer than what carries them.
    fn hand(&self, path: &[usize], k: usize) -> Option<usize> {
        let hand = self.model.joints[path[k]].parent;
        let mut branches = 0;
        let mut longest = 0;
        for (joint, it) in self.model.joints.iter().enumerate() {
            if self.is_movable(joint) && self.body[it.parent] == self.body[hand] {
                branches += 1;
                longest = longest.max(self.branch_length(joint));
            }
        }
        let is_finger = self.is_movable(path[k]) && branches > 1;
        (is_finger && longest < self.joints_before[hand]).then_some(hand)
    }

    /// Returns the link that carries the jaw at the end of a path, or the finger of several joints: one that is alone
    /// looks like a wrist in all but its names.
    fn hand_of_jaw(&self, path: &[usize]) -> Option<usize> {
        let movable = path.iter().rev().filter(|joint| self.is_movable(**joint));
        let first = movable.take_while(|joint| self.is_jaw(**joint)).last()?;
        let hand = self.model.joints[*first].parent;
        (self.joints_before[hand] > 0).then_some(hand)
    }

    fn is_jaw(&self, joint: usize) -> bool {
        let it = &self.model.joints[joint];
        let name = it.name.to_lowercase();
        let child = self.model.links[it.child].to_lowercase();
        if has_word(&name, &JAW_WORDS) || has_word(&child, &JAW_WORDS) {
            return true;
        }
        name.contains("gripper") && !has_word(&name, &WRIST_WORDS)
    }

    /// Returns the frame of a tool that is fixed to what carries the last movable joint of a path, if there is one and
    /// the end of the path is none: the joint is that of a jaw then.
    fn frame_beside_last_joint(&self, path: &[usize]) -> Option<usize> {
        let last = path.iter().rev().find(|joint| self.is_movable(**joint))?;
        let end = self.model.joints[*path.last()?].child;
        let hand = self.model.joints[*last].parent;
        if self.joints_before[hand] == 0 || self.is_tool(end) {
            return None;
        }
        let frame = self.tool_frame(hand);
        (frame != hand && self.is_tool(frame)).then_some(frame)
    }

    fn is_tool(&self, link: usize) -> bool {
        let name = self.model.links[link].to_lowercase();
        let mut words = name.split(|c: char| !c.is_alphanumeric());
        let is_tool =
            has_word(&name, &TOOL_WORDS) || words.any(|word| SHORT_TOOL_WORDS.contains(&word));
        is_tool && !self.is_sensor(link)
    }

    /// Returns the one frame that is fixed to a hand and carries nothing, but no sensor's, or the hand if there is none or
    /// more than one.
    fn tool_frame(&self, hand: usize) -> usize {
        let leaves = self.model.leaves().into_iter();
        let frames: Vec<usize> = leaves
            .filter(|leaf| self.body[*leaf] == self.body[hand] && !self.is_sensor(*leaf))
            .collect();
        match frames[..] {
            [frame] => frame,
            _ => hand,
        }
    }
}

fn has_word(name: &str, words: &[&str]) -> bool {
    words.iter().any(|word| name.contains(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A model of joints, each `parent child type`; links are the letters that occur.
    fn model(joints: &str) -> Model {
        let mut links: Vec<&str> = Vec::new();
        let mut text = String::new();
        for (k, joint) in joints.split(", ").enumerate() {
            let [parent, child, kind] = joint.split(' ').collect::<Vec<_>>()[..] else {
                panic!("{joint}")
            };
            links.extend([parent, child]);
            text += &format!(
                "<joint name=\"j{k}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
                 <limit lower=\"-1\" upper=\"1\"/></joint>"
            );
        }
        links.sort_unstable();
        links.dedup();
        let links: String = links.iter().map(|link| format!("<link name=\"{link}\"/>")).collect();
        Model::parse("m.urdf", &format!("<robot name=\"m\">{links}{text}</robot>"))
            .expect("a model")
    }

    fn tip(joints: &str) -> String {
        let model = model(joints);
        model.links[model.default_tip()].clone()
    }

    #[test]
    fn a_hand_or_its_tool_frame_is_the_tip_and_no_finger() {
        let arm = "a b revolute, b c revolute, c hand fixed";
        let fingers = "hand left prismatic, hand right prismatic";
        assert_eq!(tip(arm), "hand");
        assert_eq!(tip(&format!("{arm}, {fingers}")), "hand");
        assert_eq!(tip(&format!("{arm}, hand tcp fixed, {fingers}")), "tcp");
        // Of two frames none is chosen.
        assert_eq!(tip(&format!("{arm}, hand tcp fixed, hand eye fixed, {fingers}")), "hand");
        // Fingers on parts of their own of the hand.
        let apart = "hand palm fixed, palm left prismatic, hand right prismatic";
        assert_eq!(tip(&format!("{arm}, {apart}")), "palm");
    }

    #[test]
    fn arms_that_branch_off_a_torso_are_no_fingers() {
        let torso = "a torso revolute";
        let arms =
            "torso l1 revolute, l1 l2 revolute, l2 l3 revolute, torso r1 revolute, r1 r2 revolute";
        assert_eq!(tip(&format!("{torso}, {arms}")), "l3");
        let hand = "l3 f revolute, l3 g revolute";
        assert_eq!(tip(&format!("{torso}, {arms}, {hand}")), "l3");
    }

    #[test]
    fn a_gripper_of_one_jaw_is_told_from_a_wrist_by_names() {
        let arm = "a b revolute, b c revolute";
        let jaws =
            ["c jaw prismatic", "c Moving_Jaw revolute", "c finger revolute, finger pad fixed"];
        for jaw in jaws {
            assert_eq!(tip(&format!("{arm}, {jaw}")), "c", "{jaw}");
            assert_eq!(tip(&format!("{arm}, {jaw}, c frame fixed")), "frame", "{jaw}");
        }
        // A finger of two joints.
        assert_eq!(tip(&format!("{arm}, c finger1 revolute, finger1 finger2 revolute")), "c");
        // A jaw without a name beside a frame with one, and a wrist beside a camera.
        assert_eq!(tip(&format!("{arm}, c d revolute, c gripper_frame fixed")), "gripper_frame");
        assert_eq!(tip(&format!("{arm}, c d revolute, c arm_ee fixed")), "arm_ee");
        assert_eq!(tip(&format!("{arm}, c d revolute, c hand_camera fixed")), "d");
        assert_eq!(tip(&format!("{arm}, c d revolute, c knee fixed")), "d");
        assert_eq!(tip(&format!("{arm}, c d revolute, d tool0 fixed, c tool1 fixed")), "tool0");
        // A camera on the hand, before the tool and without one.
        assert_eq!(tip(&format!("{arm}, c camera_link fixed, c moving_jaw revolute")), "c");
        assert_eq!(
            tip(&format!("{arm}, c a_mount fixed, a_mount camera_optical fixed, c tool0 fixed")),
            "tool0"
        );
        assert_eq!(tip(&format!("{arm}, c d405_frame fixed, c ee_link fixed")), "ee_link");
        assert_eq!(
            tip(&format!("{arm}, c camera_link fixed")),
            "camera_link",
            "nothing else is there"
        );
        // A finger that is the whole robot.
        assert_eq!(tip("a finger1 revolute, finger1 finger2 revolute"), "finger2");
    }

    #[test]
    fn a_joint_called_gripper_is_a_jaw_unless_it_turns_one() {
        let text = |name: &str| {
            format!(
                "<robot name=\"so\"><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>\
                 <joint name=\"lift\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/></joint>\
                 <joint name=\"{name}\" type=\"continuous\"><parent link=\"b\"/><child link=\"c\"/></joint>\
                 </robot>"
            )
        };
        for (name, tip) in [("gripper", 1), ("jointGripper", 1), ("gripper_roll", 2), ("j6", 2)] {
            let model = Model::parse("f", &text(name)).expect("a model");
            assert_eq!(model.default_tip(), tip, "{name}");
        }
    }

    #[test]
    fn the_choice_of_a_tip_is_said() {
        let arm = "a b revolute, b c revolute";
        let said = |joints: &str| {
            let findings = model(joints).report.findings;
            findings.iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        assert!(said(arm).is_empty());
        let both = said(&format!("{arm}, c frame fixed, c jaw revolute"));
        let expected = "guessed: the tip is `frame` where none is given; \
                        another end can be given as the tip: `jaw`";
        assert_eq!(both, [expected]);
        let jaw = said(&format!("{arm}, c jaw revolute"));
        assert!(jaw[0].contains("the tip is `c`") && jaw[0].contains("`jaw`"), "{jaw:?}");
    }

    #[test]
    fn a_model_of_ten_thousand_links_is_searched_at_once() {
        let joints: Vec<String> = (0..3000)
            .flat_map(|k| {
                [
                    format!("l{k} l{} revolute", k + 1),
                    format!("l{k} m{k} fixed"),
                    format!("l{k} n{k} revolute"),
                ]
            })
            .collect();
        // Behind the middle, what hangs on a link is shorter than what carries it, and looks like fingers.
        assert_eq!(tip(&joints.join(", ")), "m1501");
    }
}
