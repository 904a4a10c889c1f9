//! Remarks on a valid scenario: what will surprise its author. `sidestep check` shows them.

use super::arms::kinematics::{Motion, Variable};
use super::scenario::Compiled;
use super::world::ChainSpec;
use sidestep_scenario::Remark;

/// Returns the remarks, in the order of the chains.
pub(super) fn remarks<const D: usize>(compiled: &Compiled<D>) -> Vec<Remark> {
    compiled.world.chains.iter().enumerate().filter_map(unlimited).collect()
}

/// Returns a note on joints for whose speed the model gives no limit.
fn unlimited<const D: usize>((k, chain): (usize, &ChainSpec<D>)) -> Option<Remark> {
    let arm = chain.arm.as_deref()?;
    let speeds = arm.serial.variables.iter().zip(arm.follower.speeds());
    let taken = |(v, speed): (&Variable, &f64)| {
        let unit = if v.motion == Motion::Turn { "rad/s" } else { "m/s" };
        v.max_speed.is_none().then(|| format!("`{}` {speed:.4} {unit}", v.name))
    };
    let taken: Vec<String> = speeds.filter_map(taken).collect();
    (!taken.is_empty()).then(|| {
        let words = format!(
            "the model gives no velocity for some joints, which are taken to reach: {}; write \
             <limit velocity=\"...\"/> for others",
            taken.join(", ")
        );
        Remark::note(format!("chains.{k}.arm"), words)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_scenario::Source;

    /// Hinges that all turn about one direction, by their number.
    fn planar(hinges: usize) -> String {
        let link = |k: usize| format!("<link name=\"l{k}\"/>");
        let joint = |k: usize| {
            format!(
                "<joint name=\"j{k}\" type=\"continuous\"><parent link=\"l{k}\"/><child link=\"l{}\"/>\
                 <origin xyz=\"0 0 0.3\"/><axis xyz=\"0 1 0\"/></joint>",
                k + 1
            )
        };
        let links: String = (0..=hinges).map(link).collect();
        let joints: String = (0..hinges).map(joint).collect();
        format!("<robot name=\"planar\">{links}{joints}</robot>")
    }

    #[test]
    fn joints_without_a_velocity_are_told_with_the_speed_that_they_are_taken_to_reach() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("arm.urdf"), planar(4)).expect("written");
        let text = "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[[chains]]\n\
                    arm = { urdf = \"arm.urdf\" }\nradius_m = 0.02\n\
                    [[chains.tasks]]\nkind = \"targets\"\nconnector = 3\ntargets_m = [[0.3, 0.0, 0.8]]\nspeed_m_s = 0.2\n";
        let source = Source::new("s.toml", text, folder.path());
        let compiled = Compiled::<3>::new(&source).expect("valid");
        let [told] = &remarks(&compiled)[..] else { panic!("one remark") };
        assert_eq!(told.key, "chains.0.arm");
        assert!(told.words.contains("`j0` 3.1416 rad/s"), "{}", told.words);
    }
}
