//! The tip of an arm whose file does not give it.

use super::Model;

impl Model {
    /// Returns the link that is the tip unless another is given: the leaf with the most movable joints on its
    /// path from the root, of several the first in the file. If that leaf is a finger, it is the hand
    /// that carries the fingers, or the only frame that is fixed to the hand and carries nothing.
    pub fn default_tip(&self) -> usize {
        let leaf = self.farthest_leaf();
        let path = self.path_to(leaf);
        let hand = (0..path.len()).find_map(|k| self.hand(&path, k));
        hand.map_or(leaf, |hand| self.tool_frame(hand))
    }

    fn farthest_leaf(&self) -> usize {
        let mut best = self.root;
        let mut best_count = 0;
        for leaf in self.leaves() {
            let count = self.movable_joints(&self.path_to(leaf));
            // Any leaf is better than the root, even where no joint moves.
            if count > best_count || best == self.root {
                best = leaf;
                best_count = count;
            }
        }
        best
    }

    fn path_to(&self, link: usize) -> Vec<usize> {
        self.joint_path(self.root, link).expect("every link hangs on the root")
    }

    fn is_movable(&self, joint: usize) -> bool {
        self.joints[joint].kind.has_one_value()
    }

    fn movable_joints(&self, path: &[usize]) -> usize {
        path.iter().filter(|&&joint| self.is_movable(joint)).count()
    }

    /// Returns the parent link of joint `path[k]`, if that joint is a finger's: it moves, other joints
    /// move on the same rigid body, and none of these branches has as many movable joints as there are before. A torso
    /// with two arms branches too, but its arms are longer than what carries them.
    fn hand(&self, path: &[usize], k: usize) -> Option<usize> {
        let joints_before = self.movable_joints(&path[..k]);
        let hand = self.joints[path[k]].parent;
        let body = self.rigid_links(hand);
        let is_branch = |joint: usize| self.is_movable(joint) && body[self.joints[joint].parent];
        let branches = (0..self.joints.len()).filter(|joint| is_branch(*joint)).count();
        let mut longest = 0;
        for leaf in self.leaves() {
            let path = self.path_to(leaf);
            if let Some(start) = path.iter().position(|joint| is_branch(*joint)) {
                longest = longest.max(self.movable_joints(&path[start..]));
            }
        }
        (is_branch(path[k]) && branches > 1 && longest < joints_before).then_some(hand)
    }

    /// Returns for each link whether no movable joint lies between it and `link`.
    fn rigid_links(&self, link: usize) -> Vec<bool> {
        let mut is_rigid = vec![false; self.links.len()];
        is_rigid[link] = true;
        let mut open = vec![link];
        while let Some(link) = open.pop() {
            for joint in (0..self.joints.len()).filter(|&joint| !self.is_movable(joint)) {
                let ends = [self.joints[joint].parent, self.joints[joint].child];
                for (from, to) in [(ends[0], ends[1]), (ends[1], ends[0])] {
                    if from == link && !is_rigid[to] {
                        is_rigid[to] = true;
                        open.push(to);
                    }
                }
            }
        }
        is_rigid
    }

    /// Returns the one frame that is fixed to a hand and carries nothing, or the hand if there is none or
    /// more than one.
    fn tool_frame(&self, hand: usize) -> usize {
        let body = self.rigid_links(hand);
        let frames: Vec<usize> = self.leaves().into_iter().filter(|&leaf| body[leaf]).collect();
        match frames[..] {
            [frame] => frame,
            _ => hand,
        }
    }
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
    fn a_gripper_of_one_jaw_is_told_from_no_other_joint() {
        assert_eq!(tip("a b revolute, b c revolute, c jaw prismatic"), "jaw");
    }
}
