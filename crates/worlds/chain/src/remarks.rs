//! Remarks on a valid scenario: what will surprise its author. `sidestep check` shows them.

use super::arms::freedom::Freedom;
use super::scenario::Compiled;
use super::world::ChainSpec;
use sidestep_scenario::Remark;

/// Returns the remarks, in the order of the chains.
pub(super) fn remarks<const D: usize>(compiled: &Compiled<D>) -> Vec<Remark> {
    compiled.world.chains.iter().enumerate().filter_map(stiff).collect()
}

/// Returns a warning on an arm that moves as its chain does and not as its joints can.
fn stiff<const D: usize>((k, chain): (usize, &ChainSpec<D>)) -> Option<Remark> {
    let freedom = Freedom::of(chain.arm.as_deref()?);
    (!freedom.is_whole()).then(|| {
        let Freedom { of_joints, of_rods } = freedom;
        let words = format!(
            "its rods can move in {of_rods} independent ways and its joints in {of_joints}: joints cannot \
             follow the chain's motion; `sidestep ik` finds postures that joints can take"
        );
        Remark::warning(format!("chains.{k}.arm"), words)
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
    fn an_arm_whose_joints_cannot_follow_its_chain_is_told() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("arm.urdf"), planar(4)).expect("written");
        let text = "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[[chains]]\n\
                    arm = { urdf = \"arm.urdf\" }\nradius_m = 0.02\n\
                    [[chains.tasks]]\nkind = \"targets\"\nconnector = 3\ntargets_m = [[0.3, 0.0, 0.8]]\nspeed_m_s = 0.2\n";
        let source = Source::new("s.toml", text, folder.path());
        let compiled = Compiled::<3>::new(&source).expect("valid");
        let [told] = &remarks(&compiled)[..] else { panic!("one remark") };
        assert_eq!(told.key, "chains.0.arm");
        assert!(told.words.contains("6 independent ways and its joints in 3"), "{}", told.words);
    }
}
