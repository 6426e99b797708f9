//! What became of the options that the user gave.
use crate::{
    case::Case,
    error::Result,
    parallel::{Groups, agree},
};
use mpi::traits::*;

/// What the options of the bodies' solvers say and is not done, and the options that nothing has asked for: most likely
/// misspelt, or without a body's prefix. On world rank 0 at least. Collective.
pub(super) fn option_warnings(
    case: &Case,
    groups: &Groups,
    bodies: &[crate::body::Body],
) -> Result<Vec<String>> {
    let of_group = || -> Result<Vec<String>> {
        let mut lines = Vec::new();
        for (&b, body) in std::iter::zip(groups.bodies(), bodies) {
            lines.extend(body.notes().iter().map(|note| format!("body '{}': {note}", body.name)));
            let prefix = crate::body::options_prefix(&case.bodies[b].name);
            let left = crate::petsc::option_prefixes_left(&prefix)?;
            lines.extend(left.iter().map(|name| {
                format!("PETSc option -{name} was not used: misspelt, or nothing of what the body does asks for it")
            }));
        }
        if groups.world.rank() == 0 {
            let left = crate::petsc::option_prefixes_left("")?;
            lines.extend(left.iter().filter(|name| !name.starts_with("body_")).map(|name| {
                let example = crate::body::options_prefix(&case.bodies[0].name);
                format!(
                    "PETSc option -{name} was not used: misspelt, or without the prefix of a body's solver (-{example}{name})"
                )
            }));
        }
        Ok(lines)
    };
    let lines = if groups.is_root() { of_group() } else { Ok(Vec::new()) };
    let lines = agree(&groups.world, lines)?;
    Ok(crate::step::gather_lines(&groups.world, &lines))
}
