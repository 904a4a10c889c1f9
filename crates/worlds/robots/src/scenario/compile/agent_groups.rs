//! The groups of robots as lists and pictures show them: a section of a scenario each.

use super::placer::Placer;
use super::{BodyType, Role};
use crate::kinds;
use sidestep_kernel::EntityId;
use sidestep_kernel::view::AgentGroup;

/// Returns the sections of robots by their numbers. One without a name is called by its kind, and by its numbers, too,
/// where another one is called alike.
pub(super) fn agent_groups(
    placer: &Placer,
    types: &[BodyType],
    kinds: &[String],
) -> Vec<AgentGroup> {
    let mut groups: Vec<AgentGroup> = Vec::new();
    for (group, first) in placer.groups.iter().zip(placer.first_ids()) {
        let Some(ty) = group.first_type().filter(|_| group.count > 0) else { continue };
        let ty = &types[usize::from(ty)];
        if !matches!(ty.role, Role::Robot(_)) {
            continue;
        }
        let name = match group.name.trim() {
            "" => format!("{}s", kinds[usize::from(ty.kind)]),
            name => name.to_string(),
        };
        let numbers = first..first + group.count as EntityId;
        groups.push(AgentGroup { name, kind: kinds::ROBOT, numbers });
    }
    let names: Vec<String> = groups.iter().map(|group| group.name.clone()).collect();
    for group in &mut groups {
        let are_several = names.iter().filter(|name| **name == group.name).count() > 1;
        if are_several {
            let first = group.numbers.start;
            let last = group.numbers.end - 1;
            let which =
                if first == last { first.to_string() } else { format!("{first} to {last}") };
            group.name = format!("{} {which}", group.name);
        }
    }
    groups
}
